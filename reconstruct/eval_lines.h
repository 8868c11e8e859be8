/* eval_lines.h -- a BRDF as a filter: lines of angles to lines of colours. */
#ifndef GONIOCAM_EVAL_LINES_H
#define GONIOCAM_EVAL_LINES_H

#include "brdf.h"

/** Read lines "theta_i theta_o phi" in degrees (phi = azimuth(wo) - azimuth(wi), 180 is the mirror
 *  side) from a file descriptor until it ends, and write lines "r g b". Empty lines and those that
 *  begin with # say nothing. What has come is answered before more is waited for. STATUS_FORMAT: a
 *  line is none of these, told with its number; all before it are answered. STATUS_IO,
 *  STATUS_MEMORY. */
enum status rec_eval_lines(const struct brdf *brdf, int in, FILE *out, int threads,
                           struct error *err);

#endif
