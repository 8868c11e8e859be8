/* response.h -- what the codes of encoded photographs (JPEG, 8-bit PNG and TIFF) stand for. */
#ifndef GONIOCAM_RESPONSE_H
#define GONIOCAM_RESPONSE_H

#include "capture.h"

/** DN of each 8-bit code, linear in radiance, 0..65535, per channel; and what is known of it. */
struct curve {
    float dn[3][256];
    double relative[3];  // standard deviation of the curve, of its value, over the used codes
};

/** Linear light of an sRGB code, both 0 to 1 (IEC 61966-2-1). */
double response_srgb(double code);
/** sRGB (IEC 61966-2-1) or linear. */
void response_known(struct curve *curve, enum response kind);
#endif
