/* highlight.c -- where a sphere mirrors a lamp.
 *
 * Method.   The brightest place of the disc, smoothed over three photosites; all that hangs
 *           together with it and lies above CORE of the way from the disc's median to its level is
 *           the highlight (below, the lens's bloom leans to one side), and its middle weighted by
 *           what it exceeds that level. The direction
 *           follows by the mirror law from the sphere's normal there.
 * Accuracy. A mirror's highlight is found to a tenth of a photosite. A glossy lobe is not
 *           symmetric about the mirror direction (Fresnel, foreshortening), and its middle is off
 *           by a part of its width: that is in sigma. Chrome balls (../shared/real/psbox)
 * give lamps to 0.8 degrees of the files beside them.
 */
#include "highlight.h"

#include <assert.h>
#include <stdlib.h>

static const double RIM = 0.95;        // of the radius: beyond, all surfaces turn bright
static const double AREA_MAX = 0.03;   // of the disc: wider is shading, not a highlight
static const double CONTRAST_MIN = 2;  // of peak and median
static const double CORE = 0.92, CORE_PX = 4, HALF = 0.5;  // a smaller core has no middle
static const double SMALL = 0.08;                          // of the radius: a facet is 1/14
static const double ASYMMETRY = 1, CENTROID_PX = 0.1;

/** The disc cut out of a map, in gray. */
struct disc {
    int x, y, width, height;
    float *gray;  // [height][width], NAN outside the disc
};

/** A ninth of the gray of the photosites left - 1 to left + width of a row. */
static void gray_row(double *gray, float *row, const struct radiance *map, int y, int left,
                     int width)
{
    cap_radiance_row(map, y, left - 1, left + width + 1, row, NULL);
    for (int i = 0; i < width + 2; i++)
        gray[i] = ((double)row[3 * i] + row[3 * i + 1] + row[3 * i + 2]) / 27;
}

