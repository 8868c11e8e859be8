/* disney.c -- Burley's principled BRDF, isotropic: one base colour from matt to metal.
 *
 *      f = (1 - metallic) (matt + sheen) + Ds Fs Gs + clearcoat/4 Dr Fr Gr
 *
 * matt is Burley's diffuse with its rise at grazing angles, or after Hanrahan and Krueger for
 * `subsurface`; Ds is GGX of width roughness^2, with the paper's Smith shadowing of width
 * (0.5 + roughness/2)^2; Dr is Berry's GTR1 with ior 1.5. The layers share no energy: a white,
 * rough base sends back some percent more than it gets.
 */
#include "lobes.h"
#include "models.h"

enum {
    BASE,
    METALLIC = 3,
    ROUGHNESS,
    SPECULAR,
    SPECULAR_TINT,
    SHEEN,
    SHEEN_TINT,
    SUBSURFACE,
    CLEARCOAT,
    CLEARCOAT_GLOSS
};

static double mix(double a, double b, double t)
{
    return a + (b - a) * t;
}

/** Smith's G1 of GGX over 2 cos: a lobe's G / (4 cos_i cos_o) is the product of two. */
static double smith(double cosine, double alpha)
{
    double a2 = alpha * alpha, cos2 = cosine * cosine;
    return 1 / (cosine + sqrt(a2 + cos2 - a2 * cos2));
}

static double gtr2(facet a, double alpha)
{
    double a2 = alpha * alpha, q = a.cos2_h * a2 + a.sin2_h;
    return a2 / (CAP_PI * q * q);
}

/** (a^2 - 1) / (2 pi ln a (1 + (a^2 - 1) cos^2 theta_h)) */
static double gtr1(facet a, double alpha)
{
    double a2 = alpha * alpha;
    return (a2 - 1) / (CAP_PI * log(a2) * (a.cos2_h * a2 + a.sin2_h));
}

/** Matt reflection of a white base, 1/sr. */
static double matt(facet a, double roughness, double subsurface)
{
    double rise_i = rec_schlick(a.cos_i), rise_o = rec_schlick(a.cos_o);
    double f90 = 2 * a.c * a.c * roughness;
    double diffuse = mix(1, 0.5 + f90, rise_i) * mix(1, 0.5 + f90, rise_o);
    double flat = mix(1, f90 / 2, rise_i) * mix(1, f90 / 2, rise_o);
    double scattered = 1.25 * (flat * (1 / (a.cos_i + a.cos_o) - 0.5) + 0.5);
    return mix(diffuse, scattered, subsurface) / CAP_PI;
}

static double clearcoat(facet a, double gloss)
{
    static const double F0 = 0.04, SHADOWING = 0.25;  // ior 1.5; the paper's fixed width
    double fresnel = mix(F0, 1, rec_schlick(a.c));
    return gtr1(a, mix(0.1, 0.001, gloss)) * fresnel * smith(a.cos_i, SHADOWING)
           * smith(a.cos_o, SHADOWING);
}

static void eval(const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    const double *v = parameters;
    facet a = rec_facet(wi, wo);
    double luminance = 0.3 * v[BASE] + 0.6 * v[BASE + 1] + 0.1 * v[BASE + 2];
    double alpha = fmax(1e-3, v[ROUGHNESS] * v[ROUGHNESS]);
    double wide = 0.25 * (1 + v[ROUGHNESS]) * (1 + v[ROUGHNESS]);
    double lobe = gtr2(a, alpha) * smith(a.cos_i, wide) * smith(a.cos_o, wide);
    double white = matt(a, v[ROUGHNESS], v[SUBSURFACE]), rise = rec_schlick(a.c);
    double coat = v[CLEARCOAT] > 0 ? 0.25 * v[CLEARCOAT] * clearcoat(a, v[CLEARCOAT_GLOSS]) : 0;
    for (int c = 0; c < 3; c++) {
        double tint = luminance > 0 ? v[BASE + c] / luminance : 1;
        double sheen = v[SHEEN] * rise * mix(1, tint, v[SHEEN_TINT]);
        double dielectric = 0.08 * v[SPECULAR] * mix(1, tint, v[SPECULAR_TINT]);
        double f0 = mix(dielectric, v[BASE + c], v[METALLIC]);
        f[c] = (1 - v[METALLIC]) * (v[BASE + c] * white + sheen) + mix(f0, 1, rise) * lobe + coat;
    }
}

static int lobes(const double *parameters, vec3 wi, struct lobe *lobe)
{
    const double *v = parameters;
    double base = rec_mean(v + BASE), rise = rec_schlick(wi.z);
    double f0 = mix(0.08 * v[SPECULAR], base, v[METALLIC]);
    double width = mix(0.1, 0.001, v[CLEARCOAT_GLOSS]);
    int n = rec_lobe_body(lobe, v + BASE);
    lobe->weight *= 1 - v[METALLIC];
    lobe[n++] =
        rec_lobe(LOBE_VISIBLE, mix(f0, 1, rise), fmax(1e-3, v[ROUGHNESS] * v[ROUGHNESS]), 0);
    lobe[n++] = rec_lobe(LOBE_GTR, 0.25 * v[CLEARCOAT] * mix(0.04, 1, rise), width, 1);
    return n;
}

const struct model rec_model_disney = {
    .name = "disney",
    .source = "Burley, \"Physically Based Shading at Disney\", SIGGRAPH 2012 course",
    .parameter = (const struct parameter[]){{"base", 3, 0, 1},
                                            {"metallic", 1, 0, 1},
                                            {"roughness", 1, 0, 1},
                                            {"specular", 1, 0, 1},
                                            {"specular_tint", 1, 0, 1},
                                            {"sheen", 1, 0, 1},
                                            {"sheen_tint", 1, 0, 1},
                                            {"subsurface", 1, 0, 1},
                                            {"clearcoat", 1, 0, 1},
                                            {"clearcoat_gloss", 1, 0, 1},
                                            {0}},
    .eval = eval,
    .lobes = lobes,
};
