/* flat.h -- vignetting, from a photograph of something uniform. */
#ifndef GONIOCAM_FLAT_H
#define GONIOCAM_FLAT_H

#include "response.h"

enum { FLAT_DEGREE = 6, FLAT_TERMS = (FLAT_DEGREE + 1) * (FLAT_DEGREE + 2) / 2 };

/** A smooth model of what a lens leaves of the light, at most 1, per channel; see flat.c. Owns
 *  across; {0} is empty; release with flat_free(). */
struct flat {
    int width, height;
    double coefficient[3][FLAT_TERMS];
    float *across;  // [FLAT_DEGREE + 1][width]: the polynomials along a row
};
void flat_free(struct flat *flat);

/** Fit capture->flat, photographed with a sensor of known levels; cfa becomes that of the flat's
 *  mosaic, or "".
 *  STATUS_IO, STATUS_FORMAT; STATUS_DATA: another size, saturated, dark. */
enum status flat_fit(struct flat *flat, const struct capture *capture, const struct sensor *sensor,
                     const struct curve *curve, int camera, char cfa[CFA_SIZE], struct error *err);
/** row[width][3] of the model at row y; all three channels also of a mosaic. */
void flat_row(const struct flat *flat, int y, float *row);
/** The model of an image [height][width][3] itself, of any scale; false: not positive. */
bool flat_fit_image(struct flat *flat, const float *image, int width, int height);
#endif