static bool cut_disc(struct disc *d, const struct radiance *map, const double center[2],
                     double radius)
{
    double r = RIM * radius;
    int right = (int)fmin(center[0] + r, map->width - 2);
    int bottom = (int)fmin(center[1] + r, map->height - 2);
    *d = (struct disc){.x = (int)fmax(center[0] - r, 1), .y = (int)fmax(center[1] - r, 1)};
    d->width = right - d->x + 1;
    d->height = bottom - d->y + 1;
    if (d->width < 8 || d->height < 8)
        return false;
    const int line = d->width + 2;
    d->gray = malloc((size_t)d->width * (size_t)d->height * sizeof *d->gray);
    float *row = malloc(3 * (size_t)line * sizeof *row);
    double *gray = malloc(3 * (size_t)line * sizeof *gray);  // of three rows, in turn
    bool room = d->gray && row && gray;
    for (int j = -1; room && j <= d->height; j++) {
        gray_row(gray + (j + 1) % 3 * line, row, map, d->y + j, d->x, d->width);
        for (int i = 0; i < d->width && j > 0; i++) {
            double sum = 0, dx = d->x + i - center[0], dy = d->y + j - 1 - center[1];
            for (int n = 0; n < 9; n++)
                sum += gray[(j - 1 + n / 3) % 3 * line + i + n % 3];
            d->gray[(j - 1) * d->width + i] = dx * dx + dy * dy < r * r ? (float)sum : NAN;
        }
    }
    if (!room) {
        free(d->gray);
        d->gray = NULL;
    }
    free(row);
    free(gray);
    return room;
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/** Median and largest value of the disc, and how many photosites it has. */
static int levels_of(const struct disc *d, float *work, double *median, int *peak)
{
    enum { ENOUGH = 8192 };  // for the median
    int n = 0, some = 0, all = d->width * d->height, step = 1 + all / ENOUGH;
    *peak = -1;
    for (int k = 0; k < all; k++) {
        if (!isfinite(d->gray[k]))
            continue;
        if (n++ % step == 0)
            work[some++] = d->gray[k];
        if (*peak < 0 || d->gray[k] > d->gray[*peak])
            *peak = k;
    }
    if (n == 0)
        return 0;
    qsort(work, (size_t)some, sizeof *work, by_value);
    *median = work[some / 2];
    return n;
}

/** Collect what hangs together with `peak` above `level`; takes it out of the disc. */
static void collect(struct highlight *h, struct disc *d, int peak, double level, int *stack)
{
    double weight = 0, sum[2] = {0};
    int top = 0, area = 0;
    stack[top++] = peak;
    while (top > 0) {
        int k = stack[--top], i = k % d->width, j = k / d->width;
        if (!(d->gray[k] >= level))
            continue;
        double w = d->gray[k] - level + 1e-12 * level;
        weight += w;
        sum[0] += w * i;
        sum[1] += w * j;
        area++;
        d->gray[k] = NAN;
        if (i > 0)
            stack[top++] = k - 1;
        if (i + 1 < d->width)
            stack[top++] = k + 1;
        if (j > 0)
            stack[top++] = k - d->width;
        if (j + 1 < d->height)
            stack[top++] = k + d->width;
    }
    h->pixel[0] = d->x + sum[0] / weight;
    h->pixel[1] = d->y + sum[1] / weight;
    h->radius = sqrt(area / CAP_PI);
}

/** The highlight as what lies above a share of the way from median to peak. */
static bool find_above(struct highlight *h, const struct radiance *map, const double center[2],
                       double radius, double share)
{
    struct disc d = {0};
    if (!cut_disc(&d, map, center, radius))
        return false;
    size_t all = (size_t)d.width * (size_t)d.height;
    float *work = malloc(all * sizeof *work);
    int *stack = malloc((4 * all + 1) * sizeof *stack), peak = -1, count = 0;
    double median = 0;
    if (work && stack)
        count = levels_of(&d, work, &median, &peak);
    median = fmax(median, 0);
    bool found = count > 0 && d.gray[peak] > CONTRAST_MIN * median;
    if (found) {
        collect(h, &d, peak, median + share * (d.gray[peak] - median), stack);
        found = CAP_PI * h->radius * h->radius < AREA_MAX * count;
    }
    free(d.gray);
    free(work);
    free(stack);
    return found;
}

bool cal_highlight_find(struct highlight *h, const struct radiance *map, const double center[2],
                        double radius)
{
    struct highlight whole, core;
    bool found = find_above(&whole, map, center, radius, HALF);
    if (found) {
        bool has_core = find_above(&core, map, center, radius, CORE) && core.radius >= CORE_PX;
        for (int a = 0; a < 2 && has_core; a++)
            whole.pixel[a] = core.pixel[a];
        *h = whole;
    }
    return found;
}

vec3 cal_mirror(vec3 normal, vec3 wo)
{
    return vec3_sub(vec3_scale(normal, 2 * vec3_dot(normal, wo)), wo);
}

bool cal_highlight_lamp(struct seen_highlight *seen, const struct radiance *map,
                        const struct calibration *c, const struct sample *s, int v)
{
    const struct view *view = &c->view[v];
    const struct camera *camera = &c->camera[view->camera];
    assert(s->shape == SHAPE_SPHERE);
    vec3 at = cal_to_view(view->view_from_world, s->center), eye = cal_eye(view->view_from_world);
    double center[2];
    if (at.z <= 1.5 * s->radius)
        return false;
    cal_project(camera, at, center);
    double px = camera->focal[0] * s->radius / vec3_length(at);
    struct highlight h;
    if (!cal_highlight_find(&h, map, center, px))
        return false;
    mat3 r = cal_rotation(view->view_from_world.rotation);
    vec3 ray = mat3_mul_t(&r, cal_ray(camera, h.pixel)), to = vec3_sub(s->center, eye);
    double along = vec3_dot(ray, to);
    double under = along * along - vec3_dot(to, to) + s->radius * s->radius;
    if (under <= 0)
        return false;
    vec3 point = vec3_add(eye, vec3_scale(ray, along - sqrt(under)));
    vec3 normal = vec3_scale(vec3_sub(point, s->center), 1 / s->radius), wo = vec3_scale(ray, -1);
    // A step of one pixel turns the normal by 1/(px cos) and the mirrored ray by twice that. A lobe
    // of half width w, times what changes by e^(a theta), has its middle a w^2/2 off.
    double cosine = fmax(vec3_dot(normal, wo), 0.1), turn = 1 / (px * cosine);
    double width = h.radius * turn;
    double sigma = 2 * hypot(CENTROID_PX * turn, ASYMMETRY / cosine * width * width);
    float unused[3], variance[3];
    cap_radiance_at(map, (int)(h.pixel[0] + 0.5), (int)(h.pixel[1] + 0.5), unused, variance);
    bool known = isfinite(variance[0]) && isfinite(variance[1]) && isfinite(variance[2]);
    *seen = (struct seen_highlight){cal_mirror(normal, wo), point, wo, sigma, !known,
                                    h.radius < SMALL * px};
    return true;
}
