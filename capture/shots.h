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

/** What makes b another shot than a, in words; NULL: nothing but, perhaps, the exposure time. */
const char *shots_difference(const struct photo *a, const struct photo *b);
bool shots_same_times(double a, double b);
/** Did lamps or cameras take turns? Then shot_of[photos] holds shots, numbered as they begin. */
bool shots_take_turns(int *shot_of, const struct capture *capture);
/** Is there an exposure too many or too few, which shifts the brackets behind it? As above. */
bool shots_fall_back(int *shot_of, const struct capture *capture);
/** Warn of missing exposures, and of time stamps against the order of names. */
void shots_warn(const struct capture *capture, struct run *run);
#endif
