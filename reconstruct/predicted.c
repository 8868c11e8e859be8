/* predicted.c -- photographs beside what table and calibration predict. */
#include "predicted.h"

#include "plot.h"
#include "quantile.h"

#include <stdlib.h>

enum { SIZE = 320, GAP = 8 };  // pixels of each picture, and between them

// What 1 % of the photograph's pixels exceed is as bright as can be.
static double white_of(const struct prediction *p)
{
    const size_t n = 3 * (size_t)p->width * (size_t)p->height;
    double *value = malloc((n + 1) * sizeof *value);
    int found = 0;
    for (size_t i = 0; value && i < n; i++)
        if (p->photograph[i] > 0)
            value[found++] = p->photograph[i];
    double white = rec_quantile(value, value ? found : 0, 0.99);
    free(value);
    return white > 0 ? white : 1;
}

static uint32_t tone(const float rgb[3], double white)
{
    uint32_t out = 0;
    for (int c = 0; c < 3; c++) {
        double x = isfinite(rgb[c]) ? fmin(1, fmax(0, rgb[c] / white)) : 0;
        out = out << 8 | (uint32_t)lround(255 * pow(x, 1 / 2.2));
    }
    return rec_argb(out);
}

static struct picture paint(const struct prediction *p)
{
    struct picture out = rec_picture_make(3 * p->width + 2 * GAP, p->height);
    const double white = white_of(p);
    for (int y = 0; out.argb && y < p->height; y++) {
        uint32_t *row = out.argb + (size_t)y * (size_t)out.width;
        for (int x = 0; x < out.width; x++)
            row[x] = rec_argb(0);
        for (int x = 0; x < p->width; x++) {
            size_t at = 3 * ((size_t)y * (size_t)p->width + (size_t)x);
            float ratio = rec_prediction_ratio(p, x, y, 1, 30 * (float)white);
            row[x] = tone(p->photograph + at, white);
            row[p->width + GAP + x] = tone(p->predicted + at, white);
            if (ratio > 0)
                row[2 * (p->width + GAP) + x] =
                    rec_argb(rec_ratio_color(log(ratio) / log(PREDICTED_RATIO_FULL)));
        }
    }
    return out;
}

static enum status predict_view(const struct predicted_of *of, int view, const char *folder,
                                struct error *err)
{
    const char *name = of->calibration->view[view].name;
    char file[560];
    struct radiance map = {0};
    struct prediction p = {0};
    snprintf(file, sizeof file, "radiance/%s.exr", name);
    char *from = cap_path(of->out, file);
    snprintf(file, sizeof file, "%s.png", name);
    char *to = cap_path(folder, file);
    enum status status = from && to ? cap_radiance_open(&map, from, err)
                                    : cap_fail(err, STATUS_MEMORY, "%s: no memory", name);
    const struct prediction_of what = {of->calibration, view,        of->brdf, &map,
                                       of->board,       of->blockers};
    if (!status)
        status = rec_predict(&p, &what, SIZE, err);
    cap_radiance_free(&map);
    if (!status) {
        struct picture picture = paint(&p);
        status = picture.argb ? cap_png_write(picture.argb, picture.width, picture.height,
                                              picture.width, to, err)
                              : cap_fail(err, STATUS_MEMORY, "%s: no memory", name);
        rec_picture_free(&picture);
    }
    rec_prediction_free(&p);
    free(from);
    free(to);
    return status;
}

enum status rec_predicted(const struct predicted_of *of, struct run *run, struct error *err)
{
    char *folder = cap_path(of->out, "predicted");
    enum status status =
        folder ? cap_make_folder(folder, err) : cap_fail(err, STATUS_MEMORY, "no memory");
    if (!status) {
        cap_stage(run, "predictions", of->calibration->views);
#pragma omp parallel for schedule(dynamic, 1) num_threads(run->threads)
        for (int v = 0; v < of->calibration->views; v++) {
            struct error why = {0};
            enum status made = predict_view(of, v, folder, &why);
            if (made) {
#pragma omp critical(predicted_status)
                status = cap_fail(err, made, "%s", why.text);
            }
            cap_step(run);
        }
    }
    free(folder);
    return status;
}
