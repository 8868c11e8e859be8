/* lookup.c -- a table evaluated between the middles of its bins.
 *
 * Method.   Linear in the root of theta_h, theta_d and phi_d, about the eight middles around a
 *           place. phi_d goes around with period pi, which is reciprocity. Where theta_h or theta_d
 *           is 0, phi_d has no meaning: a row there holds the mean over phi_d, so that f goes
 *           evenly through such a place. Bins below the horizon go on along theta_d from the last
 *           two above it, by their ratio, at most to twice or half.
 *           With s = wi + wo and d = wi - wo, theta_d = atan(|d|/|s|), and of the axes of
 *           rec_half_diff only d.z is needed, for s.d = 0:
 *               phi_d = atan2((s x d).z, -|s| d.z)
 * Accuracy. Angles to 2e-8 rad, f to a few float roundings; at the middles it is the table's.
 * Speed.    Lanes of 64 pairs: angles as vector instructions, then fetches from memory that are all
 *           under way before the first is waited for.
 */
#include "lookup.h"

#include "lanes.h"

#include <stdlib.h>

// Rows of theta_h and theta_d: 0, then the middles; phi_d's middles and the first again.
enum { H = MERL_THETA_H + 1, D = MERL_THETA_D + 1, P = MERL_PHI_D + 1 };

struct lookup {
    float value[H][D][P][4];  // red, green, blue, nothing
};

/* ---- making ----------------------------------------------------------------------------------
 */

// The values along theta_d, with something in every bin: what is missing goes on from what is
// there.
static void complete(double value[MERL_THETA_D])
{
    double last = -1, ratio = 1;
    int first = 0;
    while (first < MERL_THETA_D && value[first] < 0)
        first++;
    for (int d = 0; d < first; d++)
        value[d] = first < MERL_THETA_D ? value[first] : 0;
    for (int d = first; d < MERL_THETA_D; d++) {
        if (value[d] >= 0) {
            ratio = last > 0 && value[d] > 0 ? value[d] / last : 1;
            last = value[d];
            continue;
        }
        double total = 1;
        while (d < MERL_THETA_D && value[d] < 0) {
            total = fmin(2, fmax(0.5, total * ratio));
            value[d++] = last * total;
        }
        d--;
    }
}

// tan(theta_h) tan(theta_d) |cos(phi_d)| < 1 says that both directions are above the horizon.
struct horizon {
    double tan_h[MERL_THETA_H], tan_d[MERL_THETA_D], cos_p[MERL_PHI_D];
};

static struct horizon horizon_of_centers(void)
{
    struct horizon z;
    for (int h = 0; h < MERL_THETA_H; h++)
        z.tan_h[h] = tan(rec_merl_center(h * MERL_THETA_D * MERL_PHI_D).theta_h);
    for (int d = 0; d < MERL_THETA_D; d++)
        z.tan_d[d] = tan(rec_merl_center(d * MERL_PHI_D).theta_d);
    for (int p = 0; p < MERL_PHI_D; p++)
        z.cos_p[p] = fabs(cos(rec_merl_center(p).phi_d));
    return z;
}

static void take_column(struct lookup *to, const double *from, const struct horizon *z, int h,
                        int p, int channel)
{
    double column[MERL_THETA_D];
    for (int d = 0; d < MERL_THETA_D; d++) {
        bool above = z->tan_h[h] * z->tan_d[d] * z->cos_p[p] < 1;
        column[d] = above ? from[p + MERL_PHI_D * (d + MERL_THETA_D * h)] : -1;
    }
    complete(column);
    for (int d = 0; d < MERL_THETA_D; d++)
        to->value[h + 1][d + 1][p][channel] = (float)column[d];
}

// A row where phi_d has no meaning: the mean of its neighbour's.
static void level(float to[P][4], float (*from)[4])
{
    double sum[4] = {0};
    for (int p = 0; p < MERL_PHI_D; p++)
        for (int c = 0; c < 4; c++)
            sum[c] += from[p][c];
    for (int p = 0; p < P; p++)
        for (int c = 0; c < 4; c++)
            to[p][c] = (float)(sum[c] / MERL_PHI_D);
}

enum status rec_lookup_make(struct lookup **lookup, const struct merl *table, struct error *err)
{
    struct lookup *made = calloc(1, sizeof *made);
    if (!made)
        return cap_fail(err, STATUS_MEMORY, "no memory to evaluate a table");
    const struct horizon z = horizon_of_centers();
#pragma omp parallel for schedule(static)
    for (int h = 0; h < MERL_THETA_H; h++)
        for (int c = 0; c < 3; c++)
            for (int p = 0; p < MERL_PHI_D; p++)
                take_column(made, table->value + (size_t)c * MERL_BINS, &z, h, p, c);
    for (int h = 1; h < H; h++) {
        for (int d = 1; d < D; d++)
            for (int c = 0; c < 3; c++)
                made->value[h][d][P - 1][c] = made->value[h][d][0][c];
        level(made->value[h][0], made->value[h][1]);
    }
    for (int d = 0; d < D; d++)
        level(made->value[0][d], made->value[1][d]);
    *lookup = made;
    return STATUS_OK;
}

size_t rec_lookup_size(void)
{
    return sizeof(struct lookup);
}

