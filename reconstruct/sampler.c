/* sampler.c -- directions drawn in proportion to a table: what no formula has, the table itself
 * has.
 *
 * Method.   h is drawn, and wo mirrored at it: a measured lobe stays where it is for all wi, about
 *           theta_h = 0. For each of 46 angles of light, the hemisphere of h is divided into cells,
 *           by the root of theta_h as the table is and by the azimuth from wi, which is the same
 *           on both sides of it. A cell is drawn as often as f cos_o 4 (wi.h) summed over it says,
 *           and within it all directions are alike. Between two angles of light their cells are
 *           mixed. What f is at least is a matt body, and goes to a cosine lobe; the cells take
 * what is above it. A twentieth of all is a cosine lobe anyway, so that the density is above 0
 *           wherever f may be. The idea of cells of h is J. Lawrence, S. Rusinkiewicz, R.
 * Ramamoorthi, SIGGRAPH 2004.
 */
#include "sampler.h"

#include <stdlib.h>

enum { LIGHTS = 46, H = 2 * MERL_THETA_H, PHI = 32, CELLS = H * PHI, FINE_H = 2, FINE_PHI = 3 };

static const double least_cosine = 0.05;

struct sampler {
    double cos_h[H + 1];             // the cells' borders
    double cosine[LIGHTS];           // the cosine lobe's share
    float cumulated[LIGHTS][CELLS];  // up to and with a cell; the last is 1, or all are 0
    float density[LIGHTS][CELLS];    // of h over solid angle
};

/* ---- making ----------------------------------------------------------------------------------
 */

static double angle_of(int light)
{
    return fmin(light * (CAP_PI / 2) / (LIGHTS - 1), CAP_PI / 2 - 1e-3);
}

static vec3 mirrored(vec3 wi, vec3 h)
{
    return vec3_sub(vec3_scale(h, 2 * vec3_dot(wi, h)), wi);
}

static vec3 half_at(double cos_h, double phi)
{
    double sine = sqrt(fmax(0, 1 - cos_h * cos_h));
    return (vec3){sine * cos(phi), sine * sin(phi), cos_h};
}

// Of the places in a cell, on each side of wi: means of cos_o 4 (wi.h), and of that times f, which
// is the mean of the channels.
struct cell {
    double plain, weight;
};

static void weigh_ring(const struct sampler *s, const struct lookup *lookup, vec3 wi, int ring,
                       struct cell cell[PHI])
{
    enum { EACH = FINE_H * FINE_PHI * 2, ALL = PHI * EACH };
    vec3 in[ALL], out[ALL];
    double jacobian[ALL], f[ALL][3];
    for (int i = 0; i < ALL; i++) {
        int j = i / 2 % FINE_H, k = i / 2 / FINE_H % FINE_PHI, p = i / EACH;
        double down = (j + 0.5) / FINE_H, phi = CAP_PI * (p + (k + 0.5) / FINE_PHI) / PHI;
        double cos_h = s->cos_h[ring] + down * (s->cos_h[ring + 1] - s->cos_h[ring]);
        vec3 h = half_at(cos_h, i % 2 ? -phi : phi);
        in[i] = wi;
        out[i] = mirrored(wi, h);
        jacobian[i] = 4 * fmax(0, vec3_dot(wi, h)) * fmax(0, out[i].z);
    }
    rec_lookup_eval(lookup, in, out, f, ALL);
    for (int p = 0; p < PHI; p++)
        cell[p] = (struct cell){0, 0};
    for (int i = 0; i < ALL; i++) {
        cell[i / EACH].plain += jacobian[i] / EACH;
        cell[i / EACH].weight += jacobian[i] * (f[i][0] + f[i][1] + f[i][2]) / (3 * EACH);
    }
}

// What f is at least, as far as it matters: where little light goes a table may say anything.
static double floor_of(struct cell cell[H][PHI])
{
    const double matters = 0.1;
    double least = INFINITY;
    for (int h = 0; h < H; h++)
        for (int p = 0; p < PHI; p++)
            if (cell[h][p].plain > matters)
                least = fmin(least, cell[h][p].weight / cell[h][p].plain);
    return isfinite(least) ? fmax(0, least) : 0;
}

// Solid angle of a cell of a ring, on both sides of wi.
static double solid_of(const struct sampler *s, int ring)
{
    return 2 * CAP_PI / PHI * (s->cos_h[ring] - s->cos_h[ring + 1]);
}

