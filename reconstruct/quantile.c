/* quantile.c -- order statistics by sorting. */
#include "quantile.h"

#include <math.h>
#include <stdlib.h>

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double rec_quantile(double *value, int count, double q)
{
    if (count <= 0)
        return NAN;
    qsort(value, (size_t)count, sizeof *value, compare);
    return value[(int)(q * (count - 1))];
}
