/* bundle_noise.h -- the noise of tags about a fit, and tags that are outside it. Internal to
 * calib/.
 */
#ifndef GONIOCAM_BUNDLE_NOISE_H
#define GONIOCAM_BUNDLE_NOISE_H

#include "bundle.h"

enum { TAG_NUMBERS = 8 };  // four corners of two coordinates

/** Half of a tag's weight is gone where chi^2 is five times its mean. */
#define BUNDLE_CAUCHY2 (5.0 * TAG_NUMBERS)

/** Variance of the tags' noise in units of their own covariance: median chi^2 over that of eight
 *  Gaussian numbers, corrected for the freedom that the fit has taken. NAN: out of memory. */
double bundle_noise_scale(const struct bundle *b);
/** Variance of the tags' noise as the weights of the loss see it, where `scale` is the median's:
 *  what a covariance needs, since long tails that the loss tames count by what it leaves of them.
 */
double bundle_tamed_scale(const struct bundle *b, double scale);
/** The same, made so wide that a mean over all corners has the deviation b->shared_px at least. */
double bundle_shared_scale(const struct bundle *b, double scale);
/** Set log_noise: how much of the noise a view has that its tags' covariances do not tell, against
 *  the common `scale`; views with few tags are taken for common ones. STATUS_MEMORY. */
enum status bundle_weigh_views(struct bundle *b, struct error *err);
/** Mark the sightings that disagree; *changed is how many changed sides. STATUS_MEMORY. */
enum status bundle_reject(struct bundle *b, double scale, int *changed, struct error *err);
#endif
