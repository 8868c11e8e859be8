/* axes.h -- Cartesian axes, linear, logarithmic, or by the square root, and what is drawn in them.
 */
#ifndef GONIOCAM_AXES_H
#define GONIOCAM_AXES_H

#include "pen.h"

enum scale { SCALE_LINEAR, SCALE_LOG, SCALE_ROOT };
struct axis {
    enum scale scale;
    double low, high;
    double step;        // between ticks of a linear axis; 0: a round one
    const char *label;  // NULL: neither label nor numbers
};
struct axes {
    struct axis x, y;
    double left, top, width, height;  // of the frame; labels stand outside
};

/** From 0 to 1 along an axis. */
double rec_axis_share(const struct axis *axis, double value);
point2 rec_axes_at(const struct axes *axes, double x, double y);
/** Frame, grid lines, ticks with their numbers, labels. grid false: ticks outside only, for
 *  pictures. */
void rec_axes_draw(struct pen *pen, const struct axes *axes, bool grid);
/** A curve through [n] points, cut off at the frame's top and bottom; NAN interrupts it. */
void rec_axes_curve(struct pen *pen, const struct axes *axes, const double *x, const double *y,
                    int n, pen_style style);
/** The area between two curves, where both are numbers. */
void rec_axes_band(struct pen *pen, const struct axes *axes, const double *x, const double *low,
                   const double *high, int n, enum ink ink, double opacity);
/** A number for people: powers of ten as such, 0.01, 100, beyond with an exponent. */
void rec_number(char text[24], double value);
/** Move low and high outwards to 1, 2 or 5 times a power of ten, at most `decades` apart and at
 *  least a factor of 4. */
void rec_decades(double *low, double *high, int decades);

#endif
