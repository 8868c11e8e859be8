/* microfacet.h -- the factors of microfacet models: Fresnel, slope distributions, shadowing.
 *
 * All take cosines, c = wi.h, cos_h = n.h, or the sine too where the cosine alone would lose
 * digits. See microfacet.c for the papers.
 */
#ifndef GONIOCAM_MICROFACET_H
#define GONIOCAM_MICROFACET_H

#include "brdf.h"

/** Angles of one pair of directions as the models use them. */
typedef struct {
    double cos_i, cos_o;    // of wi and wo from the normal, > 0
    double sin2_h, cos2_h;  // of h from the normal, squared
    double c;               // wi.h = wo.h
} facet;

/** Requires wi.z > 0 and wo.z > 0. */
facet rec_facet(vec3 wi, vec3 wo);

/** Unpolarised reflectance of a smooth dielectric. Requires ior >= 1; 0 where ior = 1. */
double rec_fresnel_dielectric(double c, double ior);
/** (1 - c)^5: how far F has come from normal incidence to grazing (Schlick 1994). */
double rec_schlick(double c);

/** Smith's G1 of GGX over the cosine, 2 / (cos + sqrt(cos^2 + a^2 sin^2)): finite at grazing. */
double rec_ggx_g1_over_cos(double cosine, double alpha);
/** F, and its derivative by ior. */
double rec_fresnel_slope(double c, double ior, double *by_ior);

/** D G / (4 cos_i cos_o), 1/sr: the lobe without its Fresnel factor, G = G1(i) G1(o); _slope: and
 *  its derivative by alpha. */
double rec_lobe_ggx(facet a, double alpha);
double rec_lobe_ggx_slope(facet a, double alpha, double *by_alpha);
double rec_lobe_beckmann(facet a, double alpha);
double rec_lobe_beckmann_slope(facet a, double alpha, double *by_alpha);
/** The same with G = 1 / (1 + Lambda(i) + Lambda(o)): masking and shadowing know of each other. */
double rec_lobe_correlated(facet a, double alpha);
double rec_lobe_correlated_slope(facet a, double alpha, double *by_alpha);
/** With GTR slopes, D = k / (alpha^2 cos^2 theta_h + sin^2 theta_h)^gamma, and G of GGX. */
double rec_lobe_gtr(facet a, double alpha, double gamma);

/** f of a matt body under a dielectric lobe, of parameters albedo [3], alpha, ior, and its
 *  derivatives [3][5], from the lobe without its Fresnel factor and its derivative by alpha. */
void rec_plastic_slopes(const double *parameters, facet a, double lobe, double by_alpha,
                        double f[3], double *slope);

#endif
