/* defects.c -- photosites that are hot, dead or stuck, from the photographs themselves.
 *
 * Method.   The longest frames of up to 8 shots are read side by side. A photosite stands out in
 *           one where it lies beyond its 8 nearest neighbours of the same channel by 2.5 standard
 *           deviations of noise and by 2.5 % of their light. A highlight or a speck does that too,
 * but not at the same photosite while the scene moves. In view k a sound photosite stands out with
 * probability q_k: what is counted over the image, or in its cell of 64 x 64 photosites (itself
 * left out), whichever is more. The probability of n or more of its views, times the number of
 * photosites, has to be below 0.01: so in 99 of 100 captures no sound photosite is taken. It also
 * has to stand out in half of the views that would show it: a leak where it is dim, a lack where
 * there is light. Views.    Shots between which nothing moved are one view: the second differences
 * of the logarithm of cells of the image correlate by more than 0.5. Unequal   photosites (PRNU):
 * what a photosite is off from the mean of its neighbours, relative, in one view times the same in
 * another has r^2 (1 + 1/8) for its mean: noise and texture are independent. With one view the
 * scatter that noise does not explain, at most that of a usual sensor, is carried. Accuracy. r^2 to
 * (s^2 + r^2) / sqrt(N) for N photosites of relative noise s.
 *
 * EMVA Standard 1288, "Characterization of Image Sensors and Cameras".
 */
#include "defects.h"
#include "sights.h"

#include <stdlib.h>
#include <string.h>

// Times the number of photosites: how many sound ones may be expected to be taken.
static const double SIGNIFICANCE = 0.01;
static const double SAME_VIEW = 0.5;  // correlation
static const double GAIN_SIGMA =
    0.007;  // relative, of the noise's line: noise.c, 300000 photosites
static const double USUAL_UNEQUAL = 0.005;  // what sensors are at most, where nothing is told

enum { VIEWS_MIN = 3 };

/* The group of each view: views between which nothing moved share one. */
static int group_views(int group[SIGHTS_MAX], const struct sights *s)
{
    int groups = 0;
    for (int k = 0; k < s->views; k++) {
        group[k] = -1;
        for (int j = 0; j < k && group[k] < 0; j++) {
            double jj = s->structure[j][j], kk = s->structure[k][k];
            // Where nothing has structure, nothing can stand out twice but by itself.
            bool same = s->structure[j][k] > SAME_VIEW * sqrt(jj * kk);
            group[k] = same ? group[j] : -1;
        }
        if (group[k] < 0)
            group[k] = groups++;
    }
    return groups;
}

/* How often a sound photosite of this cell stands out in a view. */
static double chance(const struct sights *s, size_t cell, int view, bool odd)
{
    const struct sight_count *all = &s->all[view], *here = &s->cell[cell * (size_t)s->views + view];
    double global = (all->odd + 1) / (all->tested + 1);
    double local = here->tested > 0 ? (here->odd - odd) / here->tested : 0;
    return fmin(fmax(global, local), 1);
}

/* Mostly brighter than the photosites around it? */
static bool is_hot(const struct sight *sight)
{
    return 2 * __builtin_popcount(sight->bright & sight->odd) >= __builtin_popcount(sight->odd);
}

