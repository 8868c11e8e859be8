/* spectrum.c -- reflectance spectra and linear sRGB.
 *
 * Method.   From spectra: the sum of spectrum x D65 x CIE 1931 matching functions. To spectra: a
 *           colour is its grey part, a part of one secondary and one of a primary colour (Smits),
 *           each with a spectrum of its own: that of least slope among those not negative which
 *           have just this colour (Burns), found by leaving out wavelengths that would go below 0.
 * Source.   C. Wyman, P.-P. Sloan, P. Shirley, "Simple Analytic Approximations to the CIE XYZ Color
 *           Matching Functions", JCGT 2013; D65 of CIE 15; IEC 61966-2-1; B. Smits, "An RGB-to-
 *           Spectrum Conversion for Reflectances", JGT 1999; S. A. Burns, "Generating Reflectance
 *           Curves from sRGB Triplets", 2015.
 * Accuracy. The matching functions are within 1 % of the tables; the way back is exact to 1e-9.
 */
#include "spectrum.h"

#include "program.h"

#include <string.h>

enum { FIRST = 380, LAST = 780, STEP = 10, STEPS = (LAST - FIRST) / STEP + 1 };

// D65 at 380 .. 780 nm.
static const double d65[STEPS] = {49.9755, 54.6482, 82.7549, 91.4860, 93.4318, 86.6823, 104.865,
                                  117.008, 117.812, 114.861, 115.923, 108.811, 109.354, 107.802,
                                  104.790, 107.689, 104.405, 104.046, 100.000, 96.3342, 95.7880,
                                  88.6856, 90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268,
                                  80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.3490, 61.6040,
                                  69.8856, 75.0870, 63.5927, 46.4182, 66.8054, 63.3828};

static double bell(double x, double middle, double below, double above)
{
    double t = (x - middle) * (x < middle ? below : above);
    return exp(-0.5 * t * t);
}

static void matching(double nm, double xyz[3])
{
    xyz[0] = 1.056 * bell(nm, 599.8, 0.0264, 0.0323) + 0.362 * bell(nm, 442.0, 0.0624, 0.0374)
             - 0.065 * bell(nm, 501.1, 0.0490, 0.0382);
    xyz[1] = 0.821 * bell(nm, 568.8, 0.0213, 0.0247) + 0.286 * bell(nm, 530.9, 0.0613, 0.0322);
    xyz[2] = 1.217 * bell(nm, 437.0, 0.0845, 0.0278) + 0.681 * bell(nm, 459.0, 0.0385, 0.0725);
}

// What a reflectance of 1 in the step at `nm` adds to linear sRGB, before white is made (1, 1, 1).
static void response(int step, double rgb[3])
{
    static const double rgb_from_xyz[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                              {-0.9692660, 1.8760108, 0.0415560},
                                              {0.0556434, -0.2040259, 1.0572252}};
    double xyz[3];
    matching(FIRST + step * STEP, xyz);
    for (int c = 0; c < 3; c++)
        rgb[c] = d65[step]
                 * (rgb_from_xyz[c][0] * xyz[0] + rgb_from_xyz[c][1] * xyz[1]
                    + rgb_from_xyz[c][2] * xyz[2]);
}

void rec_spectrum_weights(double (*weight)[3], const double *wavelength, int count)
{
    double white[3] = {0, 0, 0};
    memset(weight, 0, (size_t)count * sizeof *weight);
    for (int step = 0, k = 0; step < STEPS; step++) {
        double nm = FIRST + step * STEP, rgb[3];
        while (k + 2 < count && wavelength[k + 1] <= nm)
            k++;
        double share =
            count > 1 ? fmin(fmax((nm - wavelength[k]) / (wavelength[k + 1] - wavelength[k]), 0), 1)
                      : 0;
        response(step, rgb);
        for (int c = 0; c < 3; c++) {
            weight[k][c] += (1 - share) * rgb[c];
            if (count > 1)
                weight[k + 1][c] += share * rgb[c];
            white[c] += rgb[c];
        }
    }
    for (int k = 0; k < count; k++)
        for (int c = 0; c < 3; c++)
            weight[k][c] /= white[c];
}

double rec_spectrum_wavelength(int i)
{
    return 400 + 30 * i;
}

