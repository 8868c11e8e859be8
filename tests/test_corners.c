/* test_corners.c -- tags rendered area-exactly through a lens of known numbers: found by AprilTag
 * in the right pixel convention, and fitted to a fiftieth of a pixel. */
#include "corners.h"
#include "detect.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>

enum { WIDTH = 150, HEIGHT = 130, FINE = 6 };

// A lens with enough barrel to bend a tag's edge by 0.3 px.
static const struct camera camera = {.width = WIDTH,
                                     .height = HEIGHT,
                                     .focal = {220, 215},
                                     .center = {70, 68},
                                     .distortion = {-0.25, 0.08, 2e-3, -1e-3, 0}};
static const struct tag_place place = {
    .id = 3, .size = 32, .center = {5, -3, 0}, .x_axis = {1, 0, 0}, .y_axis = {0, 1, 0}};
// Looks down at the board, 35 degrees off its normal and turned about the axis.
static const pose view_from_world = {{2.6, 0.5, 0.2}, {0, 0, 130}};

static struct tag_pattern pattern, other_pattern;

static void load_pattern(const char *name)
{
    struct tag_family family = {0};
    assert_int_equal(pattern_open(&family, name, NULL), STATUS_OK);
    assert_int_equal(pattern_of(&pattern, &family, place.id, NULL), STATUS_OK);
    assert_int_equal(pattern_of(&other_pattern, &family, place.id + 1, NULL), STATUS_OK);
    pattern_close(&family);
}

// What the board reflects at (x, y): the tag, and white paper about it.
static double paper(double x, double y)
{
    double cell = place.size / pattern.side;
    double u = (x - place.center.x) / cell + 0.5 * pattern.side + pattern.begin;
    double v = -(y - place.center.y) / cell + 0.5 * pattern.side + pattern.begin;
    if (!(u >= 0 && u < pattern.width && v >= 0 && v < pattern.width))
        return 0.8;
    return pattern.cell[(int)v][(int)u] == CELL_BLACK ? 0.05 : 0.8;
}

// The board's plane z = 0 seen through a point of the image.
static double scene(mat3 r, vec3 eye, double px, double py)
{
    double pixel[2] = {px, py};
    vec3 ray = cal_ray(&camera, pixel), d = mat3_mul_t(&r, ray);
    double s = -eye.z / d.z, x = eye.x + s * d.x, y = eye.y + s * d.y;
    return paper(x, y) * (1 + 0.002 * x - 0.001 * y);  // uneven light
}

// Gaussian blur of sigma (in samples) along one axis of the fine image.
static void blur(double *image, int length, int lines, int step, int line_step, double sigma)
{
    int reach = (int)ceil(4 * sigma);
    double *line = malloc((size_t)length * sizeof *line);
    for (int l = 0; l < lines; l++) {
        double *at = image + (size_t)l * (size_t)line_step;
        for (int i = 0; i < length; i++) {
            double sum = 0, weights = 0;
            for (int k = -reach; k <= reach; k++) {
                int j = i + k < 0 ? 0 : i + k >= length ? length - 1 : i + k;
                double w = exp(-0.5 * k * k / (sigma * sigma));
                sum += w * at[(size_t)j * (size_t)step];
                weights += w;
            }
            line[i] = sum / weights;
        }
        for (int i = 0; i < length; i++)
            at[(size_t)i * (size_t)step] = line[i];
    }
    free(line);
}

// Uniform numbers of variance 1 from a fixed seed (Knuth's 64-bit linear congruence).
static uint64_t seed;
static double noise(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return ((double)(seed >> 11) / 9007199254740992.0 - 0.5) * sqrt(12);
}

