/* footprint.c -- what photosites span on the sample.
 *
 * Method.   A pixel is the mean of f cos(theta_i)/r^2 over its square. Its directions are means of
 *           n, wi and wo over the square, weighted by cos(theta_i)/r^2, and f is the pixel over the
 *           mean of cos(theta_i)/r^2: exact where f is linear in the directions over the square.
 *           How far the normals spread is kept, for the bend of f (resolution.c). Gauss-Legendre
 *           points, 3 x 3, exact for polynomials to the fifth degree; where the normal hardly turns
 *           within the square its centre alone does. What the lens spreads light over widens the
 *           square to the same variance.
 *           The lamp's disc, evenly bright and a / r wide, spreads wi by its second moment,
 *           (a / 2r)^2 each way; where part of it has set, the photosite is at the terminator.
 * Limits.   A photosite is left out within one photosite of the outline and of the terminator, or
 *           as far as the lens spreads light, or JPEG colour (viewing.c): beyond the edge lies
 *           something else.
 */
#include "rays.h"

#include <string.h>

/** What of the strip needs a closer look; 1 or 0 a lane. */
struct looks {
    float edge[LANES], wide[LANES], dark[LANES], shadowed[LANES];
    float rim[LANES], dusk[LANES];  // within a photosite of the outline (or off), of the terminator
};

// How far the normal turns from one photosite to the next: at the middle of the sample's face it is
// `step`, towards the outline 1/cos_o times as far. Where it turns little, the centre alone serves:
// the square's second moment is 1/12, so the centre errs by (step / cosines)^2 / 24, 4e-5 of f at
// most; no photosite is trusted beyond 1e-3 (samples.c). Squares are compared: no root is taken.
WIDE static void take_centers(struct strip *restrict s, struct looks *restrict look,
                              const struct ray_ends *restrict e,
                              const struct lens_row *restrict lens, vec3 eye, double square,
                              double margin)
{
    const double narrow = 0.03, near = 3 * (margin > square ? margin / square : 1);
    FOR_LANES (i, s->use) {
        double x = e->m.point.x[i] - eye.x, y = e->m.point.y[i] - eye.y;
        double z = e->m.point.z[i] - eye.z;
        double across = lens->by_u[0][i] * lens->by_u[0][i] + lens->by_u[1][i] * lens->by_u[1][i];
        double turn = (double)s->curvature[i] * square;
        double step2 = turn * turn * ((x * x + y * y + z * z) * across);
        double cos_i = e->cos_i[i];
        double cos_o = -(e->ray.x[i] * e->m.normal.x[i] + e->ray.y[i] * e->m.normal.y[i]
                         + e->ray.z[i] * e->m.normal.z[i]);
        double both = cos_i * cos_o, cos2_o = cos_o * cos_o, reach2 = near * near * step2;
        bool edge = (cos2_o * cos2_o <= reach2) | (both * both <= reach2) | !(cos_o > 0);
        bool fine = (step2 < narrow * narrow * both * both) & (both > 0);
        look->edge[i] = edge ? 1.0F : 0;
        look->wide[i] = fine ? 0 : 1.0F;
        look->rim[i] = e->m.hit[i] > 0 ? 0 : 1.0F;
        look->dark[i] = cos_i > 0 ? 0 : 1.0F;
        look->dusk[i] = look->shadowed[i] = 0;
        // Towards the eye 1/cos_o^2 times as much as across (but 100): the mean, h lies anywhere.
        float mean = 1 + 1 / ((float)cos2_o + 0.01F);
        s->spread[0][i] = s->spread[1][i] = (float)step2 / 24 * mean;
        s->wo.x[i] = (float)-e->ray.x[i];
        s->wo.y[i] = (float)-e->ray.y[i];
        s->wo.z[i] = (float)-e->ray.z[i];
        s->point.x[i] = e->m.point.x[i];
        s->point.y[i] = e->m.point.y[i];
        s->point.z[i] = e->m.point.z[i];
        s->normal.x[i] = (float)e->m.normal.x[i];
        s->normal.y[i] = (float)e->m.normal.y[i];
        s->normal.z[i] = (float)e->m.normal.z[i];
        s->wi.x[i] = (float)e->wi.x[i];
        s->wi.y[i] = (float)e->wi.y[i];
        s->wi.z[i] = (float)e->wi.z[i];
        s->distance[i] = (float)e->distance[i];
        s->irradiance[i] = (float)e->irradiance[i];
    }
}

