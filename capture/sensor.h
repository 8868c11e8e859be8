/* sensor.h -- levels and noise, from photosites seen in the frames of brackets. */
#ifndef GONIOCAM_SENSOR_H
#define GONIOCAM_SENSOR_H

#include "response.h"

/** Photosites of one channel in the frames of one bracket. Times ascend. */
struct bracket_sample {
    int frames;
    double *time;  // [frames]
    float **dn;    // [frames][photosites]
    size_t photosites;
    int *photo;  // [frames] index into capture->photo; may be NULL
    int shot;
};

/** What is known beforehand, in DN and electrons; NAN: find it. */
struct sensor_known {
    double black[3], white, gain, read_noise;
    double nominal_white;  // what a raw file states: the sensor may saturate earlier
    bool encoded;          // linearised 8-bit codes: black is 0, and clipped regions ring
    bool real;             // of a float file: black is 0, nothing is rounded
};

/** What could not be found and was assumed. */
struct sensor_doubts {
    bool black, noise;
};

/** Black and white of channel c, of which the samples are: levels.c. */
void sensor_find_levels(struct sensor *sensor, int c, const struct bracket_sample *sample,
                        int samples, const struct sensor_known *known,
                        struct sensor_doubts *doubts);
/** Gain and read noise of channel c, whose levels are known: noise.c. */
void sensor_find_noise(struct sensor *sensor, int c, const struct bracket_sample *sample,
                       int samples, const struct sensor_known *known, struct sensor_doubts *doubts);
/** Both, for all channels: sample[3][samples]. */
void sensor_from_samples(struct sensor *sensor, struct bracket_sample *const sample[3], int samples,
                         const struct sensor_known *known, struct sensor_doubts *doubts);

/** All that the merge has to know of a camera. */
struct learned {
    struct sensor sensor;
    struct curve curve;  // where encoded
    bool encoded, recovered;
};

/** Learn camera `camera` from its photographs. seconds[] ([capture->photos]) hold their times as
 *  stated, and afterwards as seen; left_out[] (the same) become true where a photograph moved
 *  against its shot. STATUS_DATA where the photographs do not tell. */
enum status sensor_learn(struct learned *learned, double *seconds, bool *left_out,
                         const struct capture *capture, int camera, struct run *run,
                         struct error *err);
#endif