/* ---- spectra of six colours ---------------------------------------------------------------------
 */

enum { N = SPECTRUM_SIZE, UNKNOWNS = N + 3 };

// Gaussian elimination with pivots; the system is small and regular.
static void solve(double a[UNKNOWNS][UNKNOWNS + 1], double *x)
{
    for (int k = 0; k < UNKNOWNS; k++) {
        int pivot = k;
        for (int i = k + 1; i < UNKNOWNS; i++)
            if (fabs(a[i][k]) > fabs(a[pivot][k]))
                pivot = i;
        for (int j = k; j <= UNKNOWNS; j++) {
            double kept = a[k][j];
            a[k][j] = a[pivot][j];
            a[pivot][j] = kept;
        }
        for (int i = k + 1; i < UNKNOWNS; i++) {
            double factor = a[i][k] / a[k][k];
            for (int j = k; j <= UNKNOWNS; j++)
                a[i][j] -= factor * a[k][j];
        }
    }
    for (int k = UNKNOWNS - 1; k >= 0; k--) {
        x[k] = a[k][UNKNOWNS];
        for (int j = k + 1; j < UNKNOWNS; j++)
            x[k] -= a[k][j] * x[j];
        x[k] /= a[k][k];
    }
}

// Least squared slopes with the given colour, by Lagrange's multipliers; where `zero`, nothing.
static void least_slope(double *spectrum, double (*weight)[3], const double rgb[3],
                        const bool zero[N])
{
    double a[UNKNOWNS][UNKNOWNS + 1] = {{0}}, x[UNKNOWNS];
    for (int i = 0; i < N; i++) {
        if (zero[i]) {
            a[i][i] = 1;
            continue;
        }
        a[i][i] = (i > 0) + (i < N - 1);
        if (i > 0)
            a[i][i - 1] = -1;
        if (i < N - 1)
            a[i][i + 1] = -1;
        for (int c = 0; c < 3; c++)
            a[i][N + c] = weight[i][c];
    }
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < N; i++)
            a[N + c][i] = zero[i] ? 0 : weight[i][c];
        a[N + c][UNKNOWNS] = rgb[c];
    }
    solve(a, x);
    memcpy(spectrum, x, N * sizeof *spectrum);
}

static void find_basis(double *spectrum, double (*weight)[3], const double rgb[3])
{
    bool zero[N] = {false}, negative = true;
    for (int round = 0; negative && round < N; round++) {
        least_slope(spectrum, weight, rgb, zero);
        negative = false;
        for (int i = 0; i < N; i++)
            if (spectrum[i] < -1e-12) {
                zero[i] = true;
                negative = true;
            }
    }
    for (int i = 0; i < N; i++)
        spectrum[i] = fmax(0, spectrum[i]);
}

// Of the colours whose bits are set: 1 red, 2 green, 4 blue; 7 is white.
static double basis[8][N];

static void find_bases(void)
{
    double wavelength[N], weight[N][3];
    for (int i = 0; i < N; i++)
        wavelength[i] = rec_spectrum_wavelength(i);
    rec_spectrum_weights(weight, wavelength, N);
    for (int bits = 1; bits < 8; bits++) {
        double rgb[3] = {bits & 1, bits >> 1 & 1, bits >> 2 & 1};
        find_basis(basis[bits], weight, rgb);
    }
}

void rec_spectrum_of_rgb(double *spectrum, const double rgb[3])
{
    double left[3];
#pragma omp critical(rec_spectrum_bases)
    if (basis[7][0] == 0)
        find_bases();
    for (int c = 0; c < 3; c++)
        left[c] = fmax(0, rgb[c]);
    memset(spectrum, 0, N * sizeof *spectrum);
    for (int part = 0; part < 3; part++) {  // white, a secondary, a primary colour
        int bits = 0;
        double least = INFINITY;
        for (int c = 0; c < 3; c++)
            if (left[c] > 0) {
                bits |= 1 << c;
                least = fmin(least, left[c]);
            }
        for (int i = 0; bits && i < N; i++)
            spectrum[i] += least * basis[bits][i];
        for (int c = 0; bits && c < 3; c++)
            left[c] = fmax(0, left[c] - least);
    }
}
