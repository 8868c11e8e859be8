/* tag_trouble.h -- what is wrong with a tag that the others contradict. Internal to calib/. */
#ifndef GONIOCAM_TAG_TROUBLE_H
#define GONIOCAM_TAG_TROUBLE_H

#include "bundle.h"

/** Where the corners of a tag are by the rays of all views that show it, rejected sightings too:
 *  each the point nearest to its rays. *rms_px is their distance from the sightings. false: fewer
 *  than two views show it, or they see it from one side only. */
bool tag_locate(const struct bundle *bundle, int place, vec3 corner[4], double *rms_px);

/** Is it where capture.yaml says, as far as the photographs tell? A test that errs on a tag of a
 * board in place in one of a thousand calibrations: method and figures in tag_trouble.c. */
bool tag_in_place(const struct bundle *bundle, int place);

/** Say in words what is wrong with a tag that is rejected wherever it is seen: another size,
 * another place, turned, bent, or moved between the photographs. */
void tag_trouble(const struct bundle *bundle, int place, char *text, size_t room);
#endif
