/* preview.c -- a picture to look at: spheres of the material under one lamp. */
#include "preview.h"

#include "lookup.h"

#include <cairo.h>

enum { SIZE = 384 };  // pixels across one sphere's square

// IEC 61966-2-1's curve, to 8 bits.
static uint32_t encode(double linear)
{
    double x = fmin(1, fmax(0, linear));
    double s = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
    return (uint32_t)(255 * s + 0.5);
}

// The sphere seen along -z from afar: x right, y down in [-1, 1]; black off the sphere.
static void shade(const struct brdf *brdf, double x, double y, double radiance[3])
{
    const double angle = CAP_PI / 6, r2 = x * x + y * y;
    radiance[0] = radiance[1] = radiance[2] = 0;
    if (r2 >= 1)
        return;
    vec3 n = {x, -y, sqrt(1 - r2)}, view = {0, 0, 1};
    vec3 lamp = {-sin(angle) * 0.8, sin(angle) * 0.6, cos(angle)};
    vec3 side = vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0});
    vec3 t = vec3_normalize(side), b = vec3_cross(n, t);
    vec3 wi = {vec3_dot(lamp, t), vec3_dot(lamp, b), vec3_dot(lamp, n)};
    vec3 wo = {vec3_dot(view, t), vec3_dot(view, b), vec3_dot(view, n)};
    rec_brdf_eval(brdf, wi, wo, radiance);
    for (int c = 0; c < 3; c++)
        radiance[c] *= CAP_PI * fmax(0, wi.z);
}

static void draw(cairo_surface_t *picture, const struct brdf *brdf, int column, int threads)
{
    unsigned char *data = cairo_image_surface_get_data(picture);
    int stride = cairo_image_surface_get_stride(picture);
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
    for (int j = 0; j < SIZE; j++) {
        uint32_t *row = (uint32_t *)(void *)(data + (ptrdiff_t)j * stride) + column;
        for (int i = 0; i < SIZE; i++) {
            double c[3], middle = 0.5 * (SIZE - 1), radius = 0.46 * SIZE;
            shade(brdf, (i - middle) / radius, (j - middle) / radius, c);
            row[i] = encode(c[0]) << 16 | encode(c[1]) << 8 | encode(c[2]);
        }
    }
}

enum status rec_preview(const struct merl *table, const struct fit *fit, const char *path,
                        struct run *run, struct error *err)
{
    struct brdf measured = {.table = *table}, fitted = {.model = fit->model};
    for (int k = 0; k < MODEL_PARAMETERS_MAX; k++)
        fitted.value[k] = fit->value[k];
    struct atomic_file file;
    enum status status = rec_lookup_make(&measured.lookup, table, err);
    if (!status)
        status = cap_file_begin(&file, path, false, err);
    if (status) {
        rec_lookup_free(measured.lookup);
        return status;
    }
    cairo_surface_t *picture = cairo_image_surface_create(CAIRO_FORMAT_RGB24, 2 * SIZE, SIZE);
    cairo_status_t made = cairo_surface_status(picture);
    if (made == CAIRO_STATUS_SUCCESS) {
        cairo_surface_flush(picture);
        draw(picture, &measured, 0, run->threads);
        draw(picture, &fitted, SIZE, run->threads);
        cairo_surface_mark_dirty(picture);
        made = cairo_surface_write_to_png(picture, file.aside);
    }
    cairo_surface_destroy(picture);
    rec_lookup_free(measured.lookup);
    if (made == CAIRO_STATUS_SUCCESS)
        return cap_file_commit(&file, err);
    cap_file_abandon(&file);
    return cap_fail(err, STATUS_IO, "%s: %s", path, cairo_status_to_string(made));
}
