/* merge_shots.h -- all shots of a capture become radiance maps. */
#ifndef GONIOCAM_MERGE_SHOTS_H
#define GONIOCAM_MERGE_SHOTS_H

#include "capture.h"

/** cap_merge(); let_go: nobody will look at the maps soon, they need not stay in memory. */
enum status merge_shots(const struct capture *capture, const char *out, struct sensor *sensor,
                        bool *usable, bool let_go, struct run *run, struct error *err);
#endif
