/* sample_light.c -- the lit sample as a lamp of the board.
 *
 * Method.   L(q) = 1/pi sum over pieces of the sample of f E cos_i cos_p cos_q A / d^2. The matte
 *           part: SOLID_POINTS pieces. The gloss of a sphere: pieces in rings about the normal that
 *           mirrors the lamp to q, in even steps of ln(angle), so that lobes of all widths are met;
 *           of other shapes, the same pieces as the matte part. The board's own light comes back by
 *           the matte part exactly, and by the gloss as from a mirror of the gloss's albedo that
 *           blurs by some BLUR: a convex mirror's light on the board hardly depends on that.
 * Accuracy. 2 % of the light of a matt or a mirror-like ball; the lobe's own errors come on top.
 */
#include "sample_light.h"

#include "lobe.h"
#include "solid.h"

#include <stdlib.h>
#include <string.h>

enum { RINGS = 20, SPOKES = 16, EVERY = 3, TOGETHER = 4, BLUR = 16 };  // BLUR: cos^16, 17 degrees
static const double FINEST = 0.005, WIDEST = 2.5;                      // rad, of normals
static const double GRAZING = 0.45;  // cosine from the mirror's normal: 63 degrees

/** A piece of the sample's surface. */
struct piece {
    vec3 point, normal;
    double area;
};

/** cos_p cos_q A / (pi d^2) of a piece and a place; 0 where they do not see each other. */
static double form_of(const struct piece *p, vec3 place, vec3 normal, vec3 *wo)
{
    vec3 to = vec3_sub(place, p->point);
    double r2 = vec3_dot(to, to), out = vec3_dot(to, p->normal), down = -vec3_dot(to, normal);
    *wo = vec3_scale(to, 1 / sqrt(r2));
    return out > 0 && down > 0 ? out * down * p->area / (r2 * r2) / CAP_PI : 0;
}

/** The lamp's light off a piece, by the matte part or by the gloss. */
static void add_lamp(const struct calibration *c, int view, const struct piece *p, vec3 place,
                     vec3 normal, bool matte, double radiance[ECHOES][3])
{
    const struct lamp *lamp = &c->lamp[c->view[view].light];
    const struct lobe_table *lobe = &c->surroundings.lobe;
    double falloff, f[3];
    vec3 wo, wi = cal_lamp_way(lamp, c->view[view].view_from_world, p->point, &falloff);
    double in = vec3_dot(wi, p->normal), form = form_of(p, place, normal, &wo);
    if (in <= 0 || form <= 0)
        return;
    vec3 h = vec3_normalize(vec3_add(wi, wo));
    double cos_d = vec3_dot(wi, h);
    if (!matte)
        cal_lobe_lookup(lobe, in, vec3_dot(wo, p->normal), vec3_dot(h, p->normal), cos_d, f);
    for (int k = 0; k < 3; k++) {
        double light = lamp->intensity[k] * in * falloff * form, m = (double)lobe->matte[k];
        radiance[matte             ? ECHO_MATTE
                 : cos_d < GRAZING ? ECHO_GRAZING
                                   : ECHO_GLOSS][k] += (matte ? m : f[k] - m) * light;
    }
}

/** The normal where a sphere mirrors the lamp to a place. */
static vec3 mirror_normal(const struct calibration *c, int view, vec3 place)
{
    const struct sample *s = &c->sample;
    vec3 n = vec3_normalize(vec3_sub(place, s->center));
    for (int i = 0; i < 12; i++) {  // what is left shrinks by radius/distance each time
        double unused;
        vec3 p = vec3_add(s->center, vec3_scale(n, s->radius));
        vec3 wi =
            cal_lamp_way(&c->lamp[c->view[view].light], c->view[view].view_from_world, p, &unused);
        vec3 h = vec3_add(wi, vec3_normalize(vec3_sub(place, p)));
        if (vec3_length(h) < 1e-6)  // the lamp is right behind: no point mirrors it
            break;
        n = vec3_normalize(h);
    }
    return n;
}

/** A sphere's gloss, in rings. */
static void add_gloss(const struct calibration *c, int view, vec3 place, vec3 normal,
                      double radiance[ECHOES][3])
{
    const struct sample *s = &c->sample;
    const double steps = log1p(WIDEST / FINEST);
    vec3 z = mirror_normal(c, view, place);
    vec3 x = vec3_normalize(vec3_cross(fabs(z.z) < 0.8 ? (vec3){0, 0, 1} : (vec3){1, 0, 0}, z));
    vec3 y = vec3_cross(z, x);
    for (int i = 0; i < RINGS; i++) {
        double t = FINEST * expm1((i + 0.5) / RINGS * steps);
        double inner = FINEST * expm1(i * steps / RINGS);
        double outer = FINEST * expm1((i + 1) * steps / RINGS);
        double area = s->radius * s->radius * 2 * CAP_PI * 2 * sin(0.5 * (inner + outer))
                      * sin(0.5 * (outer - inner)) / SPOKES;
        for (int j = 0; j < SPOKES; j++) {
            double phi = 2 * CAP_PI * (j / (double)SPOKES + 0.618 * i);
            vec3 across = vec3_add(vec3_scale(x, cos(phi)), vec3_scale(y, sin(phi)));
            vec3 n = vec3_add(vec3_scale(z, cos(t)), vec3_scale(across, sin(t)));
            struct piece p = {vec3_add(s->center, vec3_scale(n, s->radius)), n, area};
            add_lamp(c, view, &p, place, normal, false, radiance);
        }
    }
}

