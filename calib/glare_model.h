/* glare_model.h -- the equations of ink beside paper. Internal to glare_fit.c and glare_sigma.c. */
#ifndef GONIOCAM_GLARE_MODEL_H
#define GONIOCAM_GLARE_MODEL_H

#include "glare_ink.h"

enum { UNKNOWNS = 3 + GLARE_TERMS };  // the ink's reflectance in each channel, and the shares

/** One channel of the ink of a tag, linear about a solution. */
struct row {
    double off, rest;                     // seen less model; the same without the view's own error
    double by[UNKNOWNS], bare[UNKNOWNS];  // by r of the channels and the shares; see Views
    double u, sigma, weight;
};

/** What light each kernel brings to each ink: [inks][terms][3]. */
struct model {
    const struct inks *inks;  // in the order of views
    double (*light)[GLARE_TERMS][3];
    struct row *row;  // [inks][3]
    double *work;     // [inks][3]
    double scale;     // of the residuals, in sigmas
};

/** One set of kernels, fitted. */
struct solution {
    double share[GLARE_TERMS], ink[3], misfit;
    bool ok;
};

/** Take the part of each view's own error from all rows: rest and bare of what they are now. */
void glare_project(const struct model *model);
/** Add a row to the normal equations. */
void glare_add_row(double a[UNKNOWNS * UNKNOWNS], double b[UNKNOWNS], const struct row *row);
/** Solve a x = b with the shares that are not in `set` (a bit each) held; b becomes x. */
bool glare_solve(double a[UNKNOWNS * UNKNOWNS], double b[UNKNOWNS], int set);

/** The number of kernels in a set. */
static inline int glare_size(int set)
{
    return (set & 1) + (set >> 1 & 1) + (set >> 2 & 1);
}

static inline double glare_total(const struct solution *s)
{
    double sum = 0;
    for (int k = 0; k < GLARE_TERMS; k++)
        sum += s->share[k];
    return sum;
}

/** Variance of the sum of the shares of a set, its rows about the solution; infinite where too
 *  little tells. */
double glare_variance(const struct model *model, int set);
/** How far the views' own sums of shares scatter about the common one, beyond their noise. */
double glare_disagreement(const struct model *model, const struct solution *solution);
#endif