// Rays that meet nothing, or what is not lit.
WIDE static void add_beyond(struct looks *restrict look, const struct ray_ends *restrict e,
                            lane_span span)
{
    FOR_LANES (i, span) {
        look->rim[i] = e->m.hit[i] > 0 ? look->rim[i] : 1;
        look->dusk[i] = e->cos_i[i] > 0 ? look->dusk[i] : 1;
    }
}

// Eight rays around, as far as what a photosite holds comes from: all of them must meet lit sample.
static void look_around(struct looks *look, const struct pencil *p, struct reach reach,
                        lane_span span)
{
    static const double s = 0.70710678118654752;
    static const double offset[8][2] = {{1, 0},  {s, s},   {0, 1},  {-s, s},
                                        {-1, 0}, {-s, -s}, {0, -1}, {s, -s}};
    struct ray_ends e;
    for (int k = 0; k < 8; k++) {
        double x = offset[k][0], y = offset[k][1];
        rec_trace(&e, p, x * (x < 0 ? reach.before[0] : reach.after[0]),
                  y * (y < 0 ? reach.before[1] : reach.after[1]), span);
        add_beyond(look, &e, span);
    }
}

// A mesh's own look around; its terminator is where the lamp sets within the reach.
static void look_around_mesh(struct looks *look, const struct pencil *p, struct reach reach,
                             lane_span span)
{
    static const double corner[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
    struct ray_ends e;
    FOR_LANES (i, span) {
        look->shadowed[i] = (float)p->mesh.shadowed[i];
        look->rim[i] += (float)p->mesh.rim[i];
        look->dusk[i] = (float)p->mesh.dusk[i];
    }
    for (int k = 0; k < 4; k++) {
        double x = corner[k][0], y = corner[k][1];
        rec_trace(&e, p, x * (x < 0 ? reach.before[0] : reach.after[0]),
                  y * (y < 0 ? reach.before[1] : reach.after[1]), span);
        add_beyond(look, &e, span);
    }
}

// Photosites that share their colour reach as far as their place among those tells.
static void look_at_edges(struct looks *look, const struct pencil *p, const struct strip *s,
                          lane_span span)
{
    const int step = p->v->chroma[0] > 1 ? p->v->chroma[0] : 1;
    for (int k = 0; k < step; k++) {
        struct looks one = *look;
        const struct reach reach = rec_reach(p->v, s->x0 + k, s->y);
        if (p->v->raster)
            look_around_mesh(&one, p, reach, span);
        else
            look_around(&one, p, reach, span);
        for (int i = k; i < LANES; i += step) {
            look->rim[i] = one.rim[i];
            look->dusk[i] = one.dusk[i];
            look->shadowed[i] = one.shadowed[i];
        }
    }
}

WIDE static void take_fates(struct strip *restrict s, const struct looks *restrict look)
{
    FOR_LANES (i, s->use) {
        enum fate fate = look->dusk[i] > 0 ? FATE_TERMINATOR : FATE_USED;
        fate = look->shadowed[i] > 0 ? FATE_SHADOWED : fate;
        fate = look->dark[i] > 0 ? FATE_DARK : fate;
        s->fate[i] = look->rim[i] > 0 ? FATE_OUTLINE : fate;
        s->inner[i] = 1 - look->edge[i];
    }
}

/** Weighted sums over a photosite: w, w n, w wi, w wo, and w n n^T (xx, yy, zz, xy, yz, zx). */
struct means {
    double w[LANES], moment[6][LANES];
    vec3_lanes n, wi, wo;
};

WIDE static void add(struct means *to, const struct ray_ends *e, double weight, lane_span span)
{
    FOR_LANES (i, span) {
        double w = weight * e->irradiance[i];
        double x = e->m.normal.x[i], y = e->m.normal.y[i], z = e->m.normal.z[i];
        to->w[i] += w;
        to->n.x[i] += w * x;
        to->n.y[i] += w * y;
        to->n.z[i] += w * z;
        to->wi.x[i] += w * e->wi.x[i];
        to->wi.y[i] += w * e->wi.y[i];
        to->wi.z[i] += w * e->wi.z[i];
        to->wo.x[i] -= w * e->ray.x[i];
        to->wo.y[i] -= w * e->ray.y[i];
        to->wo.z[i] -= w * e->ray.z[i];
        to->moment[0][i] += w * x * x;
        to->moment[1][i] += w * y * y;
        to->moment[2][i] += w * z * z;
        to->moment[3][i] += w * x * y;
        to->moment[4][i] += w * y * z;
        to->moment[5][i] += w * z * x;
    }
}

WIDE static void normalize(vec3_lanes *v, lane_span span)
{
    FOR_LANES (i, span) {
        double s = 1 / sqrt(v->x[i] * v->x[i] + v->y[i] * v->y[i] + v->z[i] * v->z[i]);
        v->x[i] *= s;
        v->y[i] *= s;
        v->z[i] *= s;
    }
}

// Variance of n along an axis: the normals' second moment, per weight.
static inline double moment_along(const struct means *m, int i, double x, double y, double z)
{
    double sum =
        m->moment[0][i] * x * x + m->moment[1][i] * y * y + m->moment[2][i] * z * z
        + 2 * (m->moment[3][i] * x * y + m->moment[4][i] * y * z + m->moment[5][i] * z * x);
    sum /= m->w[i];
    return sum > 0 ? sum : 0;
}

// The strip's directions and irradiance from the sums, in the lanes that are wide. Spreads are
// taken in the plane in which n tilts towards h, and across it; in any two where n is h.
WIDE static void take_means(struct strip *restrict s, const struct means *restrict m,
                            const float *restrict wide, lane_span span)
{
    FOR_LANES (i, span) {
        bool take = wide[i] > 0;
        double nx = m->n.x[i], ny = m->n.y[i], nz = m->n.z[i];
        double hx = m->wi.x[i] + m->wo.x[i], hy = m->wi.y[i] + m->wo.y[i];
        double hz = m->wi.z[i] + m->wo.z[i], up = hx * nx + hy * ny + hz * nz;
        double x = hx - up * nx, y = hy - up * ny, z = hz - up * nz;
        bool level = x * x + y * y + z * z < 1e-18, turned = nx * nx < 0.5;
        x = level ? (turned ? 0 : -nz) : x;
        y = level ? (turned ? nz : 0) : y;
        z = level ? (turned ? -ny : nx) : z;
        double scale = 1 / sqrt(x * x + y * y + z * z);
        x *= scale;
        y *= scale;
        z *= scale;
        double towards = moment_along(m, i, x, y, z);
        double across = moment_along(m, i, ny * z - nz * y, nz * x - nx * z, nx * y - ny * x);
        s->spread[0][i] = take ? (float)towards : s->spread[0][i];
        s->spread[1][i] = take ? (float)across : s->spread[1][i];
        s->irradiance[i] = take ? (float)m->w[i] : s->irradiance[i];
        s->normal.x[i] = take ? (float)nx : s->normal.x[i];
        s->normal.y[i] = take ? (float)ny : s->normal.y[i];
        s->normal.z[i] = take ? (float)nz : s->normal.z[i];
        s->wi.x[i] = take ? (float)m->wi.x[i] : s->wi.x[i];
        s->wi.y[i] = take ? (float)m->wi.y[i] : s->wi.y[i];
        s->wi.z[i] = take ? (float)m->wi.z[i] : s->wi.z[i];
        s->wo.x[i] = take ? (float)m->wo.x[i] : s->wo.x[i];
        s->wo.y[i] = take ? (float)m->wo.y[i] : s->wo.y[i];
        s->wo.z[i] = take ? (float)m->wo.z[i] : s->wo.z[i];
    }
}

static void average(struct strip *s, const struct pencil *p, const float *wide, lane_span span)
{
    static const double place[3] = {-0.38729833462074169, 0, 0.38729833462074169};  // sqrt(0.15)
    static const double weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    struct means sum = {0};
    struct ray_ends e;
    for (int b = 0; b < 3; b++)
        for (int a = 0; a < 3; a++) {
            rec_trace(&e, p, p->v->square * place[a], p->v->square * place[b], span);
            add(&sum, &e, weight[a] * weight[b], span);
        }
    normalize(&sum.n, span);
    normalize(&sum.wi, span);
    normalize(&sum.wo, span);
    take_means(s, &sum, wide, span);
}

// Lanes whose centre meets the sample, of those that are the strip's business: no others do.
WIDE static void take_hits(struct strip *restrict s, struct ray_ends *restrict center,
                           lane_span ours)
{
    for (int i = 0; i < LANES; i++) {
        s->hit[i] = 0;
        s->fate[i] = FATE_OUTLINE;
    }
    for (int i = ours.first; i < s->from; i++)
        center->m.hit[i] = 0;
    for (int i = s->to; i < ours.end; i++)
        center->m.hit[i] = 0;
    FOR_LANES (i, ours)
        s->hit[i] = (float)center->m.hit[i];
}

// The blocks of a span that may show the sample: all rays of a block lie within its length of the
// one in its middle, and cos(a + b) >= cos a - b.
static lane_span near_sample(const struct lens_row *lens, const struct viewing *v, lane_span span)
{
    lane_span near = {LANES, 0};
    for (int begin = span.first; begin < span.end; begin += BLOCK) {
        const int middle = begin + BLOCK / 2, last = begin + BLOCK - 1;
        vec3 ray = {lens->at[0][middle], lens->at[1][middle], 1};
        double dx = lens->at[0][last] - lens->at[0][begin];
        double dy = lens->at[1][last] - lens->at[1][begin], length = sqrt(dx * dx + dy * dy);
        bool may = vec3_dot(ray, v->to_sample) >= (v->cos_bound - length) * vec3_length(ray);
        near.first = may && begin < near.first ? begin : near.first;
        near.end = may ? begin + BLOCK : near.end;
    }
    return near.end > 0 ? near : (lane_span){0, 0};
}

// The rays through the photosites' centres; false: none meets the sample.
static bool begin(struct strip *s, struct pencil *p, struct ray_ends *center)
{
    const float bend = (float)(1 / p->v->sample->radius);
    rec_lens_row(&p->lens, p->v->lens, s->x0, s->y);
    const lane_span asked = {s->from & -BLOCK, (s->to + BLOCK - 1) & -BLOCK};
    const lane_span ours = near_sample(&p->lens, p->v, asked);
    if (p->v->raster)
        rec_raster_patches(&p->mesh, p->v->raster, p->v, s->x0, s->y, ours);
    rec_trace(center, p, 0, 0, ours);
    take_hits(s, center, ours);
    s->use = rec_lanes_marked(s->hit);
    FOR_LANES (i, s->use)
        s->curvature[i] = p->v->raster ? (float)p->mesh.curvature[i] : bend;
    return s->use.end > 0;
}

// The ball that shines is a / r in sine: it is up as a whole where the lamp's middle is that high.
static void take_disc(struct strip *s, const struct viewing *v, const double *cos_i)
{
    const double radius = v->lamp->radius;
    FOR_LANES (i, s->use)
        s->disc[i] = 0;
    for (int i = s->use.first; i < s->use.end && radius > 0; i++) {
        double sine = radius / (double)s->distance[i];
        s->disc[i] = (float)(sine * sine / 4);
        if (s->fate[i] == FATE_USED && cos_i[i] < sine)
            s->fate[i] = FATE_TERMINATOR;
    }
}

// Lanes whose photosites' edges need a look: all of a cylinder, whose ends come without warning.
WIDE static lane_span edges(const struct strip *restrict s, const struct viewing *v,
                            const struct looks *restrict look)
{
    float need[LANES] = {0};
    if (v->raster || v->sample->shape == SHAPE_CYLINDER)
        return s->use;
    FOR_LANES (i, s->use)
        need[i] = look->edge[i] * s->hit[i];
    return rec_lanes_marked(need);
}

// The lit lanes whose photosites are wide; the others are so no more.
WIDE static lane_span wide_lanes(const struct strip *restrict s, struct looks *restrict look)
{
    float wide[LANES] = {0};
    FOR_LANES (i, s->use) {
        bool lit = (s->fate[i] == FATE_USED) | (s->fate[i] == FATE_TERMINATOR);
        wide[i] = look->wide[i] = lit ? look->wide[i] : 0;
    }
    return rec_lanes_marked(wide);
}

// A mean may see it, or be lit, from behind.
static void find_turned(struct strip *s, lane_span span)
{
    FOR_LANES (i, span)
        if (s->fate[i] == FATE_USED
            && (vec3_dot(rec_lane_wide(&s->normal, i), rec_lane_wide(&s->wi, i)) <= 0
                || vec3_dot(rec_lane_wide(&s->normal, i), rec_lane_wide(&s->wo, i)) <= 0))
            s->fate[i] = FATE_TERMINATOR;
}

void rec_strip_footprints(struct strip *s, const struct viewing *v)
{
    struct pencil p;
    struct ray_ends center;
    struct looks look;
    p.v = v;
    if (!begin(s, &p, &center))
        return;
    take_centers(s, &look, &center, &p.lens, v->eye, v->square, rec_farthest(v));
    lane_span closer = edges(s, v, &look);
    if (closer.end > 0)
        look_at_edges(&look, &p, s, closer);
    take_fates(s, &look);
    take_disc(s, v, center.cos_i);
    lane_span wide = wide_lanes(s, &look);
    if (wide.end > 0) {
        average(s, &p, look.wide, wide);
        find_turned(s, wide);
    }
}
