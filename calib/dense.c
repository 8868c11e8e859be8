/* dense.c -- Cholesky for small symmetric matrices. */
#include "dense.h"

#include <math.h>
#include <string.h>

bool dense_cholesky(int n, double *a)
{
    for (int j = 0; j < n; j++) {
        double *row_j = a + j * n;
        for (int i = j; i < n; i++) {
            double *row_i = a + i * n, sum = row_i[j];
            for (int k = 0; k < j; k++)
                sum -= row_i[k] * row_j[k];
            if (i > j)
                row_i[j] = sum / row_j[j];
            else if (sum > 0)
                row_j[j] = sqrt(sum);
            else
                return false;  // also of NaN
        }
    }
    return true;
}

void dense_solve(int n, const double *l, double *b)
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            b[i] -= l[i * n + k] * b[k];
        b[i] /= l[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            b[i] -= l[k * n + i] * b[k];
        b[i] /= l[i * n + i];
    }
}

void dense_inverse(int n, const double *l, double *inverse)
{
    for (int j = 0; j < n; j++) {
        double *row = inverse + j * n;  // the inverse is symmetric
        memset(row, 0, (size_t)n * sizeof *row);
        row[j] = 1;
        dense_solve(n, l, row);
    }
}

void dense_whitener(int n, const double *l, double *w)
{
    memset(w, 0, (size_t)n * (size_t)n * sizeof *w);
    for (int j = 0; j < n; j++)
        for (int i = j; i < n; i++) {
            double sum = i == j;
            for (int k = j; k < i; k++)
                sum -= l[i * n + k] * w[k * n + j];
            w[i * n + j] = sum / l[i * n + i];
        }
}
