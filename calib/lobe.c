/* lobe.c -- a reflectance that fits any isotropic sample, for finding lamps.
 *
 * Method.   A matte part and a product of a distribution, a Fresnel term and a shadowing term,
 *           each the exponential of a uniform cubic B-spline: the form of every microfacet model,
 *           without its family. ln f is linear in the coefficients wherever one part dominates,
 *           so that a solver converges from far. theta_h runs in ln(tan^2 + HALF^2): lobes of all
 *           widths look alike on it.
 * Accuracy. GGX and Beckmann plastics and metals with alpha from 0.02 are met to better than 1 %.
 */
#include "lobe.h"

#include <assert.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { AT_H = 3, AT_D = AT_H + LOBE_H, AT_G = AT_D + 3 * LOBE_D };

static const double HALF = 0.01;  // rad: the narrowest lobe that is told from a narrower one
static const double SMOOTH_H = 0.4, SMOOTH_D = 0.5, SMOOTH_G = 0.3;  // second differences
static const double LOOSE = 4;   // prior of a coefficient itself
static const double FAINT = -5;  // where the gloss goes that nobody sees: ln(1/sr)

/** The four B-splines that are not zero at u in [0, 1], and the first one's index. */
struct basis {
    int first;
    double weight[4];
};

static struct basis spline(double u, int count)
{
    double x = u * (count - 3);
    int i = x <= 0 ? 0 : (int)x;
    if (i > count - 4)
        i = count - 4;
    double t = x - i, s = 1 - t;
    return (struct basis){i,
                          {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                           (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6}};
}

static double evaluate(const struct basis *b, const double *coefficient)
{
    double sum = 0;
    for (int k = 0; k < 4; k++)
        sum += b->weight[k] * coefficient[b->first + k];
    return sum;
}

static double clamp01(double u)
{
    return u < 0 ? 0 : u > 1 ? 1 : u;
}

/** theta_h on the axis of its spline: 0 at the normal, 1 at 80 degrees. */
static struct basis spline_h(double cos_h)
{
    const double low = log(HALF * HALF), high = log(32.2);  // tan^2(80 degrees)
    double tan2 = (1 - cos_h * cos_h) / (cos_h * cos_h);
    return spline(clamp01((log(tan2 + HALF * HALF) - low) / (high - low)), LOBE_H);
}

/** An angle from its cosine on [0, pi/2]. */
static struct basis spline_angle(double cosine, int count)
{
    return spline(acos(fmin(fmax(cosine, 0), 1)) / (CAP_PI / 2), count);
}

static void add(double *derivative, const struct basis *b, double factor)
{
    for (int k = 0; k < 4; k++)
        derivative[b->first + k] += factor * b->weight[k];
}

void cal_lobe_log(const double coefficient[LOBE_SIZE], double cos_i, double cos_o, double cos_h,
                  double cos_d, double log_f[3], double *derivative)
{
    assert(cos_i > 0 && cos_o > 0 && cos_h > 0);
    struct basis h = spline_h(cos_h), d = spline_angle(cos_d, LOBE_D);
    struct basis i = spline_angle(cos_i, LOBE_G), o = spline_angle(cos_o, LOBE_G);
    double shared = evaluate(&h, coefficient + AT_H) + evaluate(&i, coefficient + AT_G)
                    + evaluate(&o, coefficient + AT_G);
    if (derivative)
        memset(derivative, 0, sizeof(double[3][LOBE_SIZE]));
    for (int c = 0; c < 3; c++) {
        const double *fresnel = coefficient + AT_D + c * LOBE_D;
        double gloss = shared + evaluate(&d, fresnel), diffuse = coefficient[c];
        double more = fmax(gloss, diffuse);
        log_f[c] = more + log(exp(gloss - more) + exp(diffuse - more));
        if (!derivative)
            continue;
        double *row = derivative + c * LOBE_SIZE, part = exp(gloss - log_f[c]);
        row[c] = exp(diffuse - log_f[c]);
        add(row + AT_H, &h, part);
        add(row + AT_D + c * LOBE_D, &d, part);
        add(row + AT_G, &i, part);
        add(row + AT_G, &o, part);
    }
}

void cal_lobe_start(double coefficient[LOBE_SIZE], const double albedo[3])
{
    memset(coefficient, 0, sizeof(double[LOBE_SIZE]));
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        assert(albedo[c] > 0);
        coefficient[c] = log(albedo[c] / CAP_PI);
        sum += coefficient[c] / 3;
    }
    for (int k = 0; k < LOBE_H; k++)
        coefficient[AT_H + k] = sum - 1 - 0.1 * k;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

bool cal_lobe_start_gloss(double coefficient[LOBE_SIZE], int count, const double *cos_h,
                          const double (*f)[3])
{
    double *gloss = calloc((size_t)count + 1, sizeof *gloss), least = exp(FAINT);
    for (int k = 0; gloss && k < LOBE_H; k++) {
        int n = 0;
        for (int i = 0; i < count; i++) {
            struct basis b = spline_h(cos_h[i]);
            if (b.weight[k - b.first < 0 || k - b.first > 3 ? 0 : k - b.first] < 0.3 || k < b.first
                || k > b.first + 3)
                continue;
            double sum = 0;
            for (int c = 0; c < 3; c++)
                sum += (f[i][c] - exp(coefficient[c])) / 3;
            gloss[n++] = fmax(sum, least);
        }
        qsort(gloss, (size_t)n, sizeof *gloss, by_value);
        if (n > 2)
            coefficient[AT_H + k] = log(gloss[n / 2]);
    }
    free(gloss);
    return gloss != NULL;
}

/** One linear residual: sum of factor[k] x coefficient[at + k] - target. */
static int prior(int row, const double *coefficient, int at, const double *factor, int count,
                 double target, double *residual, double *jacobian)
{
    residual[row] = -target;
    for (int k = 0; k < count; k++) {
        residual[row] += factor[k] * coefficient[at + k];
        if (jacobian)
            jacobian[row * LOBE_SIZE + at + k] = factor[k];
    }
    return row + 1;
}

/** A spline's priors: each coefficient near mean, second differences near 0. */
static int spline_priors(int row, const double *coefficient, int at, int count, double mean,
                         double smooth, double *residual, double *jacobian)
{
    const double own[1] = {1 / LOOSE}, second[3] = {1 / smooth, -2 / smooth, 1 / smooth};
    for (int k = 0; k < count; k++)
        row = prior(row, coefficient, at + k, own, 1, mean / LOOSE, residual, jacobian);
    for (int k = 0; k + 2 < count; k++)
        row = prior(row, coefficient, at + k, second, 3, 0, residual, jacobian);
    return row;
}

void cal_lobe_priors(const double coefficient[LOBE_SIZE], double residual[LOBE_PRIORS],
                     double *jacobian)
{
    const double own[1] = {1 / LOOSE};
    memset(residual, 0, sizeof(double[LOBE_PRIORS]));
    if (jacobian)
        memset(jacobian, 0, sizeof(double[LOBE_PRIORS][LOBE_SIZE]));
    int row = 0;
    for (int c = 0; c < 3; c++)
        row = prior(row, coefficient, c, own, 1, FAINT / LOOSE, residual, jacobian);
    row = spline_priors(row, coefficient, AT_H, LOBE_H, FAINT, SMOOTH_H, residual, jacobian);
    for (int c = 0; c < 3; c++)
        row = spline_priors(row, coefficient, AT_D + c * LOBE_D, LOBE_D, 0, SMOOTH_D, residual,
                            jacobian);
    row = spline_priors(row, coefficient, AT_G, LOBE_G, 0, SMOOTH_G, residual, jacobian);
    assert(row <= LOBE_PRIORS);
}

/* ---- the same, fast
 * ------------------------------------------------------------------------------ */

/** Axes of the tables, all in [0, 1]: theta_h on sqrt(1 - cos), which is straight at the peak;
 *  cosines as they are. */
/** The gloss's floor: its least value over theta_h, at angles amid those that photographs show. */
static void find_matte(struct lobe_table *table)
{
    const double cos_amid = 0.7071;
    for (int c = 0; c < 3; c++) {
        double least = DBL_MAX;
        for (int deg = 20; deg <= 70; deg += 5) {
            double f[3];
            cal_lobe_lookup(table, cos_amid, cos_amid, cos(deg * CAP_PI / 180), cos_amid, f);
            least = fmin(least, f[c]);
        }
        table->matte[c] = (float)least;
    }
}

static double find_width(const struct lobe_table *table)
{
    const double u_max = sqrt(1 - cos(0.5 * CAP_PI));
    int k = 0;
    while (k < LOBE_TABLE * u_max && 2 * table->distribution[k] > table->distribution[0])
        k++;
    double u = (double)k / LOBE_TABLE;
    return acos(1 - u * u);
}

/** Directions to the light in rings about the mirror direction, in even steps of ln(angle). */
static void find_gloss_albedo(struct lobe_table *table, double cos_o, float albedo[3])
{
    enum { RINGS = 24, SPOKES = 16 };
    const double finest = 0.01, steps = log1p(CAP_PI / finest);
    vec3 wo = {sqrt(1 - cos_o * cos_o), 0, cos_o}, z = {-wo.x, 0, wo.z}, x = {wo.z, 0, wo.x};
    double sum[3] = {0};
    for (int k = 0; k < RINGS * SPOKES; k++) {
        int ring = k / SPOKES;
        double t = finest * expm1((ring + 0.5) / RINGS * steps);
        double inner = finest * expm1(ring * steps / RINGS);
        double outer = finest * expm1((ring + 1) * steps / RINGS);
        double phi = 2 * CAP_PI * (k % SPOKES + 0.5) / SPOKES, f[3];
        vec3 across = {x.x * cos(phi), sin(phi), x.z * cos(phi)};
        vec3 wi = vec3_add(vec3_scale(z, cos(t)), vec3_scale(across, sin(t)));
        if (wi.z <= 0)
            continue;
        vec3 h = vec3_normalize(vec3_add(wi, wo));
        cal_lobe_lookup(table, wi.z, cos_o, h.z, vec3_dot(wi, h), f);
        for (int c = 0; c < 3; c++)
            sum[c] += (f[c] - (double)table->matte[c]) * wi.z * (cos(inner) - cos(outer));
    }
    for (int c = 0; c < 3; c++)
        albedo[c] = (float)fmax(sum[c] * 2 * CAP_PI / SPOKES, 0);
}

void cal_lobe_gloss_albedo(const struct lobe_table *table, double cos_o, double albedo[3])
{
    double x = clamp01(cos_o) * LOBE_ANGLES;
    int i = x >= LOBE_ANGLES ? LOBE_ANGLES - 1 : (int)x;
    double t = x - i;
    for (int c = 0; c < 3; c++)
        albedo[c] =
            (1 - t) * (double)table->gloss_albedo[i][c] + t * (double)table->gloss_albedo[i + 1][c];
}

void cal_lobe_tabulate(struct lobe_table *table, const double coefficient[LOBE_SIZE])
{
    for (int c = 0; c < 3; c++)
        table->diffuse[c] = (float)exp(coefficient[c]);
    for (int k = 0; k <= LOBE_TABLE; k++) {
        double u = (double)k / LOBE_TABLE, cos_h = fmax(1 - u * u, 0.01), cosine = fmax(u, 0.01);
        struct basis h = spline_h(cos_h), d = spline_angle(u, LOBE_D);
        struct basis g = spline_angle(cosine, LOBE_G);
        table->distribution[k] = (float)exp(evaluate(&h, coefficient + AT_H));
        table->shadowing[k] = (float)exp(evaluate(&g, coefficient + AT_G));
        for (int c = 0; c < 3; c++)
            table->fresnel[c][k] = (float)exp(evaluate(&d, coefficient + AT_D + c * LOBE_D));
    }
    find_matte(table);
    table->gloss_width = find_width(table);
    for (int k = 0; k <= LOBE_ANGLES; k++)
        find_gloss_albedo(table, fmax((double)k / LOBE_ANGLES, 0.02), table->gloss_albedo[k]);
}

static double look_up(const float *table, double u)
{
    double x = u * LOBE_TABLE;
    int i = (int)x;
    if (i >= LOBE_TABLE)
        return (double)table[LOBE_TABLE];
    double t = x - i;
    return table[i] + t * ((double)table[i + 1] - table[i]);
}

void cal_lobe_lookup(const struct lobe_table *table, double cos_i, double cos_o, double cos_h,
                     double cos_d, double f[3])
{
    double shared = look_up(table->distribution, sqrt(fmax(1 - cos_h, 0)))
                    * look_up(table->shadowing, clamp01(cos_i))
                    * look_up(table->shadowing, clamp01(cos_o));
    for (int c = 0; c < 3; c++)
        f[c] = table->diffuse[c] + shared * look_up(table->fresnel[c], clamp01(cos_d));
}
