/* response.c -- curves that are known beforehand: sRGB, and none. */
#include "response.h"

double response_srgb(double v)
{
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

void response_known(struct curve *curve, enum response kind)
{
    *curve = (struct curve){0};
    for (int code = 0; code < 256; code++) {
        double v = code / 255.0;
        double linear = kind == RESPONSE_LINEAR ? v : response_srgb(v);
        for (int c = 0; c < 3; c++)
            curve->dn[c][code] = (float)(65535 * linear);
    }
}
