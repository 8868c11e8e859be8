/* test_highlight.c -- the highlight of a mirror, made by the mirror law, and on real chrome balls.
 */
#include "highlight.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>

static struct radiance blank(int width, int height, float level)
{
    size_t n = 3 * (size_t)width * (size_t)height;
    struct radiance map = {.width = width, .height = height, .channels = 3};
    map.value = malloc(n * sizeof *map.value);
    map.variance = calloc(n, sizeof *map.variance);
    assert_non_null(map.value);
    for (size_t i = 0; i < n; i++)
        map.value[i] = level;
    return map;
}

static void mirror_law(void **state)
{
    (void)state;
    vec3 n = vec3_normalize((vec3){1, 2, 3}), wo = vec3_normalize((vec3){-1, 0.5, 2});
    vec3 wi = cal_mirror(n, wo);
    assert_near(vec3_length(wi), 1, 1e-15);
    assert_near(vec3_dot(wi, n), vec3_dot(wo, n), 1e-15);
    assert_near(vec3_dot(vec3_cross(wi, wo), n), 0, 1e-15);
}

/** A Gaussian spot at a place between pixels is found there. */
static void middle_of_a_spot(void **state)
{
    (void)state;
    struct radiance map = blank(200, 160, 1);
    const double at[2] = {93.37, 71.81}, center[2] = {100, 80};
    for (int y = 0; y < map.height; y++)
        for (int x = 0; x < map.width; x++)
            for (int c = 0; c < 3; c++)
                map.value[3 * (y * map.width + x) + c] +=
                    (float)(50 * exp(-0.5 * (pow(x - at[0], 2) + pow(y - at[1], 2)) / 6.25));
    struct highlight h;
    assert_true(cal_highlight_find(&h, &map, center, 60));
    assert_near(h.pixel[0], at[0], 0.05);
    assert_near(h.pixel[1], at[1], 0.05);
    cap_radiance_free(&map);
}

/** Shading alone, cos(theta) over a disc, is no highlight. */
static void shading_is_none(void **state)
{
    (void)state;
    struct radiance map = blank(200, 160, 0);
    const double center[2] = {100, 80};
    for (int y = 0; y < map.height; y++)
        for (int x = 0; x < map.width; x++) {
            double nx = (x - center[0]) / 60, ny = (y - center[1]) / 60, q = 1 - nx * nx - ny * ny;
            double shade = q > 0 ? fmax(0.6 * sqrt(q) - 0.8 * nx, 0) : 0;
            for (int c = 0; c < 3; c++)
                map.value[3 * (y * map.width + x) + c] = (float)shade;
        }
    struct highlight h;
    assert_false(cal_highlight_find(&h, &map, center, 60));
    cap_radiance_free(&map);
}

/* ---- chrome balls: ../shared/real/psbox, where it is ------------------------------------------
 */

enum { LAMPS = 12 };
static const char folder[] = "../shared/real/psbox";

static bool read_jpeg(struct radiance *map, const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return false;
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_decompress(&jpeg);
    jpeg_stdio_src(&jpeg, file);
    jpeg_read_header(&jpeg, TRUE);
    jpeg.out_color_space = JCS_RGB;
    jpeg_start_decompress(&jpeg);
    int width = (int)jpeg.output_width;
    *map = blank(width, (int)jpeg.output_height, 0);
    unsigned char *row = malloc(3 * (size_t)width);
    while (jpeg.output_scanline < jpeg.output_height) {
        float *to = map->value + 3 * (size_t)jpeg.output_scanline * (size_t)width;
        jpeg_read_scanlines(&jpeg, &row, 1);
        for (int i = 0; i < 3 * width; i++)
            to[i] = row[i];
    }
    free(row);
    jpeg_finish_decompress(&jpeg);
    jpeg_destroy_decompress(&jpeg);
    fclose(file);
    return true;
}

static bool read_numbers(double *number, int count, const char *path)
{
    FILE *file = fopen(path, "r");
    int n = 0;
    while (file && n < count && fscanf(file, "%lf", number + n) == 1)
        n++;
    if (file)
        fclose(file);
    return n == count;
}

/** Seen from afar, the normal at a pixel is its place on the disc; y runs up in these files. */
static vec3 direction_at(const struct highlight *h, const double circle[3], int height)
{
    double x = (h->pixel[0] - circle[0]) / circle[2];
    double y = (height - 1 - h->pixel[1] - circle[1]) / circle[2];
    vec3 n = {x, y, sqrt(fmax(1 - x * x - y * y, 0))}, wo = {0, 0, 1};
    return cal_mirror(n, wo);
}

static void chrome_balls_give_the_lamps(void **state)
{
    (void)state;
    double worst = 0;
    for (int probe = 1; probe <= 2; probe++) {
        double circle[3], lamp[3 * LAMPS];
        char path[200];
        snprintf(path, sizeof path, SOURCE "/%s/LightProbe-%d/circle_data.txt", folder, probe);
        if (!read_numbers(circle, 3, path))
            skip();
        snprintf(path, sizeof path, SOURCE "/%s/LightProbe-%d/light_directions.txt", folder, probe);
        assert_true(read_numbers(lamp, 3 * LAMPS, path));
        for (int i = 0; i < LAMPS; i++) {
            struct radiance map;
            struct highlight h;
            snprintf(path, sizeof path, SOURCE "/%s/LightProbe-%d/Image_%02d.JPG", folder, probe,
                     i + 1);
            assert_true(read_jpeg(&map, path));
            const double center[2] = {circle[0], map.height - 1 - circle[1]};
            assert_true(cal_highlight_find(&h, &map, center, circle[2]));
            vec3 found = direction_at(&h, circle, map.height);
            vec3 given = {lamp[i], lamp[LAMPS + i], lamp[2 * LAMPS + i]};
            double off = vec3_length(vec3_cross(found, vec3_normalize(given)));
            worst = fmax(worst, asin(fmin(off, 1)) * 180 / CAP_PI);
            cap_radiance_free(&map);
        }
    }
    print_message("chrome balls: worst direction %.2f degrees\n", worst);
    assert_true(worst < 1.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mirror_law),
        cmocka_unit_test(middle_of_a_spot),
        cmocka_unit_test(shading_is_none),
        cmocka_unit_test(chrome_balls_give_the_lamps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
