/* sensor.h -- levels and noise, from photosites seen in the frames of brackets. */
#ifndef GONIOCAM_SENSOR_H
#define GONIOCAM_SENSOR_H

#include "capture.h"

/** Photosites of one bracket. Times ascend. */
struct bracket_sample {
    int frames;
    const double *time;         // [frames]
    const uint16_t *const *dn;  // [frames][photosites][3]
    size_t photosites;
};

/** What is known beforehand, in DN and electrons; NAN: find it. */
struct sensor_known {
    double black, white, gain, read_noise;
    bool encoded;  // linearised 8-bit codes: black is 0, and clipped regions ring
};

/** What could not be found and was assumed. */
struct sensor_doubts {
    bool black, noise;
};

/** Black and white of channel c: levels.c. read_noise (DN) may be 0 where it is not known yet. */
void sensor_find_levels(struct sensor *sensor, int c, const struct bracket_sample *sample,
                        int samples, const struct sensor_known *known,
                        struct sensor_doubts *doubts);
/** Gain and read noise of channel c, whose levels are known: noise.c. */
void sensor_find_noise(struct sensor *sensor, int c, const struct bracket_sample *sample,
                       int samples, const struct sensor_known *known, struct sensor_doubts *doubts);
/** Both, for all channels. */
void sensor_from_samples(struct sensor *sensor, const struct bracket_sample *sample, int samples,
                         const struct sensor_known *known, struct sensor_doubts *doubts);
#endif