static double power_16(double x)
{
    double x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
    return x8 * x8;
}

double cal_rise(double cosine)
{
    const double n = 1.5, f0 = (n - 1) * (n - 1) / ((n + 1) * (n + 1));
    double c = fmin(fmax(cosine, 0), 1), g = sqrt(n * n - 1 + c * c);
    double a = (g - c) / (g + c), b = (c * (g + c) - 1) / (c * (g - c) + 1);
    return (0.5 * a * a * (1 + b * b) - f0) / (1 - f0);
}

/** Radiance of the board that a piece shows to a place as a mirror would, times its form: [3]. */
static void mirrored(const struct glow *cell, int cells, const struct piece *p, vec3 place,
                     vec3 normal, double *cos_o, double radiance[3])
{
    vec3 wo;
    double form = form_of(p, place, normal, &wo);
    radiance[0] = radiance[1] = radiance[2] = 0;
    *cos_o = vec3_dot(wo, p->normal);
    vec3 mirror = vec3_sub(vec3_scale(p->normal, 2 * *cos_o), wo);
    for (int i = 0; form > 0 && i < cells; i++) {
        vec3 to = vec3_sub(cell[i].point, p->point);
        double r2 = vec3_dot(to, to), along = vec3_dot(to, mirror), r = sqrt(r2);
        double down = -vec3_dot(to, cell[i].normal);
        if (along <= 0.5 * r || down <= 0 || vec3_dot(to, p->normal) <= 0)
            continue;
        double kernel = (BLUR + 1) / (2 * CAP_PI) * power_16(along / r);
        double seen = kernel * down * cell[i].side * cell[i].side / (r2 * r) * form;
        for (int k = 0; k < 3; k++)
            radiance[k] += cell[i].radiance[k] * seen;
    }
}

void cal_sample_light(const struct calibration *c, const struct returns *returns, int view,
                      vec3 point, vec3 normal, double radiance[ECHOES][3])
{
    memset(radiance, 0, sizeof(double[ECHOES][3]));
    const struct sample *s = &c->sample;
    if (!c->surroundings.has_lobe || s->shape == SHAPE_NONE)
        return;
    const int light = c->view[view].light;
    for (int i = 0; i < SOLID_POINTS; i++) {
        struct piece p;
        vec3 wo;
        cal_solid_point(s, i, &p.point, &p.normal, &p.area);
        add_lamp(c, view, &p, point, normal, true, radiance);
        if (s->shape != SHAPE_SPHERE)
            add_lamp(c, view, &p, point, normal, false, radiance);
        if (!returns)
            continue;
        double form = form_of(&p, point, normal, &wo);
        for (int k = 0; k < 3; k++)
            radiance[ECHO_MATTE][k] += returns->matte[light * SOLID_POINTS + i][k] * form;
        if (i % EVERY)
            continue;
        double shown[3], albedo[3], cos_o;
        mirrored(returns->coarse + (size_t)light * (size_t)returns->cells, returns->cells, &p,
                 point, normal, &cos_o, shown);
        cal_lobe_gloss_albedo(&c->surroundings.lobe, cos_o, albedo);
        for (int k = 0; k < 3; k++)
            radiance[ECHO_GLOSS][k] += EVERY * albedo[k] * shown[k];
    }
    if (s->shape == SHAPE_SPHERE)
        add_gloss(c, view, point, normal, radiance);
    double power = c->view[view].power * c->surroundings.strength;
    for (int e = 0; e < ECHOES; e++)
        for (int k = 0; k < 3; k++)
            radiance[e][k] *= power;
}

/** Share a mirror's light out by the cosine that it left with. */
static void share_out(const double light[3], double factor, double cosine, double face_on[3],
                      double rim[3])
{
    double s = cal_rise(cosine);
    for (int k = 0; k < 3; k++) {
        face_on[k] += (1 - s) * factor * light[k];
        rim[k] += s * factor * light[k];
    }
}

