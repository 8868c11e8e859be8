/* glare_sigma.c -- how far the shares of light that a lens spreads may be wrong.
 *
 * Method.   The variance is a sum over what errs by itself. Rows, and views (light from outside the
 *           picture): the jackknife over views, at least what the rows' scatter says. Tags (uneven
 *           print): a variance component, the scatter of the tags' mean residuals through their
 *           leverage; a jackknife over tags, of which few have most of the leverage, makes sigma a
 *           sixth too small. To it the views' disagreement is added, since that is what one view's
 *           veil may be wrong by. What a wrong set of kernels does is not in it: a tenth of the
 *           share where print so uneven as 2 % hides which it is.
 */
#include "glare_model.h"

#include <stdlib.h>
#include <string.h>

enum { LOOKS_MIN = 5 };  // rows of a view that tell by themselves

/** What the sum of the shares changes by without the inks of a view; NAN: it is not told then. */
static double without(const struct model *m, int set, int view)
{
    double a[UNKNOWNS * UNKNOWNS] = {0}, b[UNKNOWNS] = {0}, sum = 0;
    int rows = 3 * m->inks->count;
    for (int i = 0; i < rows; i++) {
        m->work[i] = m->row[i].weight;
        if (m->inks->ink[i / 3].view == view)
            m->row[i].weight = 0;
    }
    glare_project(m);
    for (int i = 0; i < rows; i++) {
        glare_add_row(a, b, &m->row[i]);
        m->row[i].weight = m->work[i];
    }
    if (!glare_solve(a, b, set))
        return NAN;
    for (int k = 3; k < UNKNOWNS; k++)
        sum += b[k];
    return sum;
}

/** Variance of the sum of the shares where all inks of a view share an error: the jackknife's,
 *  which knows the leverage of each (B. Efron, "The Jackknife, the Bootstrap and Other
 *  Resampling Plans", 1982). */
static double by_views(const struct model *m, int set)
{
    const struct inks *inks = m->inks;  // in the order of views
    double sum = 0, sum2 = 0, n = 0;
    for (int i = 0; i < inks->count; i++) {
        if (i > 0 && inks->ink[i].view == inks->ink[i - 1].view)
            continue;
        double change = without(m, set, inks->ink[i].view);
        if (isnan(change))
            return INFINITY;
        sum += change;
        sum2 += change * change;
        n++;
    }
    glare_project(m);
    return n > 1 ? (n - 1) / n * (sum2 - sum * sum / n) : INFINITY;
}

/** Variance of the sum of the shares where all rows err by themselves, as much as they scatter. */
static double by_rows(const struct model *m, int set)
{
    double sum = 0;
    for (int k = 3; k < UNKNOWNS; k++) {
        double a[UNKNOWNS * UNKNOWNS] = {0}, b[UNKNOWNS] = {0};
        for (int i = 0; i < 3 * m->inks->count; i++)
            glare_add_row(a, b, &m->row[i]);
        memset(b, 0, sizeof b);
        b[k] = 1;
        if (!glare_solve(a, b, set))
            return INFINITY;
        for (int j = 3; j < UNKNOWNS; j++)
            sum += b[j];
    }
    return sum;
}

/** What the sum of the shares changes by where the ink of a tag is all brighter by 1, relative. */
static double leverage(const struct model *m, int set, int tag)
{
    double a[UNKNOWNS * UNKNOWNS] = {0}, b[UNKNOWNS] = {0}, unused[UNKNOWNS] = {0}, sum = 0;
    for (int i = 0; i < 3 * m->inks->count; i++) {
        const struct row *row = &m->row[i];
        glare_add_row(a, unused, row);
        for (int j = 0; j < UNKNOWNS && m->inks->ink[i / 3].tag == tag; j++)
            b[j] += row->weight * row->bare[j] * row->u;
    }
    if (!glare_solve(a, b, set))
        return INFINITY;
    for (int k = 3; k < UNKNOWNS; k++)
        sum += b[k];
    return sum;
}

/** Is it the first ink of its tag? */
static bool is_first(const struct inks *inks, int ink)
{
    for (int i = 0; i < ink; i++)
        if (inks->ink[i].tag == inks->ink[ink].tag)
            return false;
    return true;
}

/** The residual of a tag's ink, relative, is off / weight; false: nothing of it has any weight. */
static bool residual_of(const struct model *m, int tag, double *off, double *weight)
{
    *off = *weight = 0;
    for (int i = 0; i < 3 * m->inks->count; i++) {
        const struct row *row = &m->row[i];
        if (m->inks->ink[i / 3].tag != tag)
            continue;
        *weight += row->weight * row->u * row->u;
        *off += row->weight * row->u * row->rest;
    }
    return *weight > 0;
}

/** Variance of the sum of the shares where each tag's ink has a reflectance of its own, in all
 *  views and channels alike: the scatter of the tags' mean residuals, of which the fit took
 *  `fitted`, through their leverage. More tags than a jackknife's few with much of it tell the
 *  scatter. */
static double by_print(const struct model *m, int set)
{
    const struct inks *inks = m->inks;
    double weights = 0, weights2 = 0, square = 0, through = 0;
    const int fitted = 1 + glare_size(set);
    for (int i = 0; i < inks->count; i++) {
        double uu, off;
        if (!is_first(inks, i) || !residual_of(m, inks->ink[i].tag, &off, &uu))
            continue;
        weights += uu;
        weights2 += uu * uu;
        square += off * off / uu - 1;  // less what the rows' own noise makes
        through += pow(leverage(m, set, inks->ink[i].tag), 2);
    }
    double tags = weights2 > 0 ? weights * weights / weights2 : 0;
    return tags > fitted ? fmax(square / weights, 0) * tags / (tags - fitted) * through : INFINITY;
}

double glare_variance(const struct model *m, int set)
{
    return fmax(by_views(m, set), by_rows(m, set)) + by_print(m, set);
}

double glare_disagreement(const struct model *m, const struct solution *s)
{
    double sum = 0, count = 0;
    for (int first = 0, last; first < m->inks->count; first = last) {
        double a = 0, b = 0;
        for (last = first;
             last < m->inks->count && m->inks->ink[last].view == m->inks->ink[first].view; last++)
            for (int c = 0; c < 3; c++) {
                const struct row *row = &m->row[3 * last + c];
                double light = 0, bare = 0;
                for (int k = 0; k < GLARE_TERMS; k++) {
                    light += s->share[k] * row->by[3 + k] / glare_total(s);
                    bare += s->share[k] * row->bare[3 + k] / glare_total(s);
                }
                a += row->weight * light * bare;
                b += row->weight * bare * row->off;
            }
        if (last - first < LOOKS_MIN || !(a > 0))
            continue;
        sum += b * b / (a * a) - 1 / a;
        count++;
    }
    return count > 1 ? sqrt(fmax(sum / count, 0)) : 0;
}
