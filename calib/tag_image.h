/* tag_image.h -- what a tag looks like: its square in the image, and its blurred pattern.
 *
 * The square is [0, 1] x [0, 1], x right and y down on the printed tag; q is a pixel freed of lens
 * distortion, so that square and q are related by a homography.
 */
#ifndef GONIOCAM_TAG_IMAGE_H
#define GONIOCAM_TAG_IMAGE_H

#include "calib.h"
#include "lens.h"
#include "pattern.h"

struct tag_image {
    const struct tag_pattern *pattern;
    double corner[4][2];                // q: bottom left, bottom right, top right, top left
    double blur;                        // variance of the point spread, photosite included; px^2
    double q_by_pixel[2][2];            // at the middle of the tag
    mat3 square_from_q, q_from_square;  // by tag_image_set from corner
};

/** Tag corners in the square, in the order of struct seen_tag. */
extern const double tag_image_corner[4][2];

/** The homographies from the corners. */
void tag_image_set(struct tag_image *image);
/** A homography applied to a point, and its derivative. */
void tag_image_apply(const mat3 *h, const double p[2], double out[2], double by_p[2][2]);

/** Pixels with and without distortion. */
void tag_image_undistort(const struct camera *camera, const double pixel[2], double q[2]);
void tag_image_distort(const struct camera *camera, const double q[2], double pixel[2],
                       double pixel_by_q[2][2]);
/** How the pixel of a q follows the numbers of the lens, in the order of lens.h, where q is what a
 *  pinhole with the camera's present focal lengths and centre sees. */
void tag_image_by_lens(const struct camera *camera, const double q[2],
                       double pixel_by[2][LENS_PARAMETERS]);

/** Whiteness of the pattern under a photosite (0 black, 1 white), and its derivatives. */
struct whiteness {
    double value, by_s, by_t, by_blur;
    double slope2;  // squared slope over the image, 1/px^2
};
/** Whiteness at q; st receives its place in the square. false: cells that are not known are in it.
 */
bool tag_image_whiteness(const struct tag_image *image, const double q[2], double st[2],
                         struct whiteness *out);

#endif
