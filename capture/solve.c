/* solve.c -- Cholesky's method. */
#include "solve.h"

#include <math.h>
#include <stddef.h>

bool solve_spd(double *a, double *b, int n)
{
    for (int i = 0; i < n; i++) {
        double *ai = a + (size_t)i * n;
        for (int j = 0; j <= i; j++) {
            const double *aj = a + (size_t)j * n;
            double sum = ai[j];
            for (int k = 0; k < j; k++)
                sum -= ai[k] * aj[k];
            if (i == j && !(sum > 0))
                return false;
            ai[j] = i == j ? sqrt(sum) : sum / aj[j];
        }
    }
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            b[i] -= a[(size_t)i * n + k] * b[k];
        b[i] /= a[(size_t)i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            b[i] -= a[(size_t)k * n + i] * b[k];
        b[i] /= a[(size_t)i * n + i];
    }
    return true;
}
