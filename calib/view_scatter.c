/* view_scatter.c -- standard deviations from what the views pull apart. */
#include "view_scatter.h"

#include <math.h>
#include <stdbool.h>

static double product(const double *a, const double *b, int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static bool any(const double *a, int n)
{
    int i = 0;
    while (i < n && a[i] == 0)
        i++;
    return i < n;
}

void cal_view_scatter(double *sigma, const double *inverse, const double *gradient, int n,
                      int views)
{
    int seen = 0;
    for (int v = 0; v < views; v++)
        seen += any(gradient + v * n, n);
    for (int a = 0; a < n; a++) {
        double variance = 0;
        for (int v = 0; v < views; v++) {
            const double step = product(inverse + a * n, gradient + v * n, n);
            variance += step * step;
        }
        sigma[a] = sqrt(fmax(variance * seen / fmax(seen - 1, 1), inverse[a * n + a]));
    }
}
