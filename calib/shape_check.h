/* shape_check.h -- is the sample the shape that it is said to be? Internal to calib/. */
#ifndef GONIOCAM_SHAPE_CHECK_H
#define GONIOCAM_SHAPE_CHECK_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Where an outline touches the sample: the tangent plane that is seen there lies `off` mm outwards
 *  of the placed shape's. */
struct touch {
    vec3 arm, normal;  // world; from the sample's center; unit
    double off, sigma;
    double px_per_mm;
    int view;
};

/** A pattern in which the outline strays from the shape. */
struct misfit {
    const char *pattern;       // "an ellipsoid", ...; NULL: the shape is as it is said to be
    double outwards, inwards;  // mm; the most, where it was seen: >= 0
    vec3 most, least;          // unit, from the center: where
    double sigma;              // mm, of the larger of the two
};

/** Test the touches ([count], views counted in `views`) of a placed sample for the patterns that
 *  its shape may fail in, and return the largest that is significant. STATUS_MEMORY. */
enum status cal_shape_check(struct misfit *misfit, const struct sample *sample,
                            const struct touch *touch, int count, int views, struct error *err);

/** Warn of what cal_shape_check finds. */
enum status cal_shape_warn(const struct sample *sample, const struct touch *touch, int count,
                           int views, struct run *run, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