void cal_mirror_light(const struct calibration *c, const struct returns *returns, int view,
                      vec3 point, vec3 normal, double face_on[3], double rim[3])
{
    const struct sample *s = &c->sample;
    const struct lamp *lamp = &c->lamp[c->view[view].light];
    const double power = c->view[view].power * c->surroundings.strength;
    memset(face_on, 0, sizeof(double[3]));
    memset(rim, 0, sizeof(double[3]));
    if (s->shape != SHAPE_SPHERE)
        return;
    // An even beam that a mirror sphere spreads has its lines of focus R cos/2 and R/(2 cos) behind
    // the surface; so it thins out from E at the surface.
    vec3 n = mirror_normal(c, view, point), p = vec3_add(s->center, vec3_scale(n, s->radius));
    vec3 to = vec3_sub(point, p);
    double falloff, r = vec3_length(to), down = -vec3_dot(to, normal) / r;
    vec3 wi = cal_lamp_way(lamp, c->view[view].view_from_world, p, &falloff);
    double cosine = vec3_dot(wi, n);
    if (cosine > 0 && vec3_dot(to, n) > 0 && down > 0) {
        double first = 0.5 * s->radius * cosine, second = 0.5 * s->radius / fmax(cosine, 0.05);
        double thin = first * second / ((r + first) * (r + second));
        share_out(lamp->intensity, power * falloff * thin * down / CAP_PI, cosine, face_on, rim);
    }
    const int light = c->view[view].light;
    for (int i = 0; returns && i < SOLID_POINTS; i += EVERY) {
        struct piece piece;
        double shown[3], cos_o;
        cal_solid_point(s, i, &piece.point, &piece.normal, &piece.area);
        mirrored(returns->coarse + (size_t)light * (size_t)returns->cells, returns->cells, &piece,
                 point, normal, &cos_o, shown);
        share_out(shown, EVERY * power, cos_o, face_on, rim);
    }
}

/* ---- the board's light at the sample --------------------------------------------------------- */

void cal_returns_free(struct returns *returns)
{
    free(returns->matte);
    free(returns->coarse);
    *returns = (struct returns){0};
}

/** Do two cells lie in one block of TOGETHER x TOGETHER? */
static bool together(const struct glow *a, const struct glow *b)
{
    double block = TOGETHER * a->side;
    vec3 y = vec3_cross(a->normal, a->x);
    return vec3_dot(a->normal, b->normal) > 0.999
           && floor(vec3_dot(a->point, a->x) / block) == floor(vec3_dot(b->point, a->x) / block)
           && floor(vec3_dot(a->point, y) / block) == floor(vec3_dot(b->point, y) / block);
}

/** Put the cells of one lamp together: their area and light add up. -> how many there are. Every
 *  lamp has the same cells, so that they group alike. */
static int group(struct glow *coarse, const struct glow *cell, int cells)
{
    int groups = 0;
    for (int i = 0; i < cells; i++) {
        int g = 0;
        while (g < groups && !together(&cell[i], &coarse[g]))
            g++;
        if (g == groups)
            coarse[groups++] = cell[i];
        else {
            struct glow *to = &coarse[g];
            double had = to->side * to->side, more = cell[i].side * cell[i].side;
            double part = more / (had + more);
            to->side = sqrt(had + more);
            for (int k = 0; k < 3; k++)
                to->radiance[k] += part * (cell[i].radiance[k] - to->radiance[k]);
        }
    }
    return groups;
}

static void light_point(const struct calibration *c, int light, int k, double found[3])
{
    const struct surroundings *s = &c->surroundings;
    const struct glow *glow = s->glow + (size_t)light * (size_t)s->count;
    vec3 point, normal;
    double area;
    cal_solid_point(&c->sample, k, &point, &normal, &area);
    for (int i = 0; i < s->count; i++) {
        vec3 to = vec3_sub(glow[i].point, point);
        double up = vec3_dot(to, normal), down = -vec3_dot(to, glow[i].normal);
        double r2 = vec3_dot(to, to);
        double form = up * down * glow[i].side * glow[i].side / (r2 * r2);
        for (int a = 0; a < 3 && up > 0 && down > 0; a++)
            found[a] += (double)s->lobe.matte[a] * glow[i].radiance[a] * form;
    }
}

enum status cal_returns(struct returns *returns, const struct calibration *c, struct run *run,
                        struct error *err)
{
    const struct surroundings *s = &c->surroundings;
    const int all = c->lamps * SOLID_POINTS;
    struct returns r = {.matte = calloc((size_t)all, sizeof *r.matte),
                        .coarse =
                            calloc((size_t)c->lamps * (size_t)s->count + 1, sizeof *r.coarse)};
    if (!r.matte || !r.coarse) {
        cal_returns_free(&r);
        return cap_fail(err, STATUS_MEMORY, "the sample's light under %d lamps", c->lamps);
    }
#pragma omp parallel for schedule(static) num_threads(run->threads)
    for (int k = 0; k < all; k++)
        light_point(c, k / SOLID_POINTS, k % SOLID_POINTS, r.matte[k]);
    for (int l = 0; l < c->lamps; l++)
        r.cells = group(r.coarse + (size_t)l * (size_t)r.cells,
                        s->glow + (size_t)l * (size_t)s->count, s->count);
    *returns = r;
    return STATUS_OK;
}
