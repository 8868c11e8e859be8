/* predicted.h -- OUT/predicted/SHOT.png: photographs beside what table and calibration predict. */
#ifndef GONIOCAM_PREDICTED_H
#define GONIOCAM_PREDICTED_H

#include "predict.h"

/** Full colour of the ratio's picture: 1.1 and more is red, 1/1.1 and less blue. */
#define PREDICTED_RATIO_FULL 1.1

/** What is predicted of. Borrows everything; board and blockers may be NULL. */
struct predicted_of {
    const struct calibration *calibration;
    const struct brdf *brdf;
    const struct board_extent *board;
    const struct blockers *blockers;
    const char *out;
};

/** Write a picture for each view, complete or not at all: the sample as photographed, as predicted
 *  (equally bright), and their ratio in green; black where there is none, or
 *  less than 3 % of the brightest is predicted. STATUS_IO and others of
 *  the maps, STATUS_MEMORY. */
enum status rec_predicted(const struct predicted_of *of, struct run *run, struct error *err);

#endif
