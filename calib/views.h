/* views.h -- which shots become views, and of which cameras. Internal to calib/. */
#ifndef GONIOCAM_VIEWS_H
#define GONIOCAM_VIEWS_H

#include "sightings.h"

/** Three views are the least that fix a camera's focal length, centre and distortion. */
enum { VIEWS_MIN = 3 };
/** Tags that a shot has to show. */
int views_tags_enough(const struct capture *capture);
/** Which shots become views: chosen [shots], by the number of tags and then by that of their
 *  camera's shots. Warns of those left out. */
void views_choose(bool *chosen, const struct sightings *list, const struct capture *capture,
                  const bool *usable, struct run *run);
/** STATUS_DATA: too few are chosen. */
enum status views_enough(const bool *chosen, const struct sightings *list,
                         const struct capture *capture, struct error *err);
/** Cameras that have views, and the views, in order of the shots; sightings of chosen shots,
 *  renumbered. kind [capture->cameras] receives the camera_kind of each camera. STATUS_MEMORY. */
enum status views_make(struct calibration *c, struct sightings *list, int *kind, const bool *chosen,
                       const struct capture *capture, struct error *err);
/** Forget views that are not kept, and their sightings; the order of the others stays. */
void views_drop(struct calibration *c, struct sightings *list, const bool *kept);
/** Sightings of a view (before views_make: of a shot) that are not rejected. */
int sightings_of(const struct sightings *list, int view);
#endif
