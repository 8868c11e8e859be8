/* near.h -- assertions on doubles, for cmocka. */
#ifndef GONIOCAM_NEAR_H
#define GONIOCAM_NEAR_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

/** |actual - expected| <= tolerance; NaN never is. */
#define assert_near(actual, expected, tolerance)                                                   \
    assert_near_at((double)(actual), (double)(expected), (double)(tolerance), #actual, __FILE__,   \
                   __LINE__)

static inline void assert_near_at(double actual, double expected, double tolerance,
                                  const char *text, const char *file, int line)
{
    if (!(fabs(actual - expected) <= tolerance)) {
        print_error("%s is %.17g, not %.17g +- %g\n", text, actual, expected, tolerance);
        _fail(file, line);
    }
}
#endif
