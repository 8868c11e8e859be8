/* sgd.c -- facets of a shifted gamma distribution, fitted by its authors to the MERL materials.
 *
 *      f = 1/pi (rhoD + rhoS F(c) D(theta_h) G1(theta_i) G1(theta_o) / (cos_i cos_o))       c =
 * wi.h F = F0 - c F1 + (1 - c)^5 (1 - F0)                                 kept in [0, 1] D = kap
 * exp(-x) / (pi x^p cos^4 theta_h)      x = alpha + tan^2(theta_h) / alpha G1 = 1 + lambda (1 -
 * exp(c max(0, theta - theta0)^k))              kept in [0, 1]
 *
 * kap = 1 / (alpha Gamma(1 - p, alpha)) normalises D and is no parameter here: the published values
 * are this closed form.
 */
#include "lobes.h"
#include "models.h"

#include "sgd.h"

enum {
    RHO_D = 0,
    RHO_S = 3,
    ALPHA = 6,
    P = 9,
    F0 = 12,
    F1 = 15,
    LAMBDA = 18,
    C_G = 21,
    K = 24,
    THETA0 = 27
};

/** Gamma(a, x) for x >= 1 by Legendre's continued fraction, after Lentz. It converges to rounding
 *  within 100 steps at x = 1, sooner beyond. */
static double gamma_fraction(double a, double x)
{
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int i = 1; i < 200; i++) {
        double numerator = -i * (i - a);
        b += 2;
        d = 1 / (numerator * d + b);
        c = b + numerator / c;
        h *= c * d;
        if (fabs(c * d - 1) < 1e-15)
            break;
    }
    return exp(-x + a * log(x)) * h;
}

/** Below 1 the rest, integral of t^(a-1) exp(-t) from x to 1, term by term of exp's series:
 *      sum over n of (-1)^n / n! (1 - x^(a+n)) / (a + n)
 *  which also holds its digits where a + n is near 0, and for a < 0. */
double rec_upper_gamma(double a, double x)
{
    if (x >= 1)
        return gamma_fraction(a, x);
    double sum = 0, factor = 1, ln_x = log(x);
    for (int n = 0; n < 20; n++) {  // 1/20! is below rounding
        double s = a + n;
        sum += factor * (fabs(s * ln_x) < 1e-300 ? -ln_x : -expm1(s * ln_x) / s);
        factor /= -(n + 1);
    }
    return gamma_fraction(a, 1) + sum;
}

double rec_sgd_normalisation(double alpha, double p)
{
    return 1 / (alpha * rec_upper_gamma(1 - p, alpha));
}

/** kap of a channel, kept until alpha or p is another: it costs ten times the rest of a lobe. */
static double normalisation(double alpha, double p, int channel)
{
    static _Thread_local struct {
        double alpha, p, kap;
    } kept[3];
    if (kept[channel].alpha != alpha || kept[channel].p != p) {
        kept[channel].alpha = alpha;
        kept[channel].p = p;
        kept[channel].kap = rec_sgd_normalisation(alpha, p);
    }
    return kept[channel].kap;
}

double rec_sgd_slopes(facet a, double alpha, double p, double kap)
{
    double x = alpha + a.sin2_h / (a.cos2_h * alpha);
    return kap * exp(-x) / (CAP_PI * pow(x, p) * a.cos2_h * a.cos2_h);
}

static double in_unit(double value)
{
    return fmin(fmax(value, 0), 1);
}

static double fresnel(double c, double f0, double f1)
{
    return in_unit(f0 - c * f1 + rec_schlick(c) * (1 - f0));
}

static double shadowing(double theta, double lambda, double c, double k, double theta0)
{
    double beyond = theta - theta0;
    return beyond > 0 ? in_unit(1 - lambda * expm1(c * pow(beyond, k))) : 1;
}

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    facet a = rec_facet(wi, wo);
    double theta_i = atan2(hypot(wi.x, wi.y), wi.z), theta_o = atan2(hypot(wo.x, wo.y), wo.z);
    for (int c = 0; c < 3; c++) {
        const double *v = parameters + c;
        double g = shadowing(theta_i, v[LAMBDA], v[C_G], v[K], v[THETA0])
                   * shadowing(theta_o, v[LAMBDA], v[C_G], v[K], v[THETA0]);
        double lobe = fresnel(a.c, v[F0], v[F1])
                      * rec_sgd_slopes(a, v[ALPHA], v[P], normalisation(v[ALPHA], v[P], c)) * g;
        f[c] = (v[RHO_D] + v[RHO_S] * lobe / (a.cos_i * a.cos_o)) / CAP_PI;
    }
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    int n = rec_lobe_body(lobe, parameters + RHO_D);
    for (int c = 0; c < 3; c++, n++) {
        const double *v = parameters + c;
        double gloss = 4 / CAP_PI * v[RHO_S] * fresnel(wi.z, v[F0], v[F1]);
        lobe[n] = rec_lobe(LOBE_GAMMA, gloss / 3, v[ALPHA], v[P]);
    }
    return n;
}

// Bounds hold all published materials.
const struct model rec_model_sgd = {
    .name = "sgd",
    .source = "Bagher, Soler, Holzschuch, EGSR 2012",
    .parameter = (const struct parameter[]){{"rhoD", 3, 0, 1},
                                            {"rhoS", 3, 0, 10},
                                            {"alpha", 3, 1e-5, 2},
                                            {"p", 3, 0, 3},
                                            {"F0", 3, 0, 10},
                                            {"F1", 3, -2, 10},
                                            {"lambda", 3, 1e-9, 1e9},
                                            {"c", 3, 1e-20, 1e39},
                                            {"k", 3, 0, 2000},
                                            {"theta0", 3, -2, 2},
                                            {0}},
    .eval = eval,
    .lobes = lobes,
};
