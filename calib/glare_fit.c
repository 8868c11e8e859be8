/* glare_fit.c -- shares of light that a lens spreads, from ink beside paper in many views.
 *
 * Method.   With w and r w the true radiances of paper and ink, and S_k = K_k true the light that
 *           kernel k brings, both are seen as
 *
 *               white = (1 - g) w + sum g_k S_k,      black = (1 - g) r w + sum g_k S_k,
 *
 *           so  black = r (white - sum g_k S_k) + sum g_k S_k,      g = sum g_k.
 *
 *           The reflectance r of the ink, relative to the paper, is a constant of the board, one a
 *           channel, but for a small error of each view (paper and ink may come from frames whose
 *           times are not quite true); the shares are common to all channels. What tells them apart
 *           is that the paper's light differs over the board, and not as the picture's mean does.
 *           Generalised least squares with Tukey's weights (ink that mirrors the lamp is no meter),
 *           linear in one of r and g at a time, hence in rounds; S_k anew for each g. Of all sets
 *           of kernels the smallest that explains the ink nearly as well as any is taken.
 * Views.    An error common to the rows of a view, of standard deviation t along u = r white, makes
 *           their covariance D + t^2 u u^T. Its inverse (Sherman and Morrison) is that of D with
 *           u's part taken off one side: each row's gradient x becomes x - u p, with
 *           p = t^2 sum(u x / D) / (1 + t^2 sum(u^2 / D)).
 * Accuracy. glare_sigma.c.
 */
#include "dense.h"
#include "glare_model.h"

#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 12, INKS_MIN = 12, VIEWS_MIN = 2 };
static const double UNEVEN = 0.005;      // print of a board, relative, at least
static const double VIEW_SIGMA = 0.005;  // of a view's r, relative: times, a recovered curve
static const double SIGNIFICANT = 3;     // sigmas
static const double FAINT = 2e-4;        // shares below this change nothing
static const double TUKEY = 4.685;       // 95 % efficient for normal errors
static const double WORTH = 0.05;        // of the misfit, that a further kernel has to explain
static const double SHARE_MAX = 0.3;

static void linearise(const struct model *m, const struct solution *s)
{
    for (int i = 0; i < m->inks->count; i++)
        for (int c = 0; c < 3; c++) {
            const struct ink *ink = &m->inks->ink[i];
            struct row *row = &m->row[3 * i + c];
            double veil = 0;
            memset(row->by, 0, sizeof row->by);
            for (int k = 0; k < GLARE_TERMS; k++) {
                veil += s->share[k] * m->light[i][k][c];
                row->by[3 + k] = (1 - s->ink[c]) * m->light[i][k][c];
            }
            row->by[c] = ink->white[c] - veil;
            row->u = s->ink[c] * row->by[c];
            row->off = ink->black[c] - row->u - veil;
            row->sigma = hypot(ink->noise[c], UNEVEN * (row->u + veil));
        }
}

/** Take the part of the view's own error from the rows [first, last) of channel c. */
static void project(const struct model *m, int first, int last, int c)
{
    double p[UNKNOWNS] = {0}, off = 0, uu = 1 / (VIEW_SIGMA * VIEW_SIGMA);
    for (int i = first; i < last; i++) {
        const struct row *row = &m->row[3 * i + c];
        uu += row->weight * row->u * row->u;
        off += row->weight * row->u * row->off;
        for (int j = 0; j < UNKNOWNS; j++)
            p[j] += row->weight * row->u * row->by[j];
    }
    for (int i = first; i < last; i++) {
        struct row *row = &m->row[3 * i + c];
        row->rest = row->off - row->u * off / uu;
        for (int j = 0; j < UNKNOWNS; j++)
            row->bare[j] = row->by[j] - row->u * p[j] / uu;
    }
}

