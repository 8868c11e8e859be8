/* glare_ink.c -- black ink beside white paper, as a meter of what the lens spreads over it.
 *
 * Method.   Ink and paper of one tag share their light. The paper's radiance is a plane over the
 *           tag, fitted to its white bits and read off where the ink is. Photosites count only
 *           where a margin of blur around them is of one kind: the widest margin that leaves
 *           enough of them. A tag whose paper is no plane (a shadow's edge, something before it)
 *           is left out.
 */
#include "glare_ink.h"
#include "dense.h"
#include "tag_image.h"
#include "view_map.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { SITES_MIN = 8 };                            // a channel, of ink and of paper
static const double MARGIN_PX[] = {5, 3.5, 2.25};  // 2.25: four deviations of a sharp lens's blur
static const double UNEVEN = 0.02;                 // of the paper about its plane

/** Sums over the photosites of one kind, and the normal equations of the paper's plane. */
struct sums {
    double count[3], value[3], square[3], variance[3], place[3][2];
    double a[3][9], b[3][3];
    double pixel[2];
    int sites;
};

/** What a box of the pattern holds, when it holds one thing. */
static enum cell cell_about(const struct tag_pattern *p, const double st[2], const double margin[2])
{
    int low[2], high[2];
    for (int k = 0; k < 2; k++) {
        low[k] = (int)floor(p->begin + (st[k] - margin[k]) * p->side);
        high[k] = (int)floor(p->begin + (st[k] + margin[k]) * p->side);
        if (low[k] < 0 || high[k] >= p->width)
            return CELL_UNKNOWN;
    }
    enum cell first = p->cell[low[1]][low[0]];
    for (int j = low[1]; j <= high[1]; j++)
        for (int i = low[0]; i <= high[0]; i++)
            if (p->cell[j][i] != first)
                return CELL_UNKNOWN;
    return first;
}

static void add_site(struct sums *s, const struct radiance *map, int x, int y, const double st[2])
{
    const double row[3] = {1, st[0] - 0.5, st[1] - 0.5};
    float value[3], variance[3];
    bool measured[3];
    cap_radiance_at(map, x, y, value, variance);
    if (!cal_measured(map, variance, measured))
        return;
    for (int c = 0; c < 3; c++) {
        double v = value[c];
        if (!measured[c])
            continue;
        s->count[c]++;
        s->value[c] += v;
        s->square[c] += v * v;
        s->variance[c] += variance[c];
        for (int i = 0; i < 3; i++) {
            s->b[c][i] += row[i] * v;
            for (int j = 0; j < 3; j++)
                s->a[c][3 * i + j] += row[i] * row[j];
        }
        s->place[c][0] += row[1];
        s->place[c][1] += row[2];
    }
    s->pixel[0] += x;
    s->pixel[1] += y;
    s->sites++;
}

/** Sort the photosites of a tag into ink and paper. */
static void look_at_tag(struct sums *ink, struct sums *paper, const struct tag_image *image,
                        const struct radiance *map, double margin_px)
{
    double low[2] = {DBL_MAX, DBL_MAX}, high[2] = {-DBL_MAX, -DBL_MAX};
    for (int k = 0; k < 4; k++)
        for (int a = 0; a < 2; a++) {
            low[a] = fmin(low[a], image->corner[k][a]);
            high[a] = fmax(high[a], image->corner[k][a]);
        }
    const double grow[2] = {0.2 * (high[0] - low[0]), 0.2 * (high[1] - low[1])};
    const int x1 = (int)fmin(high[0] + grow[0], map->width - 1);
    const int y1 = (int)fmin(high[1] + grow[1], map->height - 1);
    const struct lattice lattice = cal_lattice(map, 1.96 * (high[0] - low[0]) * (high[1] - low[1]));
    for (int y = (int)fmax(low[1] - grow[1], 0); y <= y1; y++)
        for (int x = (int)fmax(low[0] - grow[0], 0); x <= x1 && cal_on_lattice(lattice, y); x++) {
            const double pixel[2] = {x, y};
            if (!cal_on_lattice(lattice, x))
                continue;
            double st[2], by[2][2];
            tag_image_apply(&image->square_from_q, pixel, st, by);
            const double margin[2] = {margin_px * (fabs(by[0][0]) + fabs(by[0][1])),
                                      margin_px * (fabs(by[1][0]) + fabs(by[1][1]))};
            enum cell cell = cell_about(image->pattern, st, margin);
            if (cell != CELL_UNKNOWN)
                add_site(cell == CELL_BLACK ? ink : paper, map, x, y, st);
        }
}

