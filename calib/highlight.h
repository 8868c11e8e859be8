/* highlight.h -- where a sphere mirrors a lamp. Internal to calib/. */
#ifndef GONIOCAM_HIGHLIGHT_H
#define GONIOCAM_HIGHLIGHT_H

#include "lamp.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A highlight: its middle, and how far it reaches (radius of the disc of equal area), pixels. */
struct highlight {
    double pixel[2], radius;
};
/** The highlight of a sphere whose image is about the disc at center, in a map or in a photograph
 *  of any scale (saturated photosites count as bright). false: nothing there is that narrow and
 *  that much brighter than the rest. */
bool cal_highlight_find(struct highlight *h, const struct radiance *map, const double center[2],
                        double radius);
/** Direction to what a mirror with a unit normal shows in the unit direction wo. */
vec3 cal_mirror(vec3 normal, vec3 wo);

/** The highlight on a sphere, the sample or a ball, in a view, and the direction to the lamp by it;
 *  its sigma holds noise and the asymmetry of a wide lobe. false: no highlight, or not on it. */
bool cal_highlight_lamp(struct seen_highlight *seen, const struct radiance *map,
                        const struct calibration *calibration, const struct sample *sphere,
                        int view);

#ifdef __cplusplus
}
#endif
#endif
