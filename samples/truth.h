/* truth.h -- truth.json: everything that a scene knows and its photographs do not tell. */
#ifndef GONIOCAM_SAMPLES_TRUTH_H
#define GONIOCAM_SAMPLES_TRUTH_H

#include "scene.h"

/** Name of a shot, "shot07", and of one of its photographs, "shot07_exp2", without extension.
 *  Enough digits are taken that names sort as their numbers do. */
enum { PHOTO_NAME = 48 };
void sam_shot_name(char name[PHOTO_NAME], const struct scene *scene, int shot);
void sam_photo_name(char name[PHOTO_NAME], const struct scene *scene, int shot, int exposure);
/** "tif", "jpg", "dng" or "png". */
const char *sam_photo_extension(const struct scene *scene);
/** The number by which a photograph's noise and true exposure time are drawn. */
uint32_t sam_photo_frame(const struct scene *scene, int shot, int exposure);

/** STATUS_IO, STATUS_MEMORY. */
enum status sam_truth_write(const struct scene *scene, const char *path, struct error *err);
#endif
