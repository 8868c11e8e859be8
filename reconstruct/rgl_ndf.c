/* rgl_ndf.c -- a distribution of normals for RGL files.
 *
 *      f(w, w) = D(w) / (4 cos(theta) sigma(w))       sigma(w) = integral of D(m) max(0, w.m)
 *
 * Method.   Of mirrors all alike D is a fixed point of D -> 4 f cos sigma[D]: the leading
 *           eigenvector of a kernel of not negative values, found by power iteration (Dupuy et
 *           al.). It alone would give hardly a node to the flanks of a highlight, where f falls by
 *           decades, and to the ground beside it. So most of D is made for the grid: as many nodes
 *           for each step of u(theta) as ln f changes there, at the steepest of several difference
 *           angles, and as many again evenly.
 * Source.   J. Dupuy, E. Heitz, J.-C. Iehl, P. Poulin, V. Ostromoukhov, "Extracting Microfacet-
 *           Based BRDF Parameters from Arbitrary Materials with Power Iterations", EGSR 2015; Dupuy
 *           and Jakob 2018.
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

// ln f at theta_h and theta_d, of the mean of the channels; phi_d is 90 degrees, where both
// directions are above the horizon at any theta_h.
static double log_f(const struct brdf *brdf, double theta_h, double theta_d)
{
    const double limit = 89.5 * CAP_PI / 180, floor = 1e-9;
    vec3 wi, wo;
    double f[3];
    rec_directions((half_diff){fmin(theta_h, limit), theta_d, CAP_PI / 2}, &wi, &wo);
    rec_brdf_eval(brdf, wi, wo, f);
    return log(floor + (f[0] + f[1] + f[2]) / 3);
}

/** How fast ln f changes with u at the nodes, at the difference angle where it changes most; its
 *  integral over u is returned. *flat is where it has changed by a tenth from the normal on. */
static double find_rate(double rate[N], double *flat, const struct brdf *brdf)
{
    static const double theta_d_deg[] = {0.5, 45, 70, 80};
    double sum = 0;
    *flat = 1;
    for (int i = 0; i < N; i++)
        rate[i] = 0;
    for (size_t k = 0; k < sizeof theta_d_deg / sizeof *theta_d_deg; k++) {
        double theta_d = theta_d_deg[k] * CAP_PI / 180, value[N];
        for (int i = 0; i < N; i++)
            value[i] = log_f(brdf, theta_of(i), theta_d);
        for (int i = 1; i < N - 1; i++) {
            rate[i] = fmax(rate[i], fabs(value[i + 1] - value[i - 1]) * (N - 1) / 2);
            if (fabs(value[i] - value[0]) > 0.1)
                *flat = fmin(*flat, i / (N - 1.0));
        }
    }
    for (int i = 0; i < N; i++)
        sum += rate[i] / (N - 1);
    return sum;
}

// Neighbours share, so that one kink does not take all nodes.
static void smooth(double value[N])
{
    for (int round = 0; round < 4; round++) {
        double before = value[0];
        for (int i = 1; i < N - 1; i++) {
            double here = value[i];
            value[i] = 0.25 * before + 0.5 * here + 0.25 * value[i + 1];
            before = here;
        }
    }
}

void rec_rgl_ndf(double ndf[N], const struct brdf *brdf)
{
    double back[N], rate[N], nodes[N], flat;
    for (int i = 0; i < N; i++)
        back[i] = sent_back(brdf, theta_of(i));
    iterate(ndf, back);
    double change = fmax(1, find_rate(rate, &flat, brdf));
    smooth(rate);
    // Nodes are even in u where D u sin(theta) is; towards the normal D becomes flat, as f is, and
    // two or three nodes go to where f has not changed yet.
    flat = fmin(fmax(flat, 3.0 / N), 0.6);
    double level = flat / 3 * sin(rec_rgl_theta(flat / 3));
    for (int i = 0; i < N; i++) {
        double u = i / (N - 1.0), peak = exp(-u * u / (flat * flat)) / flat;
        nodes[i] = (1 + rate[i] / change + 0.04 * peak) / (u * sin(theta_of(i)) + level);
    }
    normalise(nodes);
    for (int i = 0; i < N; i++)
        ndf[i] = 0.1 * ndf[i] + 0.9 * nodes[i];
    normalise(ndf);
}
