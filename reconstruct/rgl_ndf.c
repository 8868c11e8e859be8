/* rgl_ndf.c -- a distribution of normals from the light that a BRDF sends straight back.
 *
 *      f(w, w) = D(w) / (4 cos(theta) sigma(w))       sigma(w) = integral of D(m) max(0, w.m)
 *
 * Method.   Of mirrors all alike D is a fixed point of D -> 4 f cos sigma[D]: the leading
 * eigenvector of a kernel of not negative values, found by power iteration (Dupuy et al.). The part
 * of D above its level far from the highlight is raised to the same weight as the rest, its root
 *           spreads over the highlight's flanks, and a constant part covers what no
 * retro-reflection tells. Source.   J. Dupuy, E. Heitz, J.-C. Iehl, P. Poulin, V. Ostromoukhov,
 * "Extracting Microfacet-Based BRDF Parameters from Arbitrary Materials with Power Iterations",
 * EGSR 2015; Dupuy and Jakob 2018.
 */
#include "rgl_ndf.h"

#include "rgl.h"

#include <string.h>

enum { N = RGL_NDF, AZIMUTHS = 24 };

static double theta_of(int i)
{
    return rec_rgl_theta(i / (N - 1.0));
}

/** Integral over the azimuth of max(0, w.m), for polar angles a and b. Its zero is where
 *  cos(phi) = -cot(a) cot(b). */
static double facing(double a, double b)
{
    double p = cos(a) * cos(b), q = sin(a) * sin(b);
    if (q <= p)
        return 2 * CAP_PI * p;
    double end = acos(-p / q);
    return 2 * (p * end + q * sin(end));
}

// Solid angle of node i's share of the hemisphere over 2 pi: sin(theta) d theta by the trapezoid in
// u.
static double share(int i)
{
    double step = 1.0 / (N - 1), u = i * step, half = i == 0 || i == N - 1 ? 0.5 : 1;
    return half * step * CAP_PI * u * sin(theta_of(i));
}

double rec_rgl_projected_area(const double ndf[N], double theta)
{
    double sum = 0;
    for (int i = 0; i < N; i++)
        sum += share(i) * ndf[i] * facing(theta, theta_of(i));
    return sum;
}

static void normalise(double ndf[N])
{
    double area = rec_rgl_projected_area(ndf, 0);
    for (int i = 0; i < N; i++)
        ndf[i] = area > 0 ? ndf[i] / area : 1 / CAP_PI;
}

/** Mean over the channels and over phi_d of f close to the retro-reflection. Where theta_h is too
 *  steep for both directions to stand above the horizon, the last that is not. */
static double sent_back(const struct brdf *brdf, double theta)
{
    const double theta_d = 0.5 * CAP_PI / 180, limit = 88 * CAP_PI / 180;
    double sum = 0;
    for (int k = 0; k < AZIMUTHS; k++) {
        vec3 wi, wo;
        double f[3];
        rec_directions((half_diff){fmin(theta, limit), theta_d, (k + 0.5) / AZIMUTHS * CAP_PI}, &wi,
                       &wo);
        rec_brdf_eval(brdf, wi, wo, f);
        sum += (f[0] + f[1] + f[2]) / (3 * AZIMUTHS);
    }
    return sum;
}

static void iterate(double ndf[N], const double back[N])
{
    enum { ROUNDS = 12 };  // the kernel's second eigenvalue is far below its first
    for (int i = 0; i < N; i++)
        ndf[i] = 1;
    for (int round = 0; round < ROUNDS; round++) {
        double next[N];
        for (int i = 0; i < N; i++)
            next[i] =
                back[i] * cos(fmin(theta_of(i), 1.5)) * rec_rgl_projected_area(ndf, theta_of(i));
        memcpy(ndf, next, sizeof next);
        normalise(ndf);
    }
}

// What stands above the level that D has between 45 and 80 degrees.
static void find_peak(double peak[N], const double ndf[N])
{
    double level = INFINITY;
    for (int i = 0; i < N; i++)
        if (theta_of(i) > CAP_PI / 4 && theta_of(i) < 80 * CAP_PI / 180)
            level = fmin(level, ndf[i]);
    for (int i = 0; i < N; i++)
        peak[i] = fmax(0, ndf[i] - level);
}

void rec_rgl_ndf(double ndf[N], const struct brdf *brdf)
{
    double back[N], peak[N], flank[N], even[N], greatest = 0;
    for (int i = 0; i < N; i++)
        back[i] = sent_back(brdf, theta_of(i));
    iterate(ndf, back);
    find_peak(peak, ndf);
    bool highlight = rec_rgl_projected_area(peak, 0) > 1e-4;
    normalise(peak);
    for (int i = 0; i < N; i++)
        greatest = fmax(greatest, peak[i]);
    for (int i = 0; i < N; i++)
        flank[i] = sqrt(peak[i] / greatest);
    normalise(flank);
    for (int i = 0; i < N; i++)
        even[i] = 1 / (i / (N - 1.0) * sin(theta_of(i)) + 1e-2);
    normalise(even);
    for (int i = 0; i < N; i++)
        ndf[i] = highlight ? 0.25 * peak[i] + 0.2 * flank[i] + 0.1 * ndf[i] + 0.45 * even[i]
                           : 0.3 * ndf[i] + 0.7 * even[i];
    normalise(ndf);
}