void rec_lookup_free(struct lookup *lookup)
{
    free(lookup);
}

/* ---- evaluating ------------------------------------------------------------------------------
 */

// Places in the rows, in bins; -1: below the horizon.
struct places {
    double h[LANES], d[LANES], p[LANES];
};

// atan(y / x) for x, y >= 0, within 2e-8: Abramowitz and Stegun, 4.4.49.
static inline double arc(double y, double x)
{
    double low = y < x ? y : x, high = y < x ? x : y, t = high > 0 ? low / high : 0, t2 = t * t;
    double series = 0.0028662257;
    series = series * t2 - 0.0161657367;
    series = series * t2 + 0.0429096138;
    series = series * t2 - 0.0752896400;
    series = series * t2 + 0.1065626393;
    series = series * t2 - 0.1420889944;
    series = series * t2 + 0.1999355085;
    series = series * t2 - 0.3333314528;
    double a = t + t * t2 * series;
    return y < x ? a : CAP_PI / 2 - a;
}

// Rows stand at 0, and from 1/2 on at every whole bin and a half.
static inline double row(double bins)
{
    return bins < 0.5 ? 2 * bins : bins + 0.5;
}

WIDE static void find_places(struct places *to, const vec3_lanes *wi, const vec3_lanes *wo,
                             int count)
{
    for (int i = 0; i < count; i++) {
        double sx = wi->x[i] + wo->x[i], sy = wi->y[i] + wo->y[i], sz = wi->z[i] + wo->z[i];
        double dx = wi->x[i] - wo->x[i], dy = wi->y[i] - wo->y[i], dz = wi->z[i] - wo->z[i];
        double across2 = sx * sx + sy * sy, s = sqrt(across2 + sz * sz);
        double theta_h = arc(sqrt(across2), sz);
        double theta_d = arc(sqrt(dx * dx + dy * dy + dz * dz), s);
        double y = sx * dy - sy * dx, x = y < 0 ? s * dz : -s * dz;  // folded: y >= 0
        double phi = arc(fabs(y), fabs(x)), phi_d = x < 0 ? CAP_PI - phi : phi;
        double around = phi_d * (MERL_PHI_D / CAP_PI) - 0.5;
        bool up = wi->z[i] > 0 && wo->z[i] > 0;
        to->h[i] = up ? row(MERL_THETA_H * sqrt(theta_h * (2 / CAP_PI))) : -1;
        to->d[i] = row(theta_d * (2 * MERL_THETA_D / CAP_PI));
        to->p[i] = around < 0 ? around + MERL_PHI_D : around;
    }
}

// Between which rows a place is, and how far on.
static inline int between(double place, int rows, float *share)
{
    int low = place > 0 ? (int)place : 0;
    low = low < rows - 2 ? low : rows - 2;
    float on = (float)(place - low);
    *share = on < 1 ? on : 1;
    return low;
}

struct corner {
    const float *at;  // value[h][d][p]
    float h, d, p;    // shares of the next
};

static inline void mix(float f[4], const struct corner *k)
{
    enum { NEXT_P = 4, NEXT_D = 4 * P, NEXT_H = 4 * P * D };
    const float *a = k->at, *b = a + NEXT_D, *c = a + NEXT_H, *d = c + NEXT_D;
    for (int i = 0; i < 4; i++) {
        float aa = a[i] + k->p * (a[i + NEXT_P] - a[i]), bb = b[i] + k->p * (b[i + NEXT_P] - b[i]);
        float cc = c[i] + k->p * (c[i + NEXT_P] - c[i]), dd = d[i] + k->p * (d[i + NEXT_P] - d[i]);
        float low = aa + k->d * (bb - aa), high = cc + k->d * (dd - cc);
        f[i] = low + k->h * (high - low);
    }
}

static void fetch(struct corner corner[LANES], const struct lookup *lookup,
                  const struct places *place, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct corner *k = &corner[i];
        int h = between(place->h[i], H, &k->h), d = between(place->d[i], D, &k->d);
        int p = between(place->p[i], P, &k->p);
        k->at = lookup->value[h][d][p];
        __builtin_prefetch(k->at);
        __builtin_prefetch(lookup->value[h][d + 1][p]);
        __builtin_prefetch(lookup->value[h + 1][d][p]);
        __builtin_prefetch(lookup->value[h + 1][d + 1][p]);
    }
}

void rec_lookup_eval(const struct lookup *lookup, const vec3 *wi, const vec3 *wo, double (*f)[3],
                     size_t count)
{
    vec3_lanes in, out;
    struct places place;
    struct corner corner[LANES];
    for (size_t begin = 0; begin < count; begin += LANES) {
        size_t n = count - begin < LANES ? count - begin : LANES;
        for (size_t i = 0; i < n; i++) {
            rec_lane_set(&in, (int)i, wi[begin + i]);
            rec_lane_set(&out, (int)i, wo[begin + i]);
        }
        find_places(&place, &in, &out, (int)n);
        fetch(corner, lookup, &place, n);
        for (size_t i = 0; i < n; i++) {
            float mixed[4];
            mix(mixed, &corner[i]);
            for (int c = 0; c < 3; c++)
                f[begin + i][c] = place.h[i] < 0 ? 0 : mixed[c];
        }
    }
}
