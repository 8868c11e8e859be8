/* sample_start.h -- the sample to a pixel of its outline. Internal to calib/. */
#ifndef GONIOCAM_SAMPLE_START_H
#define GONIOCAM_SAMPLE_START_H

#include "solid_place.h"

/** Put the sample of a calibration, which has its cameras and views, to a pixel of its outline in
 *  OUT/radiance/SHOT.exr: from where capture.yaml says that it is, or, where no outline is found
 *  there, from wherever one is, with a warning. *prior: of what is no sphere, for
 *  cal_solid_place(). STATUS_DATA: no outline; those of reading a mesh; STATUS_IO,
 *  STATUS_MEMORY. */
enum status cal_sample_start(struct calibration *calibration, struct solid_prior *prior,
                             const struct capture *capture, const char *out, struct run *run,
                             struct error *err);
/** Are the edges that a calibration's sample was placed by a good part of an outline, in all views?
 *  A few that lie on a line, such as the board's own, fit any shape. */
bool cal_edges_enough(const struct calibration *calibration);
#endif
