/* bundle_problem.h -- a bundle, said as a least-squares problem for Ceres. Internal to calib/. */
#ifndef GONIOCAM_BUNDLE_PROBLEM_H
#define GONIOCAM_BUNDLE_PROBLEM_H

#include "bundle_noise.h"
#include "ceres_shim.h"

enum { POSE = 6, PLACE = 6 };

struct term;
struct place_term;
/** A problem under construction; all arrays are owned. Parameters are cameras, views, places. */
struct workspace {
    struct term *term;         // [sightings]
    struct place_term *known;  // [tags], what is known of places
    struct lens_term *lens;    // [cameras], what is known of cameras
    struct ceres_term *ceres;
    struct ceres_parameter *parameter;
    double (*camera)[LENS_PARAMETERS], (*pose)[POSE];
    double (*place)[PLACE];  // turn about the tag's place at the start, then its centre
    double (*camera_covariance)[LENS_PARAMETERS * LENS_PARAMETERS], (*pose_covariance)[POSE * POSE];
    double (*place_covariance)[PLACE * PLACE];
    bool (*held)[LENS_PARAMETERS];
    bool (*place_held)[PLACE];
    struct tag_place *start;  // [tags] the places when the workspace was made
    struct ceres_problem problem;
};

/** STATUS_MEMORY. workspace_free() accepts one that is empty. */
enum status workspace_make(struct workspace *w, const struct bundle *b, struct error *err);
void workspace_free(struct workspace *w);
/** The unknowns, at their present values. A place is held that is not free, or that fewer than one
 *  sighting tells of. */
void workspace_parameters(struct workspace *w, const struct bundle *b);
/** One term a sighting; `scale` is the common variance of the noise, cauchy the width of the loss
 *  (0: none). With them what is known beforehand. STATUS_SOLVER. */
enum status workspace_terms(struct workspace *w, const struct bundle *b, double scale,
                            double cauchy, struct error *err);
/** Put what the solver found into the calibration and the places. */
void workspace_take(const struct bundle *b, const struct workspace *w);
#endif