// Photosites are squares of FINE x FINE points of a scene blurred by sigma_px; noise as a
// deviation.
static void render(struct radiance *map, double sigma_px, double deviation)
{
    const int w = WIDTH * FINE, h = HEIGHT * FINE;
    mat3 r = cal_rotation(view_from_world.rotation);
    vec3 eye = cal_eye(view_from_world);
    double *fine = malloc((size_t)w * (size_t)h * sizeof *fine);
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++)
            fine[y * w + x] = scene(r, eye, (x + 0.5) / FINE - 0.5, (y + 0.5) / FINE - 0.5);
    if (sigma_px > 0) {
        blur(fine, w, h, 1, w, sigma_px * FINE);
        blur(fine, h, w, w, 1, sigma_px * FINE);
    }
    size_t values = 3 * (size_t)WIDTH * HEIGHT;
    *map = (struct radiance){.width = WIDTH,
                             .height = HEIGHT,
                             .value = malloc(values * sizeof(float)),
                             .variance = malloc(values * sizeof(float)),
                             .channels = 3};
    seed = 1;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double sum = 0;
            for (int k = 0; k < FINE * FINE; k++)
                sum += fine[(y * FINE + k / FINE) * w + x * FINE + k % FINE];
            for (int c = 0; c < 3; c++) {
                int at = 3 * (y * WIDTH + x) + c;
                map->value[at] = (float)(sum / (FINE * FINE) + deviation * noise());
                map->variance[at] = (float)(deviation * deviation);
            }
        }
    free(fine);
}

static void truth(double corner[4][2])
{
    for (int k = 0; k < 4; k++)
        cal_project(&camera, cal_to_view(view_from_world, cap_tag_corner(&place, k)), corner[k]);
}

static void free_map(struct radiance *map)
{
    free(map->value);
    free(map->variance);
}

// ---- detection

static struct {
    const char *family;
} families[] = {{"tag36h11"},       {"tag25h9"},          {"tag16h5"},
                {"tag36h10"},       {"tagStandard41h12"}, {"tagStandard52h13"},
                {"tagCustom48h12"}, {"tagCircle21h7"},    {"tagCircle49h12"}};
enum { FAMILIES = sizeof families / sizeof *families };

// Versions of AprilTag put corners up to an eighth of a pixel apart (3.4.3 moved them): a fit that
// starts there ends where the others do.
static void check_fit_from(double found[4][2], double expected[4][2], const struct radiance *map)
{
    static const double eighths[5][2] = {{0, 0}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
    struct tag_fit fit[5];
    for (int n = 0; n < 5; n++) {
        double start[4][2];
        for (int k = 0; k < 4; k++)
            for (int i = 0; i < 2; i++)
                start[k][i] = found[k][i] + eighths[n][i] / 8;
        assert_true(corners_fit(fit + n, &pattern, &camera, map, start));
        for (int k = 0; k < 4; k++)
            for (int i = 0; i < 2; i++) {
                assert_near(fit[n].corner[k][i], fit[0].corner[k][i], 2e-3);
                assert_near(fit[n].corner[k][i], expected[k][i], 0.04);
            }
    }
}

// AprilTag's corners are good to some 0.2 px; the wrong convention would move all by (0.5, 0.5), a
// wrong order or direction by tens.
static void test_detection(void **state)
{
    const char *family = *state;
    struct radiance map;
    struct detector detector = {0};
    struct tag_place tag = place;
    struct capture capture = {.tag = &tag, .tags = 1};
    struct detection *found = NULL;
    double expected[4][2], mean[2] = {0};
    int count;
    load_pattern(family);
    render(&map, 0.4, 0.003);
    truth(expected);
    assert_int_equal(detector_begin(&detector, family, NULL), STATUS_OK);
    assert_int_equal(detector_find(&detector, &capture, &map, &found, &count, NULL), STATUS_OK);
    assert_int_equal(count, 1);
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 2; i++) {
            assert_near(found[0].corner[k][i], expected[k][i], 0.6);
            mean[i] += (found[0].corner[k][i] - expected[k][i]) / 4;
        }
    assert_near(mean[0], 0, 0.2);
    assert_near(mean[1], 0, 0.2);
    check_fit_from(found[0].corner, expected, &map);
    free(found);
    tag.id = 4;  // a tag that capture.yaml does not name is not kept
    assert_int_equal(detector_find(&detector, &capture, &map, &found, &count, NULL), STATUS_OK);
    assert_int_equal(count, 0);
    free(found);
    capture = (struct capture){.tag_size = 24};  // but all are, where it names a size instead
    assert_int_equal(detector_find(&detector, &capture, &map, &found, &count, NULL), STATUS_OK);
    assert_int_equal(count, 1);
    assert_int_equal(found[0].id, place.id);
    free(found);
    detector_end(&detector);
    free_map(&map);
}

