/* geometry.h -- the geometric part of a calibration: cameras and poses from the board's tags. */
#ifndef GONIOCAM_GEOMETRY_H
#define GONIOCAM_GEOMETRY_H

#include "calib.h"

/** Find cameras and poses: fills c->camera and c->view (name, camera, light, pose, sigmas, tags,
 *  rms_px; power is 1), for every usable shot (NULL: all) with enough tags, in order of the shots.
 *  A shot in which no tag, or too few, are found is left out with a warning that names it, and so
 *  is a tag that is not where capture.yaml says. Reads OUT/radiance/SHOT.exr. On success the
 *  caller owns what c holds; on failure c is untouched.
 *  STATUS_DATA: no board, an unknown family, fewer than three usable shots; STATUS_IO;
 *  STATUS_SOLVER. */
enum status cal_geometry(struct calibration *c, const struct capture *capture, const char *out,
                         const bool *usable, struct run *run, struct error *err);

#endif
