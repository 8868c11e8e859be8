/* test_photographs.c -- tags in real photographs (../shared/real/apriltag; skipped without it): all
 * of them found, where another detector has them. */
#include "detect.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>

enum { TAGS_MAX = 64 };

/** A photograph as linear radiance: sRGB undone. */
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
    size_t width = jpeg.output_width, values = 3 * width * jpeg.output_height;
    *map = (struct radiance){.width = (int)width,
                             .height = (int)jpeg.output_height,
                             .channels = 3,
                             .value = malloc(values * sizeof *map->value),
                             .variance = calloc(values, sizeof *map->variance)};
    unsigned char *row = malloc(3 * width);
    while (jpeg.output_scanline < jpeg.output_height) {
        float *to = map->value + 3 * width * jpeg.output_scanline;
        jpeg_read_scanlines(&jpeg, &row, 1);
        for (size_t i = 0; i < 3 * width; i++) {
            double v = row[i] / 255.0;
            to[i] = (float)(v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
        }
    }
    free(row);
    jpeg_finish_decompress(&jpeg);
    jpeg_destroy_decompress(&jpeg);
    fclose(file);
    return true;
}

/** Corners [4][2] of the tags that a file lists: "id, x, y, x, y, ..." a line. */
static int read_corners(double corner[TAGS_MAX][4][2], const char *path)
{
    FILE *file = fopen(path, "r");
    char line[400];
    int n = 0;
    while (file && n < TAGS_MAX && fgets(line, sizeof line, file)) {
        double v[9];
        int count = 0;
        for (char *at = line, *end; count < 9; at = end) {
            while (*at && !strchr("-0123456789", *at))
                at++;
            v[count] = strtod(at, &end);
            if (end == at)
                break;
            count++;
        }
        if (count == 9)
            memcpy(corner[n++], v + 1, sizeof corner[0]);
    }
    if (file)
        fclose(file);
    return n;
}

/** Distance of two quadrangles, whichever corner each begins with and whichever way it runs. */
static double distance(double a[4][2], double b[4][2])
{
    double best = INFINITY;
    for (int turn = 0; turn < 8; turn++) {
        double worst = 0;
        for (int k = 0; k < 4; k++) {
            int m = (turn < 4 ? turn + k : turn + 4 - k) % 4;
            // A detector's origin is the corner of the first pixel, ours its centre.
            worst = fmax(worst, hypot(a[k][0] + 0.5 - b[m][0], a[k][1] + 0.5 - b[m][1]));
        }
        best = fmin(best, worst);
    }
    return best;
}

static void tags_are_found(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        int tags;
    } photo[] = {{"33369213973_9d9bb4cc96_c", 12},
                 {"34085369442_304b6bafd9_c", 25},
                 {"34139872896_defdb2f8d9_c", 10}};
    for (int i = 0; i < 3; i++) {
        char path[300];
        struct radiance map;
        struct detector detector = {0};
        static double want[TAGS_MAX][4][2], have[TAGS_MAX][4][2];
        snprintf(path, sizeof path, SOURCE "/../shared/real/apriltag/%s.jpg", photo[i].name);
        if (!read_jpeg(&map, path))
            skip();
        snprintf(path, sizeof path, SOURCE "/../shared/real/apriltag/%s.txt", photo[i].name);
        int listed = read_corners(want, path), found, good = 0;
        assert_int_equal(listed, photo[i].tags);
        assert_int_equal(detector_begin(&detector, "tag36h11", NULL), STATUS_OK);
        assert_int_equal(detector_all(&detector, &map, 0, have, TAGS_MAX, &found, NULL), STATUS_OK);
        for (int a = 0; a < listed; a++) {
            double nearest = INFINITY;
            for (int b = 0; b < found; b++)
                nearest = fmin(nearest, distance(have[b], want[a]));
            // The list comes from encoded images without refinement of edges, which leaves its
            // corners up to a pixel off, and both of us as much again in tags of 12 pixels.
            good += nearest < 1.5;
        }
        print_message("%s: %d of %d tags\n", photo[i].name, good, listed);
        assert_int_equal(good, listed);
        detector_end(&detector);
        cap_radiance_free(&map);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(tags_are_found)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