/* Probability that a sound photosite stands out in as many views as this one, or more. */
static double chance_of(const struct sights *s, const struct sight *sight, const int *group,
                        int groups)
{
    double q[SIGHTS_MAX] = {0};
    bool tested[SIGHTS_MAX] = {false}, odd[SIGHTS_MAX] = {false};
    int n = 0, of = 0;
    const bool hot = is_hot(sight);
    const unsigned telling = hot ? sight->dim : sight->lit;
    const unsigned seen = sight->odd & (hot ? sight->bright : ~sight->bright);
    if (2 * __builtin_popcount(telling & seen) < __builtin_popcount(telling))
        return 1;
    for (int k = 0; k < s->views; k++) {
        bool now = sight->odd >> k & 1;
        if (!(sight->tested >> k & 1))
            continue;
        // Of views that are one the group stands out where any does.
        q[group[k]] = fmin(q[group[k]] + chance(s, sight->cell, k, now), 1);
        tested[group[k]] = true;
        odd[group[k]] = odd[group[k]] || now;
    }
    double count[SIGHTS_MAX + 1] = {1};  // probabilities of 0, 1, 2, ... views
    for (int g = 0; g < groups; g++) {
        if (!tested[g])
            continue;
        n += odd[g];
        of++;
        for (int k = of; k >= 0; k--)
            count[k] = count[k] * (1 - q[g]) + (k > 0 ? count[k - 1] * q[g] : 0);
    }
    if (n < VIEWS_MIN)
        return 1;
    double p = 0;
    for (int k = n; k <= of; k++)
        p += count[k];
    return p;
}

static enum status judge(struct defects *d, const struct sights *s, const int *group, int groups,
                         struct error *err)
{
    d->sites.defect = malloc((s->sights + 1) * sizeof *d->sites.defect);
    if (!d->sites.defect)
        return cap_fail(err, STATUS_MEMORY, "%zu defective photosites", s->sights);
    for (size_t i = 0; i < s->sights; i++) {
        const struct sight *sight = &s->sight[i];
        if (chance_of(s, sight, group, groups) * s->photosites > SIGNIFICANCE)
            continue;
        d->sites.defect[d->sites.defects++] = sight->at;
        d->hot += is_hot(sight);
        d->dead += !is_hot(sight);
    }
    return STATUS_OK;
}

/* From pairs of different views, or from one view's scatter. */
static void measure_unequal(struct defects *d, const struct sights *s, const int *group)
{
    for (int c = 0; c < 3; c++) {
        double sum = 0, square = 0, count = 0, excess = 0, excess2 = 0, sites = 0;
        double explained = 0;
        for (int k = 0; k < s->views; k++) {
            excess += s->excess[c][k];
            excess2 += s->excess2[c][k];
            explained += s->explained[c][k];
            sites += s->smooth[c][k];
            for (int j = 0; j < k; j++)
                if (group[j] != group[k] && s->pairs[c][j][k] > 0) {
                    // A scene that is bent the same way everywhere has means that are not 0.
                    sum += s->product[c][j][k]
                           - s->first[c][j][k] * s->second[c][j][k] / s->pairs[c][j][k];
                    square += s->product2[c][j][k];
                    count += s->pairs[c][j][k];
                }
        }
        double mean = count > 0 ? sum / count : 0, scatter = 9.0 / 8;
        double sigma = count > 1 ? sqrt(square) / count : 0;
        enum { ENOUGH = 1000 };
        if (count >= ENOUGH) {
            d->told = true;  // also that it is nothing
            d->sites.relative[c] = mean > 4 * sigma ? sqrt(mean / scatter) : 0;
        } else if (sites >= ENOUGH && excess > 4 * hypot(sqrt(excess2), GAIN_SIGMA * explained)) {
            d->sites.relative[c] = fmin(sqrt(excess / sites / scatter), USUAL_UNEQUAL);
        }
    }
}

enum status defects_find(struct defects *defects, const struct capture *capture, int camera,
                         const struct sensor *sensor, const bool *left_out, const struct run *run,
                         struct error *err)
{
    struct defects made = {0};
    struct sights sights = {0};
    int group[SIGHTS_MAX];
    enum status status = sights_read(&sights, capture, camera, sensor, left_out, run, err);
    if (!status && sights.views > 0) {
        int groups = group_views(group, &sights);
        made.views = groups;
        if (groups >= VIEWS_MIN)
            status = judge(&made, &sights, group, groups, err);
        measure_unequal(&made, &sights, group);
    }
    sights_free(&sights);
    if (status)
        defects_free(&made);
    else
        *defects = made;
    return status;
}

void defects_free(struct defects *defects)
{
    evenness_free(&defects->sites);
    *defects = (struct defects){0};
}