// ---- the fit

static struct fit_row {
    const char *name, *family;
    double sigma_px, deviation, tolerance;
} fits[] = {
    {"a perfect lens: photosites alone blur", "tag36h11", 0, 1e-4, 0.01},
    {"a good lens", "tag36h11", 0.4, 0.003, 0.02},
    {"out of focus", "tag36h11", 1.0, 0.003, 0.03},
    {"noise of 3 % a channel", "tag36h11", 0.4, 0.03, 0.05},
    {"another family", "tag25h9", 0.4, 0.003, 0.02},
    {"white frame inside black", "tagStandard41h12", 0.4, 0.003, 0.03},
    {"round, with unknown corners", "tagCircle21h7", 0.4, 0.003, 0.03},
};
enum { FITS = sizeof fits / sizeof *fits };

static void test_fit(void **state)
{
    const struct fit_row *row = *state;
    struct radiance map;
    struct tag_fit fit;
    double expected[4][2], start[4][2];
    load_pattern(row->family);
    render(&map, row->sigma_px, row->deviation);
    truth(expected);
    const double off[4][2] = {{0.4, -0.3}, {-0.5, 0.2}, {0.1, 0.5}, {0.3, 0.3}};
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 2; i++)
            start[k][i] = expected[k][i] + off[k][i];
    assert_true(corners_fit(&fit, &pattern, &camera, &map, start));
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 2; i++)
            assert_near(fit.corner[k][i], expected[k][i], row->tolerance);
    // A square photosite alone has a variance of 1/12 px^2; it adds to that of the lens.
    assert_near(fit.blur, 1.0 / 12 + row->sigma_px * row->sigma_px, 0.02 + 0.05 * fit.blur);
    for (int i = 0; i < 8; i++)
        assert_true(fit.covariance[i][i] > 0 && sqrt(fit.covariance[i][i]) < row->tolerance);
    free_map(&map);
}

// A mosaic's photosites measure one channel each, at gains of their own: the same image, and the
// same corners. The unmeasured channels hold nonsense that nobody may read.
static void test_a_mosaic(void **state)
{
    (void)state;
    static const float gain[3] = {0.55f, 1, 0.7f};
    struct radiance map;
    struct tag_fit whole, mosaic;
    double expected[4][2];
    load_pattern("tag36h11");
    render(&map, 0.4, 0.003);
    truth(expected);
    assert_true(corners_fit(&whole, &pattern, &camera, &map, expected));
    strcpy(map.cfa, "GBRG");
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            for (int c = 0; c < 3; c++) {
                int at = 3 * (y * WIDTH + x) + c, own = cap_radiance_channel(&map, x, y);
                map.value[at] = c == own ? map.value[at] * gain[c] : 7;
                map.variance[at] *= gain[c] * gain[c];
            }
    assert_true(corners_fit(&mosaic, &pattern, &camera, &map, expected));
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 2; i++) {
            assert_near(mosaic.corner[k][i], expected[k][i], 0.025);
            // a third of the photosites' noise less averaging: sqrt(3) of the whole image's sigma
            double sigma = sqrt(mosaic.covariance[2 * k + i][2 * k + i]);
            assert_true(sigma < 3 * sqrt(whole.covariance[2 * k + i][2 * k + i]));
        }
    assert_near(mosaic.blur, whole.blur, 0.02);
    free_map(&map);
}

// A fit through a lens that is a little wrong, brought to the right one by its derivative, is the
// fit through the right one.
static void test_corners_follow_the_lens(void **state)
{
    (void)state;
    static const double off[LENS_PARAMETERS] = {8, -8, 2, 2, 0.02, 0.2, 2e-3, -2e-3, 3};
    struct radiance map;
    struct tag_fit right, wrong;
    double start[4][2], true_lens[LENS_PARAMETERS], lens[LENS_PARAMETERS];
    load_pattern("tag36h11");
    render(&map, 0.4, 1e-4);
    truth(start);
    assert_true(corners_fit(&right, &pattern, &camera, &map, start));
    lens_to_array(true_lens, &camera);
    for (int p = 0; p < LENS_PARAMETERS; p++) {
        struct camera bent = camera;
        double furthest = 0;
        memcpy(lens, true_lens, sizeof lens);
        lens[p] += off[p];
        lens_from_array(&bent, lens);
        assert_true(corners_fit(&wrong, &pattern, &bent, &map, start));
        for (int i = 0; i < 8; i++) {
            double moved = wrong.corner[i / 2][i % 2] - right.corner[i / 2][i % 2];
            furthest = fmax(furthest, fabs(moved));
            assert_near(moved - wrong.by_lens[i][p] * off[p], 0, 3e-4 + 0.1 * fabs(moved));
        }
        assert_true(furthest > 4e-3);
    }
    free_map(&map);
}

