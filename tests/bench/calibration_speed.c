/* calibration_speed.c -- how long the two heavy parts of geometry take, on made-up input:
 *
 *     bench_calibration_speed          prints seconds
 *
 * Bundle adjustment with covariance of 40 views x 24 tags; tags of a 24-megapixel frame found and
 * refined on one thread. The issue asks for 1.0 s and 0.4 s. */
#include "bundle.h"
#include "corners.h"
#include "detect.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { VIEWS = 40, COLUMNS = 6, ROWS = 4, TAGS = COLUMNS * ROWS, WIDTH = 6000, HEIGHT = 4000 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void make_board(struct tag_place *tag)
{
    for (int i = 0; i < TAGS; i++) {
        int row = i / COLUMNS;
        tag[i] = (struct tag_place){.id = i,
                                    .size = 30,
                                    .center = {(i % COLUMNS - 2.5) * 46, (1.5 - row) * 46, 0},
                                    .x_axis = {1, 0, 0},
                                    .y_axis = {0, 1, 0}};
    }
}

static pose view_of(int v)
{
    double turn = 2 * CAP_PI * v / VIEWS, tilt = 0.3 + 0.4 * (v % 5) / 4;
    return (pose){{CAP_PI - tilt, 0.3 * sin(turn), 0.3 * cos(turn)}, {5 * cos(turn), 0, 700}};
}

/** Corners with a twentieth of a pixel of noise of a fixed seed. */
static double noise(void)
{
    static unsigned seed = 1;
    double sum = 0;
    for (int i = 0; i < 12; i++) {
        seed = seed * 1664525u + 1013904223u;
        sum += seed / 4294967296.0;
    }
    return 0.05 * (sum - 6);
}

static int time_bundle(const struct capture *capture)
{
    struct camera camera = {.width = 1200,
                            .height = 800,
                            .focal = {2000, 2000},
                            .center = {600, 400},
                            .distortion = {-0.1, 0.05, 3e-4, -2e-4, 0}};
    struct view view[VIEWS];
    struct calibration c = {.camera = &camera, .cameras = 1, .view = view, .views = VIEWS};
    struct sighting *sighting = calloc(VIEWS * TAGS, sizeof *sighting);
    if (!sighting)
        return 1;
    for (int v = 0; v < VIEWS; v++) {
        view[v] = (struct view){.name = "v", .view_from_world = view_of(v)};
        for (int i = 0; i < TAGS; i++) {
            struct sighting *s = sighting + v * TAGS + i;
            *s = (struct sighting){.view = v, .place = i, .refined = true};
            for (int k = 0; k < 4; k++) {
                vec3 p = cal_to_view(view[v].view_from_world, cap_tag_corner(capture->tag + i, k));
                cal_project(&camera, p, s->corner[k]);
                for (int a = 0; a < 2; a++)
                    s->corner[k][a] += noise();
            }
            for (int k = 0; k < 8; k++)
                s->covariance[k][k] = 0.05 * 0.05;
        }
    }
    for (int v = 0; v < VIEWS; v++) {  // a start like that of a real run
        view[v].view_from_world.rotation.x += 0.01;
        view[v].view_from_world.translation.z *= 1.02;
    }
    camera.focal[0] = camera.focal[1] = 1960;
    memset(camera.distortion, 0, sizeof camera.distortion);
    struct bundle bundle = {
        .calibration = &c, .capture = capture, .sighting = sighting, .sightings = VIEWS * TAGS};
    struct error err = {0};
    double began = now();
    enum status status = bundle_adjust(&bundle, BUNDLE_CHOOSE, &err);
    printf("bundle of %d views x %d tags, with covariance: %.3f s (asked <= 1.0); focal length "
           "%.2f +- %.2f (true 2000)%s\n",
           VIEWS, TAGS, now() - began, camera.focal[0], camera.sigma_focal[0],
           status ? err.text : "");
    free(sighting);
    return status != STATUS_OK;
}

/** The board, seen by a camera that looks straight down: 20 pixels a millimetre. */
static float paper(const struct tag_pattern *pattern, const struct tag_place *tag, double x,
                   double y)
{
    for (int i = 0; i < TAGS; i++) {
        double cell = tag[i].size / pattern[i].side;
        double u = (x - tag[i].center.x) / cell + 0.5 * pattern[i].side + pattern[i].begin;
        double v = (tag[i].center.y - y) / cell + 0.5 * pattern[i].side + pattern[i].begin;
        if (u >= 0 && v >= 0 && u < pattern[i].width && v < pattern[i].width)
            return pattern[i].cell[(int)v][(int)u] == CELL_BLACK ? 0.05f : 0.8f;
    }
    return 0.3f;
}

static int time_tags(const struct capture *capture)
{
    const double scale = 20;
    struct camera camera = {.width = WIDTH,
                            .height = HEIGHT,
                            .focal = {scale * 700, scale * 700},
                            .center = {0.5 * WIDTH, 0.5 * HEIGHT}};
    struct detector detector = {0};
    struct tag_pattern pattern[TAGS];
    struct detection *found = NULL;
    struct error err = {0};
    size_t count = 3 * (size_t)WIDTH * HEIGHT;
    struct radiance map = {.width = WIDTH,
                           .height = HEIGHT,
                           .channels = 3,
                           .value = malloc(count * sizeof(float)),
                           .variance = malloc(count * sizeof(float))};
    if (!map.value || !map.variance || detector_begin(&detector, "tag36h11", &err))
        return 1;
    for (int i = 0; i < TAGS; i++)
        if (pattern_of(pattern + i, &detector.family, i, &err))
            return 1;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            float v = paper(pattern, capture->tag, (x - camera.center[0]) / scale,
                            -(y - camera.center[1]) / scale);
            for (int k = 0; k < 3; k++) {
                size_t at = 3 * ((size_t)y * WIDTH + (size_t)x) + (size_t)k;
                map.value[at] = v + 0.002f * (float)noise();
                map.variance[at] = 1e-8f;
            }
        }
    double began = now();
    int tags = 0, fitted = 0;
    enum status status = detector_find(&detector, capture, &map, &found, &tags, &err);
    double searched = now();
    for (int i = 0; i < tags; i++) {
        struct tag_fit fit;
        fitted += corners_fit(&fit, pattern + found[i].id, &camera, &map, found[i].corner);
    }
    printf("24-megapixel frame, one thread: %d of %d tags found in %.3f s, %d refined in %.3f s "
           "(asked <= 0.4 together)\n",
           tags, TAGS, searched - began, fitted, now() - searched);
    free(found);
    detector_end(&detector);
    cap_radiance_free(&map);
    return status != STATUS_OK;
}

int main(void)
{
    struct tag_place tag[TAGS];
    make_board(tag);
    const struct capture capture = {.tag = tag, .tags = TAGS, .family = "tag36h11"};
    return time_bundle(&capture) + time_tags(&capture);
}
