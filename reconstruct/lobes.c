/* lobes.c -- directions drawn from a mixture of lobes, and their density.
 *
 * Method.   The first number picks the lobe by its weight; the others go through the inverse of
 *           its distribution. The density is that of the whole mixture, whichever lobe was drawn
 *           (E. Veach, L. Guibas, SIGGRAPH 1995). At least a tenth of all is a cosine lobe: so the
 *           density is nowhere 0 above the horizon, and no estimate explodes.
 * Source.   E. Heitz, "Sampling the GGX Distribution of Visible Normals", JCGT 2018; B. Walter et
 *           al., EGSR 2007; B. Burley, SIGGRAPH 2012 course, appendix B.
 */
#include "lobes.h"

#include <assert.h>

static const double least_cosine = 0.1;

int rec_lobe_body(struct lobe *lobe, const double colour[3])
{
    *lobe = (struct lobe){.kind = LOBE_COSINE, .weight = rec_mean(colour)};
    return 1;
}

/* ---- distributions of h: cos_h from a number, and the density over solid angle ---------------
 */

// x^g from 1 to b, as a share u of the way of its integral's: the inverse for all power laws.
static double between_powers(double b, double g, double u)
{
    double e = 1 - g;
    return fabs(e) < 1e-9 ? pow(b, u) : pow(1 + u * (pow(b, e) - 1), 1 / e);
}

// Integral of x^-g from 1 to b.
static double power_integral(double b, double g)
{
    double e = 1 - g;
    return fabs(e) < 1e-9 ? log(b) : (pow(b, e) - 1) / e;
}

// x of the SGD model's facets has density x^-p exp(-x) from alpha on. Near it, and simple: x^-p up
// to 1 and exp(-x) beyond, each with its own integral.
static void gamma_parts(double alpha, double p, double part[2])
{
    part[0] = alpha < 1 ? pow(alpha, 1 - p) * power_integral(1 / alpha, p) : 0;
    part[1] = exp(-fmax(alpha, 1));
}

static double gamma_density(double x, double alpha, double p)
{
    double part[2];
    gamma_parts(alpha, p, part);
    return (x < 1 ? pow(x, -p) : exp(-x)) / (part[0] + part[1]);
}

static double gamma_draw(double alpha, double p, double u)
{
    double part[2];
    gamma_parts(alpha, p, part);
    double at = u * (part[0] + part[1]);
    if (at < part[0])
        return alpha * between_powers(1 / alpha, p, at / part[0]);
    return fmax(alpha, 1) - log(fmax(1e-300, 1 - fmin(1, (at - part[0]) / part[1])));
}

// cos^2 theta_h of a lobe of h.
static double draw_cos2_h(const struct lobe *lobe, double u)
{
    double a = lobe->shape[0], b = lobe->shape[1], a2 = a * a;
    switch (lobe->kind) {
    case LOBE_BECKMANN:
        return 1 / (1 - a2 * log(1 - u));
    case LOBE_POWER:
        return pow(u, 2 / (a + 1));
    case LOBE_GTR: {  // q = a^2 cos^2 + sin^2 falls from 1 at the horizon to a^2
        double q = fabs(1 - a2) < 1e-9 ? a2 : between_powers(a2, b, u);
        return fabs(1 - a2) < 1e-9 ? u : fmin(1, (1 - q) / (1 - a2));
    }
    case LOBE_GAMMA: {
        double tan2 = a * fmax(0, gamma_draw(a, b, u) - a);
        return 1 / (1 + tan2);
    }
    case LOBE_ABC: {
        double s = a > 1e-9 ? (between_powers(1 + a, b, u) - 1) / a : u;
        return (1 - s) * (1 - s);
    }
    default:
        assert(false);
        return 1;
    }
}

static double density_of_h(const struct lobe *lobe, const facet *f)
{
    double a = lobe->shape[0], b = lobe->shape[1], a2 = a * a, cos_h = sqrt(f->cos2_h);
    switch (lobe->kind) {
    case LOBE_BECKMANN:
        return exp(-f->sin2_h / (f->cos2_h * a2)) / (CAP_PI * a2 * f->cos2_h * cos_h);
    case LOBE_POWER:
        return (a + 1) / (2 * CAP_PI) * pow(cos_h, a);
    case LOBE_GTR: {
        double q = a2 * f->cos2_h + f->sin2_h;
        double whole = fabs(1 - a2) < 1e-9 ? 1 : power_integral(a2, b) / (a2 - 1);
        return cos_h * pow(q, -b) / (CAP_PI * whole);
    }
    case LOBE_GAMMA: {
        double x = a + f->sin2_h / (f->cos2_h * a);
        return gamma_density(x, a, b) / (CAP_PI * a * f->cos2_h * cos_h);
    }
    case LOBE_ABC: {
        double whole = a > 1e-9 ? power_integral(1 + a, b) / a : 1;
        return pow(1 + a * f->sin2_h / (1 + cos_h), -b) / (2 * CAP_PI * whole);
    }
    default:
        assert(false);
        return 0;
    }
}

/* ---- directions ------------------------------------------------------------------------------
 */

static vec3 polar(double cosine, double phi)
{
    double sine = sqrt(fmax(0, 1 - cosine * cosine));
    return (vec3){sine * cos(phi), sine * sin(phi), cosine};
}

