/* check.h -- is a BRDF from anywhere one that nature allows, and complete? */
#ifndef GONIOCAM_CHECK_H
#define GONIOCAM_CHECK_H

#include "reconstruct.h"

enum { CHECK_ANGLES = 11 };
/** theta_i of the albedos, degrees. */
extern const double rec_check_angle[CHECK_ANGLES];

/** What a BRDF is found to be, at the middles of MERL's bins above the horizon. Errors are
 * relative, over all channels. */
struct check {
    bool table;             // of MERL's kind: it cannot but be reciprocal
    int bins;               // looked at
    int missing, negative;  // without a value (MERL's -1, not a number); below 0
    double reciprocity_median, reciprocity_95;  // of |f(wi, wo) - f(wo, wi)| over their mean
    double mirror_median, mirror_95;            // of f and f across the plane of incidence
    double albedo[CHECK_ANGLES][3];             // directional-hemispherical reflectance
    double grazing;  // f at 80 to 87 degrees over f at 60 to 70, green, the median over half angles
                     // up to 30 degrees; NAN: nothing is there
};
/** The verdicts: one bit each; 0 is a good one. */
enum check_verdict {
    CHECK_MISSING = 1,      // more than 0.1 % of the bins
    CHECK_NEGATIVE = 2,     // any
    CHECK_RECIPROCITY = 4,  // 95 % above 10 %
    CHECK_MIRROR = 8,       // median above 5 %: grain, or noise
    CHECK_ALBEDO = 16,      // above 1 by more than the sum's error of 0.5 %
    CHECK_GRAZING = 32,     // below 0.6
};

/** STATUS_MEMORY. */
enum status rec_check(struct check *check, const struct brdf *brdf, struct run *run,
                      struct error *err);
unsigned rec_check_verdict(const struct check *check);
/** The verdict in words, a line for each thing that was looked at; or one JSON object. */
void rec_check_print(const struct check *check, FILE *to);
void rec_check_print_json(const struct check *check, FILE *to);

#endif
