/* predict.c -- what a shot should look like.
 *
 * Method.   Photosites are followed to the sample as for the samples (footprint.c), and L = V (f
 *           light cos(theta_i)/r^2 + what the board brings) with f of the BRDF at the mean
 *           directions of the photosite. A pixel of the picture is the mean over the same
 *           photosites of the map and of the prediction: of a large block some rows and columns, at
 *           an odd distance, so that a mosaic's channels all take part.
 */
#include "predict.h"

#include "bounce_map.h"
#include "raster.h"

#include <float.h>
#include <stdlib.h>

enum { TAKEN = 3 };  // rows and columns of a block that are looked at

/** Sums of one pixel. */
struct pixel_sums {
    double photograph[3], predicted[3];
    int count[3];
};

/** A picture under construction. */
struct predicting {
    const struct prediction_of *of;
    struct viewing viewing;
    struct prediction picture;
    pixel_box box;
    int stride;              // of the photosites that are looked at
    struct pixel_sums *row;  // [width]: the pixels of one row of blocks
};

// Unit vectors across n: the tangent plane of the surface, at any azimuth.
static void tangents(vec3 n, vec3 *x, vec3 *y)
{
    *x = vec3_normalize(vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0}));
    *y = vec3_cross(n, *x);
}

static vec3 local(vec3 w, vec3 n, vec3 x, vec3 y)
{
    return (vec3){vec3_dot(w, x), vec3_dot(w, y), vec3_dot(w, n)};
}

// Radiance [3] of a lane that shows the sample.
static void predict_lane(double radiance[3], const struct predicting *p, const struct strip *s,
                         int i)
{
    const struct viewing *v = &p->viewing;
    const double pixel[2] = {s->x0 + i, s->y};
    const double left = cal_vignetting(v->camera, pixel);
    vec3 n = rec_lane_wide(&s->normal, i), x, y;
    double f[3] = {0};
    struct bounced_light bounced = {{0}, 0};
    tangents(n, &x, &y);
    vec3 wi = local(rec_lane_wide(&s->wi, i), n, x, y),
         wo = local(rec_lane_wide(&s->wo, i), n, x, y);
    bool lit = s->fate[i] == FATE_USED || s->fate[i] == FATE_TERMINATOR;
    if (lit && s->irradiance[i] > 0)
        rec_brdf_eval(p->of->brdf, wi, wo, f);
    const sight at = {rec_lane(&s->point, i), n, rec_lane_wide(&s->wo, i)};
    if (v->bounce && wo.z > 0)
        bounced = rec_bounce_at(v->bounce, &at, s->x0 + i, s->y);
    for (int c = 0; c < 3; c++)
        radiance[c] =
            left * (f[c] * v->light[c] * (lit ? s->irradiance[i] : 0) + bounced.radiance[c]);
}

static bool shows_sample(const struct strip *s, int i)
{
    return s->hit[i] > 0 && s->fate[i] != FATE_OUTLINE && s->fate[i] != FATE_OCCLUDED;
}

static void add_lane(struct predicting *p, const struct strip *s, int i)
{
    const struct radiance *map = p->of->map;
    const int x = s->x0 + i, own = *map->cfa ? cap_radiance_channel(map, x, s->y) : -1;
    struct pixel_sums *to = &p->row[(x - p->box.x0) / p->picture.step];
    double radiance[3];
    float value[3], variance[3];
    cap_radiance_at(map, x, s->y, value, variance);
    predict_lane(radiance, p, s, i);
    for (int c = 0; c < 3; c++) {
        if ((own >= 0 && own != c) || !(variance[c] <= FLT_MAX))
            continue;
        to->photograph[c] += (double)value[c];
        to->predicted[c] += radiance[c];
        to->count[c]++;
    }
}

static void add_row(struct predicting *p, int y)
{
    const pixel_box box = p->box;
    struct strip s = {.y = y};
    for (s.x0 = box.x0 / LANES * LANES; s.x0 < box.x1; s.x0 += LANES) {
        s.from = s.x0 < box.x0 ? box.x0 - s.x0 : 0;
        s.to = s.x0 + LANES > box.x1 ? box.x1 - s.x0 : LANES;
        rec_strip_footprints(&s, &p->viewing);
        rec_strip_block(&s, &p->viewing);
        for (int i = s.from; i < s.to; i++)
            if (shows_sample(&s, i) && (s.x0 + i - box.x0) % p->picture.step % p->stride == 0)
                add_lane(p, &s, i);
    }
}