static void fill(struct sampler *s, const struct lookup *lookup, int light)
{
    struct cell cell[H][PHI];
    double theta = angle_of(light), sum = 0, up_to = 0;
    vec3 wi = {sin(theta), 0, cos(theta)};
    for (int h = 0; h < H; h++)
        weigh_ring(s, lookup, wi, h, cell[h]);
    double body = floor_of(cell);
    for (int h = 0; h < H; h++)
        for (int p = 0; p < PHI; p++) {
            cell[h][p].weight = fmax(0, cell[h][p].weight - body * cell[h][p].plain);
            sum += cell[h][p].weight * solid_of(s, h);
        }
    bool any = sum > 0 || body > 0;
    s->cosine[light] = any ? fmax(least_cosine, CAP_PI * body / (CAP_PI * body + sum)) : 1;
    for (int h = 0; h < H && sum > 0; h++)
        for (int p = 0; p < PHI; p++) {
            up_to += cell[h][p].weight * solid_of(s, h) / sum;
            s->cumulated[light][p + PHI * h] = (float)up_to;
        }
    // What is drawn with is the difference of two floats: the density says the same.
    float before = 0;
    for (int c = 0; c < CELLS; c++) {
        s->density[light][c] = (float)((s->cumulated[light][c] - before) / solid_of(s, c / PHI));
        before = s->cumulated[light][c];
    }
}

enum status rec_sampler_make(struct sampler **sampler, const struct lookup *lookup,
                             struct error *err)
{
    struct sampler *s = calloc(1, sizeof *s);
    if (!s)
        return cap_fail(err, STATUS_MEMORY, "no memory to sample a table");
    for (int h = 0; h <= H; h++)
        s->cos_h[h] = cos(CAP_PI / 2 * h * h / (H * H));
    for (int light = 0; light < LIGHTS; light++)
        fill(s, lookup, light);
    *sampler = s;
    return STATUS_OK;
}

void rec_sampler_free(struct sampler *sampler)
{
    free(sampler);
}

/* ---- drawing ---------------------------------------------------------------------------------
 */

// The two lights about wi, and the share of the second.
static int lights_about(vec3 wi, double *share)
{
    double at = atan2(hypot(wi.x, wi.y), wi.z) * (LIGHTS - 1) / (CAP_PI / 2);
    int low = at < LIGHTS - 2 ? (int)at : LIGHTS - 2;
    *share = fmin(1, at - low);
    return low;
}

static int cell_at(const float cumulated[CELLS], double u)
{
    int low = 0, high = CELLS - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (cumulated[middle] > u)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

static int ring_of(vec3 h)
{
    int ring = (int)(H * sqrt(atan2(hypot(h.x, h.y), h.z) / (CAP_PI / 2)));
    return ring < H ? ring : H - 1;
}

double rec_sampler_draw(const struct sampler *s, vec3 wi, const double u[3], vec3 *wo)
{
    double share, pick = u[0];
    int light = lights_about(wi, &share);
    bool next = u[2] < share;
    double v = next ? u[2] / share : (u[2] - share) / (1 - share);
    const float *cumulated = s->cumulated[light + next];
    double cosine = s->cosine[light + next];
    if (pick < cosine || cumulated[CELLS - 1] <= 0) {
        double phi = 2 * CAP_PI * u[1];
        *wo = half_at(sqrt(1 - v), phi);
    } else {
        double among = (pick - cosine) / (1 - cosine) * cumulated[CELLS - 1];
        int cell = cell_at(cumulated, among), ring = cell / PHI;
        double side = u[1] < 0.5 ? 1 : -1, on = u[1] < 0.5 ? 2 * u[1] : 2 * u[1] - 1;
        double cos_h = s->cos_h[ring] + v * (s->cos_h[ring + 1] - s->cos_h[ring]);
        double phi = CAP_PI * (cell % PHI + on) / PHI;
        vec3 h = half_at(cos_h, atan2(wi.y, wi.x) + side * phi);
        *wo = mirrored(wi, h);
        if (vec3_dot(wi, h) <= 0)
            return 0;
    }
    return wo->z > 0 ? rec_sampler_density(s, wi, *wo) : 0;
}

double rec_sampler_density(const struct sampler *s, vec3 wi, vec3 wo)
{
    double share;
    int light = lights_about(wi, &share);
    vec3 h = vec3_normalize(vec3_add(wi, wo));
    // cos and sin of the azimuth from wi, times lengths
    double along = h.x * wi.x + h.y * wi.y, across = h.y * wi.x - h.x * wi.y;
    double phi = hypot(wi.x, wi.y) > 0 ? fabs(atan2(across, along)) : fabs(atan2(h.y, h.x));
    int p = (int)(phi / CAP_PI * PHI), cell = (p < PHI ? p : PHI - 1) + PHI * ring_of(h);
    double sum = 0;
    for (int k = 0; k < 2; k++) {
        bool any = s->cumulated[light + k][CELLS - 1] > 0;
        double cosine = wo.z / CAP_PI, facets = s->density[light + k][cell] / (4 * vec3_dot(wi, h));
        double part = any ? s->cosine[light + k] : 1;
        sum += (k ? share : 1 - share) * (part * cosine + (1 - part) * facets);
    }
    return sum;
}
