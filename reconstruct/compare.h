/* compare.h -- how far one BRDF is from another, in all measures of the field. */
#ifndef GONIOCAM_COMPARE_H
#define GONIOCAM_COMPARE_H

#include "sphere.h"

/** The measures over a set of bins. */
struct brdf_errors {
    int bins;          // that both have a value in
    double ngan;       // root of the mean of ((f - f') cos_i)^2 sin_i sin_o over even angles
    double low;        // root of the mean of (ln(1 + f cos_i) - ln(1 + f' cos_i))^2 sin_i, likewise
    double log_rms;    // root of the mean of ln((f m + e) / (f' m + e))^2 over directions
    double cube_root;  // mean of |(f - f') m|^(2/3) over directions
    double relative_median, relative_95;  // of |f'/f - 1|, each bin counting once
    double signed_median;                 // of f'/f - 1
};
enum { COMPARE_BANDS = 5, COMPARE_ALL = 3 };
/** Upper limits of the bands of max(theta_i, theta_o), degrees; the first begins at 0. */
extern const double rec_compare_band[COMPARE_BANDS];

/** f is a, which counts as true, f' is b; m = max(cos_i cos_o, 1e-3), e = 1e-3 (method: compare.c).
 */
struct comparison {
    struct brdf_errors channel[COMPARE_ALL + 1];                  // red, green, blue, all
    struct brdf_errors by_angle[COMPARE_ALL + 1][COMPARE_BANDS];  // the same, by band
    struct picture_errors sphere;  // of the pictures of sphere.h, whatever the mask
};
/** Compare at the middles of MERL's bins, where both have a value; mask [MERL_BINS], enum
 * bin_status, may be NULL: then only bins that it calls measured. STATUS_DATA: none is left;
 * STATUS_MEMORY. */
enum status rec_compare(struct comparison *comparison, const struct brdf *a, const struct brdf *b,
                        const uint8_t *mask, struct run *run, struct error *err);
/** Lines for people, or one JSON object. */
void rec_compare_print(const struct comparison *comparison, FILE *to);
void rec_compare_print_json(const struct comparison *comparison, FILE *to);
#endif
