/* preview.h -- a picture to look at. */
#ifndef GONIOCAM_PREVIEW_H
#define GONIOCAM_PREVIEW_H

#include "reconstruct.h"

/** Write preview.png: two spheres under a distant lamp 30 degrees off the view, irradiance pi, in
 *  sRGB: the table, and beside it the fit. Complete or not at all: STATUS_IO, STATUS_MEMORY. */
enum status rec_preview(const struct merl *table, const struct fit *fit, const char *path,
                        struct run *run, struct error *err);

#endif
