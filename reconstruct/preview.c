/* preview.c -- a picture to look at: spheres of the material under one lamp. */
#include "preview.h"

#include "lookup.h"
#include "plot.h"

#include <string.h>

enum { SIZE = 384, MARGIN = 15 };  // pixels across one sphere's square, and around the sphere

static void draw(struct picture *picture, const struct brdf *brdf, int column, int threads)
{
    struct picture ball = rec_sphere_picture(brdf, rec_sphere_lamp, 1, SIZE, MARGIN, threads);
    for (int i = 0; ball.argb && i < SIZE * SIZE; i++)
        picture->argb[i / SIZE * picture->width + column + i % SIZE] = rec_argb(ball.argb[i]);
    rec_picture_free(&ball);
}

enum status rec_preview(const struct merl *table, const struct fit *fit, const char *path,
                        struct run *run, struct error *err)
{
    struct brdf measured = {.table = *table}, fitted = {.model = fit->model};
    memcpy(fitted.value, fit->value, sizeof fitted.value);
    struct picture picture = rec_picture_make(2 * SIZE, SIZE);
    enum status status = picture.argb ? rec_lookup_make(&measured.lookup, table, err)
                                      : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    if (!status) {
        draw(&picture, &measured, 0, run->threads);
        draw(&picture, &fitted, SIZE, run->threads);
        status =
            cap_png_write(picture.argb, picture.width, picture.height, picture.width, path, err);
    }
    rec_lookup_free(measured.lookup);
    rec_picture_free(&picture);
    return status;
}