static void predict_all(struct predicting *p)
{
    struct prediction *to = &p->picture;
    for (int j = 0; j < to->height; j++) {
        for (int i = 0; i < to->width; i++)
            p->row[i] = (struct pixel_sums){0};
        for (int k = 0; k < to->step && p->box.y0 + j * to->step + k < p->box.y1; k += p->stride)
            add_row(p, p->box.y0 + j * to->step + k);
        for (int i = 0; i < 3 * to->width; i++) {
            const struct pixel_sums *sums = &p->row[i / 3];
            int c = i % 3, n = sums->count[c];
            size_t at = 3 * (size_t)j * (size_t)to->width + (size_t)i;
            to->photograph[at] = n ? (float)(sums->photograph[c] / n) : NAN;
            to->predicted[at] = n ? (float)(sums->predicted[c] / n) : NAN;
        }
    }
}

// An odd distance of about a TAKEN-th of a block meets all channels of a cell of 2 x 2; larger
// cells are looked at whole.
static int stride_of(int step, int side)
{
    int stride = step / TAKEN;
    stride -= (stride + 1) % 2;
    return step <= TAKEN || side > 2 ? 1 : stride < 3 ? 3 : stride;
}

// The picture's size: whole blocks, at least the cell of a mosaic.
static void lay_out(struct predicting *p, int size)
{
    const pixel_box box = p->box;
    const int width = box.x1 - box.x0, height = box.y1 - box.y0;
    const char *cfa = p->of->map->cfa;
    const int larger = width > height ? width : height, least = *cfa ? cap_cfa_side(cfa) : 1;
    int step = (larger + size - 1) / size;
    step = step > least ? step : least;
    p->stride = stride_of(step, *cfa ? cap_cfa_side(cfa) : 1);
    p->picture = (struct prediction){.x0 = box.x0,
                                     .y0 = box.y0,
                                     .step = step,
                                     .width = (width + step - 1) / step,
                                     .height = (height + step - 1) / step};
}

static enum status make_room(struct predicting *p, struct error *err)
{
    const size_t n = (size_t)p->picture.width * (size_t)p->picture.height;
    p->picture.photograph = malloc((3 * n + 1) * sizeof(float));
    p->picture.predicted = malloc((3 * n + 1) * sizeof(float));
    p->row = malloc(((size_t)p->picture.width + 1) * sizeof *p->row);
    return p->picture.photograph && p->picture.predicted && p->row
               ? STATUS_OK
               : cap_fail(err, STATUS_MEMORY, "no memory for a picture");
}

static enum status check_size(const struct prediction_of *of, const struct camera *camera,
                              struct error *err)
{
    const struct radiance *map = of->map;
    if (map->width == camera->width && map->height == camera->height)
        return STATUS_OK;
    return cap_fail(err, STATUS_FORMAT, "shot %s: %d x %d pixels, but camera %s has %d x %d",
                    of->calibration->view[of->view].name, map->width, map->height, camera->name,
                    camera->width, camera->height);
}

enum status rec_predict(struct prediction *prediction, const struct prediction_of *of, int size,
                        struct error *err)
{
    const struct calibration *c = of->calibration;
    const struct camera *camera = &c->camera[c->view[of->view].camera];
    struct predicting p = {.of = of};
    struct lens_table lens = {0};
    struct bounce_map bounce = {0};
    struct raster raster = {0};
    enum status status = check_size(of, camera, err);
    if (!status)
        status = rec_lens_make(&lens, camera, err);
    if (!status) {
        p.viewing = rec_viewing(c, of->view, &lens, of->board);
        p.viewing.blockers = of->blockers;
        p.viewing.table = of->brdf->lookup;
        p.box = rec_sample_box(&p.viewing);
        lay_out(&p, size);
        status = make_room(&p, err);
    }
    if (!status)
        status = rec_bounce_make(&bounce, c, of->view, &p.viewing, p.box, err);
    if (!status && c->sample.shape == SHAPE_MESH)
        status = rec_raster_make(&raster, &p.viewing, p.box, err);
    if (!status) {
        p.viewing.bounce = &bounce;
        p.viewing.raster = c->sample.shape == SHAPE_MESH ? &raster : NULL;
        predict_all(&p);
        *prediction = p.picture;
        p.picture = (struct prediction){0};  // the caller's now
    }
    rec_prediction_free(&p.picture);
    free(p.row);
    rec_raster_free(&raster);
    rec_bounce_free(&bounce);
    rec_lens_free(&lens);
    return status;
}

void rec_prediction_free(struct prediction *prediction)
{
    free(prediction->photograph);
    free(prediction->predicted);
    *prediction = (struct prediction){0};
}

float rec_prediction_ratio(const struct prediction *p, int x, int y, int channel, float bright)
{
    size_t at = 3 * ((size_t)y * (size_t)p->width + (size_t)x) + (size_t)channel;
    return p->predicted[at] > 1e-3F * bright ? p->photograph[at] / p->predicted[at] : NAN;
}