static bool enough(const struct sums *s)
{
    return s->count[0] >= SITES_MIN && s->count[1] >= SITES_MIN && s->count[2] >= SITES_MIN;
}

/** Channel c of the ink and of the paper's plane below it; false: the paper is no plane. */
static bool compare(struct ink *to, const struct sums *ink, const struct sums *paper, int c)
{
    double a[9], plane[3], residual = paper->square[c];
    memcpy(a, paper->a[c], sizeof a);
    memcpy(plane, paper->b[c], sizeof plane);
    if (!dense_cholesky(3, a))
        return false;
    dense_solve(3, a, plane);
    for (int i = 0; i < 3; i++)
        residual -= plane[i] * paper->b[c][i];
    double n = ink->count[c], mean = paper->value[c] / paper->count[c];
    double noise = paper->variance[c] / paper->count[c];
    to->black[c] = ink->value[c] / n;
    to->white[c] = plane[0] + (plane[1] * ink->place[c][0] + plane[2] * ink->place[c][1]) / n;
    to->noise[c] = sqrt(ink->variance[c]) / n;
    return residual / paper->count[c] < 4 * noise + UNEVEN * UNEVEN * mean * mean
           && to->black[c] < 0.5 * to->white[c];
}

static enum status append(struct inks *inks, const struct ink *ink, struct error *err)
{
    if (inks->count == inks->room) {
        int room = inks->room ? 2 * inks->room : 64;
        struct ink *grown = realloc(inks->ink, (size_t)room * sizeof *grown);
        if (!grown)
            return cap_fail(err, STATUS_MEMORY, "the ink of %d tags", room);
        inks->ink = grown;
        inks->room = room;
    }
    inks->ink[inks->count++] = *ink;
    return STATUS_OK;
}

enum status cal_glare_look(struct inks *inks, const struct radiance *map,
                           const struct calibration *c, int v, const struct tag_family *family,
                           struct error *err)
{
    enum { MARGINS = sizeof MARGIN_PX / sizeof *MARGIN_PX };
    const struct view *view = &c->view[v];
    enum status status = STATUS_OK;
    for (int i = 0; i < view->tags && !status; i++) {
        struct tag_pattern pattern;
        struct tag_image image = {.pattern = &pattern};
        struct sums ink = {0}, paper = {0};
        status = pattern_of(&pattern, family, view->tag[i].id, err);
        if (status)
            return status;
        // The lens bends less within a tag than the margin.
        memcpy(image.corner, view->tag[i].corner, sizeof image.corner);
        tag_image_set(&image);
        for (int k = 0; k < MARGINS && !(enough(&ink) && enough(&paper)); k++) {
            ink = paper = (struct sums){0};
            look_at_tag(&ink, &paper, &image, map, MARGIN_PX[k]);
        }
        struct ink one = {.view = v, .tag = view->tag[i].id};
        bool good = enough(&ink) && enough(&paper);
        for (int k = 0; k < 3 && good; k++)
            good = compare(&one, &ink, &paper, k);
        for (int k = 0; k < 2 && good; k++)
            one.pixel[k] = ink.pixel[k] / ink.sites;
        if (good)
            status = append(inks, &one, err);
    }
    return status;
}