// Two unit vectors that make a right-handed frame with the unit vector n.
static void frame_about(vec3 n, vec3 *t, vec3 *b)
{
    double across = hypot(n.x, n.y);
    *t = across > 0 ? (vec3){-n.y / across, n.x / across, 0} : (vec3){1, 0, 0};
    *b = vec3_cross(n, *t);
}

// Heitz 2018, listing 1, with equal widths along x and y.
static vec3 draw_visible(vec3 wi, double alpha, double u, double v)
{
    vec3 view = vec3_normalize((vec3){alpha * wi.x, alpha * wi.y, wi.z}), t, b;
    frame_about(view, &t, &b);
    double r = sqrt(u), phi = 2 * CAP_PI * v, s = 0.5 * (1 + view.z);
    double x = r * cos(phi), y = (1 - s) * sqrt(1 - x * x) + s * r * sin(phi);
    double z = sqrt(fmax(0, 1 - x * x - y * y));
    vec3 n = vec3_add(vec3_add(vec3_scale(t, x), vec3_scale(b, y)), vec3_scale(view, z));
    return vec3_normalize((vec3){alpha * n.x, alpha * n.y, fmax(1e-12, n.z)});
}

static vec3 axis_of(const struct lobe *lobe, vec3 wi)
{
    vec3 axis = {lobe->shape[0] * wi.x, lobe->shape[0] * wi.y, lobe->shape[1] * wi.z};
    double length = vec3_length(axis);
    return length > 0 ? vec3_scale(axis, 1 / length) : (vec3){0, 0, 1};
}

static vec3 draw(const struct lobe *lobe, vec3 wi, double u, double v)
{
    double phi = 2 * CAP_PI * v;
    if (lobe->kind == LOBE_COSINE)
        return polar(sqrt(1 - u), phi);
    if (lobe->kind == LOBE_AXIS) {
        vec3 axis = axis_of(lobe, wi), t, b, d = polar(pow(u, 1 / (lobe->shape[2] + 1)), phi);
        frame_about(axis, &t, &b);
        return vec3_add(vec3_add(vec3_scale(t, d.x), vec3_scale(b, d.y)), vec3_scale(axis, d.z));
    }
    vec3 h = lobe->kind == LOBE_VISIBLE ? draw_visible(wi, lobe->shape[0], u, v)
                                        : polar(sqrt(draw_cos2_h(lobe, u)), phi);
    return vec3_sub(vec3_scale(h, 2 * vec3_dot(wi, h)), wi);
}

static double density(const struct lobe *lobe, vec3 wi, vec3 wo, const facet *f)
{
    if (lobe->kind == LOBE_COSINE)
        return wo.z / CAP_PI;
    if (lobe->kind == LOBE_AXIS) {
        double n = lobe->shape[2], c = vec3_dot(axis_of(lobe, wi), wo);
        return c > 0 ? (n + 1) / (2 * CAP_PI) * pow(c, n) : 0;
    }
    if (lobe->kind == LOBE_VISIBLE) {
        double a2 = lobe->shape[0] * lobe->shape[0], q = f->cos2_h * a2 + f->sin2_h;
        double d = a2 / (CAP_PI * q * q);
        return 0.25 * d * rec_ggx_g1_over_cos(f->cos_i, lobe->shape[0]);
    }
    return density_of_h(lobe, f) / (4 * f->c);
}

/* ---- the mixture -----------------------------------------------------------------------------
 */

// The model's lobes with weights that add to 1, and the cosine lobe that every mixture has.
static int mixture(struct lobe *lobe, const struct model *model, const double *parameters, vec3 wi)
{
    int n = model->lobes(parameters, wi, lobe);
    assert(n < LOBES_MAX);
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += lobe[i].weight;
    double rest = sum > 0 ? 1 - least_cosine : 0;
    for (int i = 0; i < n; i++)
        lobe[i].weight *= sum > 0 ? rest / sum : 0;
    lobe[n] = (struct lobe){.kind = LOBE_COSINE, .weight = 1 - rest};
    return n + 1;
}

static double density_of_all(const struct lobe *lobe, int n, vec3 wi, vec3 wo)
{
    facet f = rec_facet(wi, wo);
    double sum = 0;
    for (int i = 0; i < n; i++)
        if (lobe[i].weight > 0)
            sum += lobe[i].weight * density(&lobe[i], wi, wo, &f);
    return sum;
}

double rec_lobes_sample(const struct model *model, const double *parameters, vec3 wi,
                        const double u[3], vec3 *wo)
{
    struct lobe lobe[LOBES_MAX];
    int n = mixture(lobe, model, parameters, wi), pick = 0;
    double left = u[0];
    while (pick < n - 1 && left >= lobe[pick].weight)
        left -= lobe[pick++].weight;
    *wo = draw(&lobe[pick], wi, u[1], u[2]);
    return wo->z > 0 ? density_of_all(lobe, n, wi, *wo) : 0;
}

double rec_lobes_pdf(const struct model *model, const double *parameters, vec3 wi, vec3 wo)
{
    struct lobe lobe[LOBES_MAX];
    int n = mixture(lobe, model, parameters, wi);
    return density_of_all(lobe, n, wi, wo);
}
