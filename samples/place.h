/* place.h -- where the cameras stand: poses from eyes and targets, arcs and spirals. */
#ifndef GONIOCAM_SAMPLES_PLACE_H
#define GONIOCAM_SAMPLES_PLACE_H

#include "scene.h"
#include "doc.h"

/** The pose of a camera at `eye` that has `target` in its middle and the world's z upwards (its y,
 *  where it looks along z), then turned about its axis so that the scene turns clockwise by
 *  `roll` in the image. Requires eye != target. */
pose sam_look_at(vec3 eye, vec3 target, double roll);
/** The point at a distance from `center`; azimuth from x towards y. Elevations beyond 90 degrees
 *  go over the top and down on the other side. */
vec3 sam_around(vec3 center, double azimuth, double elevation, double distance);

/** Read the list `shots` of a scene whose lamps and sample are read already, and the hand's
 *  unsteadiness `handheld`. false: out of memory; other errors are kept by the document. */
bool sam_read_shots(struct scene *scene, struct doc *doc);
#endif
