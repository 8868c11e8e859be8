/* rigid.h -- one set of tags brought onto another. Internal to calib/. */
#ifndef GONIOCAM_RIGID_H
#define GONIOCAM_RIGID_H

#include "bundle.h"

/** The rotation nearest to a matrix of positive determinant (Frobenius): its orthogonal polar
 *  factor, by Newton's iteration (N. Higham, "Computing the polar decomposition -- with
 *  applications", 1986). */
mat3 rigid_nearest_rotation(const mat3 *m);
/** The motion q = R p + t that best brings the tags from[] onto those of to[] that are not
 *  `unplaced`, by their corners and normals. Tags without a place (bundle_placed) have no say; at
 *  least one must have. */
pose rigid_motion(const struct tag_place *from, const struct tag_place *to, int tags);
/** A tag moved: q = R p + t. */
struct tag_place rigid_move(const struct tag_place *tag, const mat3 *rotation, vec3 translation);
/** The inverse of a motion. */
pose rigid_inverse(pose motion);
/** first, then second: R2 (R1 p + t1) + t2. */
pose rigid_chain(pose first, pose second);
#endif