void glare_project(const struct model *m)
{
    for (int first = 0, last; first < m->inks->count; first = last) {
        for (last = first;
             last < m->inks->count && m->inks->ink[last].view == m->inks->ink[first].view;)
            last++;
        for (int c = 0; c < 3; c++)
            project(m, first, last, c);
    }
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/** The residuals' scale by their median, and Tukey's weights about it. */
static void set_weights(struct model *m)
{
    int n = 3 * m->inks->count;
    for (int i = 0; i < n; i++)
        m->work[i] = fabs(m->row[i].rest) / m->row[i].sigma;
    qsort(m->work, (size_t)n, sizeof *m->work, by_size);
    m->scale = fmax(1.4826 * m->work[n / 2], 1e-6);
    for (int i = 0; i < n; i++) {
        double sigma = m->row[i].sigma * m->scale, z = m->row[i].rest / (TUKEY * sigma);
        m->row[i].weight = fabs(z) < 1 ? pow((1 - z * z) / sigma, 2) : 0;
    }
}

/** Rows about a solution, with weights that know it. */
static void prepare(struct model *m, const struct solution *s, bool first)
{
    linearise(m, s);
    for (int i = 0; i < 3 * m->inks->count && first; i++)
        m->row[i].weight = 1 / (m->row[i].sigma * m->row[i].sigma);
    glare_project(m);
    set_weights(m);
    glare_project(m);
}

void glare_add_row(double a[UNKNOWNS * UNKNOWNS], double b[UNKNOWNS], const struct row *row)
{
    for (int j = 0; j < UNKNOWNS; j++) {
        b[j] += row->weight * row->bare[j] * row->off;
        for (int k = 0; k < UNKNOWNS; k++)
            a[j * UNKNOWNS + k] += row->weight * row->bare[j] * row->by[k];
    }
}

bool glare_solve(double a[UNKNOWNS * UNKNOWNS], double b[UNKNOWNS], int set)
{
    for (int k = 3; k < UNKNOWNS; k++) {
        if (set >> (k - 3) & 1)
            continue;
        for (int j = 0; j < UNKNOWNS; j++)
            a[k * UNKNOWNS + j] = a[j * UNKNOWNS + k] = 0;
        a[k * UNKNOWNS + k] = 1;
        b[k] = 0;
    }
    if (!dense_cholesky(UNKNOWNS, a))
        return false;
    dense_solve(UNKNOWNS, a, b);
    return true;
}

/** One step towards the least squares of the kernels in `set`. */
static bool step(struct solution *s, const struct model *m, int set)
{
    double a[UNKNOWNS * UNKNOWNS] = {0}, b[UNKNOWNS] = {0};
    for (int i = 0; i < 3 * m->inks->count; i++)
        glare_add_row(a, b, &m->row[i]);
    if (!glare_solve(a, b, set))
        return false;
    for (int c = 0; c < 3; c++)
        s->ink[c] += b[c];
    for (int k = 0; k < GLARE_TERMS; k++)
        s->share[k] += b[3 + k];
    return true;
}

/** Fit the kernels in `set`; not ok where a share comes out negative. */
static struct solution solve(struct model *m, int set)
{
    struct solution s = {.ok = true};
    for (int i = 0; i < m->inks->count; i++)
        for (int c = 0; c < 3; c++)
            s.ink[c] += m->inks->ink[i].black[c] / m->inks->ink[i].white[c] / m->inks->count;
    for (int round = 0; round < ROUNDS && s.ok; round++) {
        prepare(m, &s, round == 0);
        s.ok = step(&s, m, set);
    }
    s.misfit = m->scale;
    for (int k = 0; k < GLARE_TERMS; k++)
        s.ok = s.ok && s.share[k] >= 0;
    s.ok = s.ok && glare_total(&s) < SHARE_MAX;
    return s;
}

static int key_of(const struct ink *ink, bool by_tag)
{
    return by_tag ? ink->tag : ink->view;
}

/** The number of tags, or of views. */
static int clusters_of(const struct inks *inks, bool by_tag)
{
    int clusters = 0;
    for (int i = 0; i < inks->count; i++) {
        bool fresh = true;
        for (int k = 0; k < i && fresh; k++)
            fresh = key_of(&inks->ink[k], by_tag) != key_of(&inks->ink[i], by_tag);
        clusters += fresh;
    }
    return clusters;
}

/** The smallest set of kernels that explains the ink nearly as well as any; an even veil first. */
static int choose(struct solution *best, struct model *m)
{
    // The misfit is only known to 1/sqrt(n), of n tags or views with errors of their own.
    const double n = fmin(clusters_of(m->inks, false), clusters_of(m->inks, true));
    const double worth = fmin(WORTH + 1 / sqrt(n), 0.5);
    int chosen = 0;
    for (int size = 1; size <= GLARE_TERMS; size++)
        for (int set = 1; set < 1 << GLARE_TERMS; set++) {
            struct solution s = {0};
            if (glare_size(set) == size)
                s = solve(m, set);
            if (s.ok && (!chosen || s.misfit < (1 - worth) * best->misfit)) {
                *best = s;
                chosen = set;
            }
        }
    if (chosen)
        *best = solve(m, chosen);  // the weights are its own again
    return chosen;
}

/** Fields of the true light for the shares of a solution, and what they bring to the ink. */
static enum status bring(struct model *m, const struct solution *s, const struct glare_field *seen,
                         int views, struct error *err)
{
    enum status status = STATUS_OK;
    for (int v = 0; v < views && !status; v++) {
        struct glare_field truth = {0};
        if (!seen[v].value)
            continue;
        status = cap_glare_clear(&truth, &seen[v], s->share, err);
        for (int k = 0; k < GLARE_TERMS && !status; k++) {
            struct glare_field spread = {0};
            status = cap_glare_spread(&spread, &truth, k, err);
            for (int i = 0; i < m->inks->count && !status; i++) {
                const struct ink *ink = &m->inks->ink[i];
                if (ink->view == v)
                    cap_glare_at(&spread, ink->pixel[0], ink->pixel[1], m->light[i][k]);
            }
            free(spread.value);
        }
        free(truth.value);
    }
    return status;
}

/** What the solution says, significant or not. */
static struct glare_estimate conclude(const struct model *m, const struct solution *s, int set)
{
    struct glare_estimate e = {.total = glare_total(s)};
    memcpy(e.ink, s->ink, sizeof e.ink);
    double variance = glare_variance(m, set);
    e.sigma = hypot(sqrt(variance), glare_disagreement(m, s));
    if (e.total > FAINT && e.total > SIGNIFICANT * sqrt(variance))
        memcpy(e.share, s->share, sizeof e.share);
    return e;
}

enum status cal_glare_fit(struct glare_estimate *estimate, const struct inks *inks,
                          const struct glare_field *seen, int views, struct error *err)
{
    enum { REPEATS = 3 };
    *estimate = (struct glare_estimate){.sigma = INFINITY};
    if (inks->count < INKS_MIN || clusters_of(inks, false) < VIEWS_MIN)
        return STATUS_OK;
    size_t count = (size_t)inks->count;
    struct model m = {.inks = inks,
                      .light = calloc(count, sizeof *m.light),
                      .row = calloc(3 * count, sizeof *m.row),
                      .work = calloc(3 * count, sizeof *m.work)};
    struct solution best = {0};
    int set = 0;
    enum status status = m.light && m.row && m.work
                             ? STATUS_OK
                             : cap_fail(err, STATUS_MEMORY, "the ink of %d tags", inks->count);
    for (int repeat = 0; repeat < REPEATS && !status; repeat++) {
        status = bring(&m, &best, seen, views, err);
        set = status ? 0 : choose(&best, &m);
        if (!set)
            break;
    }
    if (!status && set)
        *estimate = conclude(&m, &best, set);
    free(m.light);
    free(m.row);
    free(m.work);
    return status;
}
