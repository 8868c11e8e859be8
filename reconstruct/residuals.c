/* residuals.c -- residuals of photosites in cells of the sample.
 *
 * Method.   A photosite is compared with the mean of its bin, to which other shots contribute what
 *           they saw at other places under the same angles. Its own shot is part of that mean: the
 *           difference is the part `others` of what it would be beside the others alone; a cell's
 *           value is the least squares solution. No model of f is asked.
 *           A shot's mean in a cell is one observation, for what is wrong with a shot its
 * photosites share; the scatter between shots gives the error of a cell's mean. The variance of the
 *           means less the mean of their squared errors is the variance between places.
 */
#include "residuals.h"

enum { WELL = 30, SHOTS_MIN = 3 };
static const double SOME = 0.2;  // of a bin, below which others hardly tell
static const double unit = 0x1p30;

static double square(double x)
{
    return x * x;
}

// The axis that cells turn about, and two directions across it.
static void body_frame(const struct sample *sample, vec3 frame[3])
{
    vec3 z = sample->shape == SHAPE_CYLINDER ? vec3_normalize(sample->axis) : (vec3){0, 0, 1};
    frame[0] = vec3_normalize(vec3_cross(fabs(z.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0}, z));
    frame[1] = vec3_cross(z, frame[0]);
    frame[2] = z;
}

// floor(x n) for x in [0, 1], kept in [0, n).
static int part(double x, int n)
{
    int i = (int)floor(x * n);
    return i < 0 ? 0 : i >= n ? n - 1 : i;
}

static int place_cell(const reflectance_sample *s, const struct sample *sample, const vec3 frame[3])
{
    double along = vec3_dot(s->normal, frame[2]) / 2;
    if (sample->shape == SHAPE_CYLINDER)
        along = vec3_dot(vec3_sub(s->point, sample->center), frame[2]) / sample->height;
    double turn = atan2(vec3_dot(s->normal, frame[1]), vec3_dot(s->normal, frame[0]));
    return part(along + 0.5, BANDS) * SECTORS + part(turn / (2 * CAP_PI) + 0.5, SECTORS);
}

// -1 where h is too near the normal, or that to the axis, for an azimuth.
static int grain_cell(const reflectance_sample *s, const vec3 frame[3])
{
    const double least = 0.1;
    vec3 h = vec3_normalize(vec3_add(s->wi, s->wo)), n = s->normal;
    vec3 x = vec3_cross(frame[2], n), out = vec3_sub(h, vec3_scale(n, vec3_dot(h, n)));
    if (vec3_length(x) < least || vec3_length(out) < least)
        return -1;
    double angle = atan2(vec3_dot(vec3_cross(x, out), n), vec3_dot(x, out));
    return part(angle < 0 ? angle / CAP_PI + 1 : angle / CAP_PI, GRAIN_CELLS);
}

void rec_residual_add(struct shot_residuals *shot, const reflectance_sample *s,
                      const struct sample *sample)
{
    if (isnan(s->residual) || s->others < SOME)
        return;
    if (vec3_length(shot->frame[2]) == 0)
        body_frame(sample, shot->frame);
    int cell[2] = {place_cell(s, sample, shot->frame), grain_cell(s, shot->frame)};
    for (int k = 0; k < 2; k++)
        if (cell[k] >= 0) {
            int at = cell[k] + k * PLACE_CELLS;
            shot->sum[at] += s->weight * s->others * s->residual;
            shot->weight[at] += s->weight * s->others * s->others;
            shot->count[at]++;
        }
}

void rec_residuals_end_shot(struct residuals *to, const struct shot_residuals *shot)
{
    for (int i = 0; i < PLACE_CELLS + GRAIN_CELLS; i++) {
        if (shot->count[i] < WELL)
            continue;
        struct cell *cell = i < PLACE_CELLS ? &to->place[i] : &to->grain[i - PLACE_CELLS];
        double mean = fmax(-10, fmin(10, shot->sum[i] / shot->weight[i]));
        cell->shots++;
        cell->sum += llround(mean * unit);
        cell->squares += llround(mean * mean * unit);
    }
}

void rec_cells_merge(struct cell *to, const struct cell *from, int count)
{
    for (int i = 0; i < count; i++) {
        to[i].shots += from[i].shots;
        to[i].sum += from[i].sum;
        to[i].squares += from[i].squares;
    }
}

void rec_residuals_merge(struct residuals *to, const struct residuals *from)
{
    rec_cells_merge(to->place, from->place, PLACE_CELLS);
    rec_cells_merge(to->grain, from->grain, GRAIN_CELLS);
}

unevenness rec_unevenness(const struct cell *cell, int count)
{
    unevenness u = {0};
    double means = 0, errors = 0, errors2 = 0;
    for (int i = 0; i < count; i++) {
        double n = (double)cell[i].shots;
        if (n < SHOTS_MIN)
            continue;
        double mean = (double)cell[i].sum / unit / n;
        double error2 = fmax(0, (double)cell[i].squares / unit / n - mean * mean) / (n - 1) + 1e-12;
        means += mean * mean;
        errors += error2;
        errors2 += square(error2);
        u.chi2 += mean * mean / error2;
        u.cells++;
    }
    if (u.cells == 0)
        return u;
    u.chi2 /= u.cells;
    u.rms = sqrt(fmax(0, means - errors) / u.cells);
    // A squared normal deviate has the variance 2.
    u.sigma = sqrt(sqrt(2 * errors2) / u.cells);
    return u;
}