// ---- what must be refused

static void test_refusals(void **state)
{
    (void)state;
    struct radiance map;
    struct tag_fit fit;
    double start[4][2], away[4][2];
    load_pattern("tag36h11");
    render(&map, 0.4, 0.003);
    truth(start);
    assert_false(corners_fit(&fit, &other_pattern, &camera, &map, start));
    for (int k = 0; k < 4; k++) {  // half outside the image
        away[k][0] = start[k][0] - start[0][0];
        away[k][1] = start[k][1];
    }
    assert_false(corners_fit(&fit, &pattern, &camera, &map, away));
    double middle = 0.25 * (start[0][0] + start[1][0] + start[2][0] + start[3][0]);
    for (int y = 0; y < HEIGHT; y++)  // the left half lies in shadow
        for (int x = 0; x < (int)middle; x++)
            for (int c = 0; c < 3; c++)
                map.value[3 * (y * WIDTH + x) + c] *= 0.2f;
    assert_false(corners_fit(&fit, &pattern, &camera, &map, start));
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)  // all saturated
        map.variance[i] = INFINITY;
    assert_false(corners_fit(&fit, &pattern, &camera, &map, start));
    free_map(&map);
}

static void test_a_small_thing_on_the_tag_does_not_move_it(void **state)
{
    (void)state;
    struct radiance map;
    struct tag_fit fit;
    double expected[4][2];
    load_pattern("tag36h11");
    render(&map, 0.4, 0.003);
    truth(expected);
    int x0 = (int)expected[3][0], y0 = (int)expected[3][1];  // a blot of 4 x 4 px near a corner
    for (int y = y0 + 3; y < y0 + 7; y++)
        for (int x = x0 + 3; x < x0 + 7; x++)
            for (int c = 0; c < 3; c++)
                map.value[3 * (y * WIDTH + x) + c] = 0.5f;
    assert_true(corners_fit(&fit, &pattern, &camera, &map, expected));
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 2; i++)
            assert_near(fit.corner[k][i], expected[k][i], 0.03);
    free_map(&map);
}

static void test_unknown_families_and_tags_are_named(void **state)
{
    (void)state;
    struct tag_family family = {0};
    struct error err = {0};
    assert_int_equal(pattern_open(&family, "tag99h1", &err), STATUS_DATA);
    assert_non_null(strstr(err.text, "'tag99h1'"));
    assert_non_null(strstr(err.text, "tag36h11"));
    assert_int_equal(pattern_open(&family, "tag16h5", NULL), STATUS_OK);
    assert_int_equal(pattern_of(&pattern, &family, 30, &err), STATUS_DATA);  // 30 tags: 0 to 29
    assert_non_null(strstr(err.text, "no tag 30"));
    pattern_close(&family);
}

int main(void)
{
    const struct CMUnitTest others[] = {
        cmocka_unit_test(test_a_mosaic),
        cmocka_unit_test(test_corners_follow_the_lens),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_a_small_thing_on_the_tag_does_not_move_it),
        cmocka_unit_test(test_unknown_families_and_tags_are_named),
    };
    enum { OTHERS = sizeof others / sizeof *others };
    struct CMUnitTest tests[FAMILIES + FITS + OTHERS];
    for (int i = 0; i < FAMILIES; i++)
        tests[i] = (struct CMUnitTest){families[i].family, test_detection, NULL, NULL,
                                       (void *)(uintptr_t)families[i].family};
    for (int i = 0; i < FITS; i++)
        tests[FAMILIES + i] = (struct CMUnitTest){fits[i].name, test_fit, NULL, NULL, &fits[i]};
    memcpy(tests + FAMILIES + FITS, others, sizeof others);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
