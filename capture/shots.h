/* shots.h -- photographs in order, grouped into shots. */
#ifndef GONIOCAM_SHOTS_H
#define GONIOCAM_SHOTS_H

#include "capture_yaml.h"

/** Order of names: runs of digits compare as numbers, all else byte by byte. Never 0 for names
 *  that differ. */
int natural_order(const char *a, const char *b);

/** Fill capture->camera and ->shot from capture->photo (ordered, with lamp and settings).
 *  STATUS_DATA: no exposure time, a photograph in two shots of `shots`, ... */
enum status shots_group(struct capture *capture, const struct capture_yaml *yaml,
                        struct error *err);
#endif
