/* test_predict.c -- the picture predicted of a scene is the one that its closed form makes. */
#include "ball_scene.h"
#include "predict.h"

#include <string.h>

static const double plastic[] = {0.2, 0.3, 0.4, 0.4, 1.5};

static struct prediction predict(struct scene *s, const struct radiance *map, int size)
{
    struct brdf brdf = {.model = s->model};
    struct prediction p;
    memcpy(brdf.value, s->value, sizeof brdf.value);
    const struct prediction_of of = {.calibration = &s->calibration, .brdf = &brdf, .map = map};
    assert_int_equal(rec_predict(&p, &of, size, NULL), STATUS_OK);
    return p;
}

// The ratio is 1, but for the bend of f over a photosite; at the terminator, where less than 0.01
// of some 0.15 is predicted, photosites are half lit. The picture covers the lit part of the ball.
// Returns how many pixels were compared.
static int compare(const struct prediction *p, double tolerance)
{
    int compared = 0;
    for (int y = 0; y < p->height; y++)
        for (int x = 0; x < p->width; x++) {
            float ratio = rec_prediction_ratio(p, x, y, 1, 10);
            if (!(ratio > 0))
                continue;
            assert_near(ratio, 1, tolerance);
            compared++;
        }
    return compared;
}

static void test_ratio_is_one(void **state)
{
    (void)state;
    struct scene *s = make_scene("ggx", plastic);
    shoot(s);
    struct prediction p = predict(s, &s->map, 1000);
    assert_int_equal(p.step, 1);
    double radius = 25 * 605 / sqrt(400.0 * 400 - 625), disc = CAP_PI * radius * radius;
    int compared = compare(&p, 0.01);
    assert_true(compared > 0.4 * disc && compared < disc);
    rec_prediction_free(&p);
    free_scene(s);
}

// Blocks of 4 x 4 hold the means of the same photosites on both sides.
static void test_smaller_pictures(void **state)
{
    (void)state;
    struct scene *s = make_scene("ggx", plastic);
    shoot(s);
    struct prediction p = predict(s, &s->map, 25);
    assert_true(p.step >= 3 && p.width <= 25 && p.height <= 25);
    assert_true(compare(&p, 0.01) > 100);
    rec_prediction_free(&p);
    free_scene(s);
}

// What is wrong shows in its place: a spot twice as bright, and one that saturated.
static void test_a_wrong_place_shows(void **state)
{
    (void)state;
    struct scene *s = make_scene("ggx", plastic);
    shoot(s);
    size_t spot = 3 * (size_t)(40 * WIDTH + 45);
    for (size_t c = 0; c < 3; c++) {
        s->map.value[spot + c] *= 2;
        s->map.variance[spot + 3 + c] = INFINITY;
    }
    struct prediction p = predict(s, &s->map, 1000);
    assert_near(rec_prediction_ratio(&p, 45 - p.x0, 40 - p.y0, 1, 0.5F), 2, 0.02);
    assert_true(isnan(rec_prediction_ratio(&p, 46 - p.x0, 40 - p.y0, 1, 0.5F)));
    assert_true(isnan(rec_prediction_ratio(&p, 0, 0, 1, 0.5F)));  // beside the ball
    rec_prediction_free(&p);
    free_scene(s);
}

// A mosaic's channels are compared where they were measured.
static void test_mosaics(void **state)
{
    (void)state;
    struct scene *s = make_scene("ggx", plastic);
    shoot(s);
    strcpy(s->map.cfa, "RGGB");
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        for (int c = 0; c < 3; c++)
            if (c != cap_radiance_channel(&s->map, i % WIDTH, i / WIDTH)) {
                s->map.value[3 * i + c] = 17;  // nobody may look
                s->map.variance[3 * i + c] = INFINITY;
            }
    struct prediction p = predict(s, &s->map, 1000);
    assert_int_equal(p.step, 2);
    assert_true(compare(&p, 0.01) > 200);
    rec_prediction_free(&p);
    free_scene(s);
}

static void test_another_cameras_map(void **state)
{
    (void)state;
    struct scene *s = make_scene("ggx", plastic);
    struct radiance map = {.width = WIDTH, .height = HEIGHT - 1};
    struct brdf brdf = {.model = s->model};
    const struct prediction_of of = {.calibration = &s->calibration, .brdf = &brdf, .map = &map};
    struct prediction p;
    struct error err;
    assert_int_equal(rec_predict(&p, &of, 100, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "120 x 89"));
    free_scene(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ratio_is_one),        cmocka_unit_test(test_smaller_pictures),
        cmocka_unit_test(test_a_wrong_place_shows), cmocka_unit_test(test_mosaics),
        cmocka_unit_test(test_another_cameras_map),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
