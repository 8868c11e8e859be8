/* scatter.c -- a BRDF from measurements at scattered pairs of directions.
 *
 * Method.   A pair is a point of four axes: root(theta_h), theta_d, and phi_d, doubled and folded,
 * on a half circle whose radius goes to 0 with either theta, where phi_d is arbitrary. The nearest
 * measurements are found in a k-d tree and weighed by Franke and Little's form of Shepard's method,
 * ((r - d) / (r d))^2 with r the distance of the last of them. Source.   R. Franke, "Scattered Data
 * Interpolation: Tests of Some Methods", Math. Comp. 38, 1982.
 */
#include "scatter.h"

#include <stdlib.h>
#include <string.h>

enum { NEAREST = 9 };

// Sorted as a balanced tree: the middle of any range divides it along the axis of its depth.
struct scatter {
    struct scattered *sample;
    int count;
};

static void find_place(double place[SCATTER_AXES], vec3 wi, vec3 wo)
{
    half_diff a = rec_half_diff(wi, wo);
    double h = sqrt(fmax(0, a.theta_h) / (CAP_PI / 2)), d = a.theta_d / (CAP_PI / 2);
    double phi = acos(fmin(1, fabs(cos(a.phi_d)))),
           radius = 0.5 * sqrt(h) * d;  // folded to [0, pi/2]
    place[0] = h;
    place[1] = d;
    place[2] = radius * cos(2 * phi);
    place[3] = radius * sin(2 * phi);
}

/* ---- the tree ---------------------------------------------------------------------------------
 */

static int by_axis(const void *a, const void *b, void *axis)
{
    double x = ((const struct scattered *)a)->place[*(int *)axis];
    double y = ((const struct scattered *)b)->place[*(int *)axis];
    return (x > y) - (x < y);
}

static void divide(struct scattered *sample, int count, int depth)
{
    int axis = depth % SCATTER_AXES, middle = count / 2;
    if (count < 2)
        return;
    qsort_r(sample, (size_t)count, sizeof *sample, by_axis, &axis);
    divide(sample, middle, depth + 1);
    divide(sample + middle + 1, count - middle - 1, depth + 1);
}

// The nearest so far, by distance.
struct near {
    const struct scattered *sample[NEAREST];
    double distance2[NEAREST];
    int count;
};

static void offer(struct near *near, const struct scattered *s, const double place[SCATTER_AXES])
{
    double d2 = 0;
    for (int k = 0; k < SCATTER_AXES; k++)
        d2 += (s->place[k] - place[k]) * (s->place[k] - place[k]);
    if (near->count == NEAREST && d2 >= near->distance2[NEAREST - 1])
        return;
    int i = near->count < NEAREST ? near->count++ : NEAREST - 1;
    for (; i > 0 && near->distance2[i - 1] > d2; i--) {
        near->distance2[i] = near->distance2[i - 1];
        near->sample[i] = near->sample[i - 1];
    }
    near->distance2[i] = d2;
    near->sample[i] = s;
}

static void look(struct near *near, const struct scattered *sample, int count, int depth,
                 const double place[SCATTER_AXES])
{
    if (count < 1)
        return;
    int axis = depth % SCATTER_AXES, middle = count / 2;
    double away = place[axis] - sample[middle].place[axis];
    const struct scattered *after = sample + middle + 1;
    if (away < 0)
        look(near, sample, middle, depth + 1, place);
    else
        look(near, after, count - middle - 1, depth + 1, place);
    offer(near, &sample[middle], place);
    if (near->count == NEAREST && away * away >= near->distance2[NEAREST - 1])
        return;
    if (away < 0)
        look(near, after, count - middle - 1, depth + 1, place);
    else
        look(near, sample, middle, depth + 1, place);
}

/* ---- the BRDF ---------------------------------------------------------------------------------
 */

static void scatter_eval(const void *data, vec3 wi, vec3 wo, double f[3])
{
    const double same = 1e-9;  // closer than that is the same place
    const struct scatter *scatter = data;
    double place[SCATTER_AXES], weights = 0;
    struct near near = {.count = 0};
    find_place(place, wi, wo);
    look(&near, scatter->sample, scatter->count, 0, place);
    double r = sqrt(near.distance2[near.count - 1]) * (1 + 1e-6) + same;
    f[0] = f[1] = f[2] = 0;
    for (int i = 0; i < near.count; i++) {
        double d = sqrt(near.distance2[i]) + same, w = (r - d) / (r * d) + same;
        weights += w * w;
        for (int c = 0; c < 3; c++)
            f[c] += w * w * near.sample[i]->f[c];
    }
    for (int c = 0; c < 3; c++)
        f[c] /= weights;
}

static void scatter_free(void *data)
{
    struct scatter *scatter = data;
    if (scatter)
        free(scatter->sample);
    free(scatter);
}

static const struct brdf_kind scatter_kind = {"scattered measurements", scatter_eval, scatter_free};

enum status rec_scatter_brdf(struct brdf *brdf, struct scattered *sample, int count,
                             const char *path, struct error *err)
{
    int kept = 0;
    for (int i = 0; i < count; i++)
        if (sample[i].wi.z > 0 && sample[i].wo.z > 0) {
            sample[kept] = sample[i];
            find_place(sample[kept].place, sample[kept].wi, sample[kept].wo);
            kept++;
        }
    struct scatter *scatter = kept ? malloc(sizeof *scatter) : NULL;
    if (!scatter) {
        free(sample);
        return kept ? cap_fail(err, STATUS_MEMORY, "%s: no memory", path)
                    : cap_fail(err, STATUS_FORMAT,
                               "%s: no measurement with both directions above the horizon", path);
    }
    divide(sample, kept, 0);
    *scatter = (struct scatter){sample, kept};
    *brdf = (struct brdf){.kind = &scatter_kind, .data = scatter};
    return STATUS_OK;
}
