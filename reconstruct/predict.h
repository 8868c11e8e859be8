/* predict.h -- a shot beside what it should look like: the photograph of the sample, and the
 * picture that a calibration and a BRDF predict of it. */
#ifndef GONIOCAM_PREDICT_H
#define GONIOCAM_PREDICT_H

#include "samples.h"

/** The part of a shot that shows the sample, made smaller: a pixel (i, j) is the mean over
 *  photosites of the step x step block that begins at the photosite (x0 + i step, y0 + j step).
 *  Radiance is the map's, vignetting included. NAN: the sample is not seen there, within a
 *  photosite of its outline, or its photosites were saturated in all frames. What is seen but not
 *  lit is predicted as the light from the board alone, 0 where none is known.
 *  Owns photograph and predicted; {0} is empty; release with rec_prediction_free(). */
struct prediction {
    int x0, y0, step, width, height;
    float *photograph, *predicted;  // [height][width][3]: red, green, blue
};

/** What a picture is predicted from. Borrows everything. */
struct prediction_of {
    const struct calibration *calibration;  // its surroundings, where known, light the sample too
    int view;                               // index into calibration->view
    const struct brdf *brdf;
    const struct radiance *map;        // the shot, as cap_radiance_read() gives it
    const struct board_extent *board;  // may be NULL: nothing is behind it
    const struct blockers *blockers;   // may be NULL: nothing is in the way
};

/** Predict a shot, at most `size` pixels wide and high, or as large as the sample is seen. Light
 *  comes from the lamp over the photosites' squares as for the samples (footprint.c), and from the
 *  lit board; the lens's blur, glare and the sensor's noise are not predicted. On success the
 *  caller owns *prediction. STATUS_FORMAT: map and camera differ in size; STATUS_MEMORY. */
enum status rec_predict(struct prediction *prediction, const struct prediction_of *of, int size,
                        struct error *err);
void rec_prediction_free(struct prediction *prediction);

/** Photograph over prediction, one channel of a pixel: 1 where the BRDF is right; NAN where either
 *  is, and where less than a thousandth of `bright` is predicted. */
float rec_prediction_ratio(const struct prediction *prediction, int x, int y, int channel,
                           float bright);

#endif
