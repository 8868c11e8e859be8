/* overlay_photograph.c -- the photograph under an overlay: a radiance map as a picture for the eye.
 */
#include "overlay_photograph.h"

#include <stdlib.h>
#include <string.h>

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// The level that 2 % of the values exceed becomes white.
static float white_level(const struct radiance *map)
{
    enum { ENOUGH = 20000 };
    size_t values = 3 * (size_t)map->width * (size_t)map->height, n = 0;
    const size_t stride = 3 * (values / (3 * ENOUGH)) + 1;  // all channels take part
    float *v = malloc((values / stride + 1) * sizeof *v), white = 0;
    for (size_t i = 0; v && i < values; i += stride) {
        float value[3];
        size_t at = i / 3, width = (size_t)map->width;
        cap_radiance_at(map, (int)(at % width), (int)(at / width), value, NULL);
        if (isfinite(value[i % 3]))
            v[n++] = value[i % 3];
    }
    if (v && n > 0) {
        qsort(v, n, sizeof *v, compare_floats);
        white = v[n - 1 - n / 50];
    }
    free(v);
    return white > 0 ? white : 1;
}

// A gamma of 2.2 is near enough to sRGB for a look.
static uint32_t display_value(float level)
{
    return (uint32_t)(255 * powf(fminf(fmaxf(level, 0), 1), 1 / 2.2f) + 0.5f);
}

// The rows of a strip of blocks of n x n pixels, of which three by three tell enough.
enum { TELLING = 3 };
struct strip {
    float *row[TELLING];  // [width][3]
    int rows, step;
};

// Mean of a block, as a display value.
static uint32_t display_pixel(const struct strip *strip, int x0, int n, float white)
{
    float sum[3] = {0}, count = 0;
    for (int k = 0; k < strip->rows; k++)
        for (int x = x0; x < x0 + n; x += strip->step, count++)
            for (int c = 0; c < 3; c++) {
                float value = strip->row[k][3 * (size_t)x + (size_t)c];
                sum[c] += isfinite(value) ? value : 0;
            }
    uint32_t rgb = 0;
    for (int c = 0; c < 3; c++)
        rgb = rgb << 8 | display_value(sum[c] / (count * white));
    return rgb;
}

bool cal_overlay_photograph(cairo_surface_t *surface, const struct radiance *map, int n)
{
    const size_t line = 3 * (size_t)map->width;
    struct strip strip = {.step = (n + TELLING - 1) / TELLING};
    float *rows = malloc(TELLING * line * sizeof *rows), white = white_level(map);
    if (!rows)
        return false;
    for (int k = 0; k < TELLING; k++)
        strip.row[k] = rows + (size_t)k * line;
    unsigned char *data = cairo_image_surface_get_data(surface);
    int stride = cairo_image_surface_get_stride(surface);
    cairo_surface_flush(surface);
    for (int y = 0; y < map->height / n; y++) {
        strip.rows = 0;
        for (int k = 0; k < n; k += strip.step)
            cap_radiance_row(map, y * n + k, 0, map->width, strip.row[strip.rows++], NULL);
        for (int x = 0; x < map->width / n; x++) {
            uint32_t rgb = display_pixel(&strip, x * n, n, white);
            memcpy(data + (size_t)y * (size_t)stride + 4 * (size_t)x, &rgb, sizeof rgb);
        }
    }
    cairo_surface_mark_dirty(surface);
    free(rows);
    return true;
}
