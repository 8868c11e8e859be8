/* test_photometry.c -- what facets of the board show: their own material, however soft the lens. */
#include "photometry.h"
#include "near.h"

#include <stdlib.h>

enum { SIDE = 160 };
static const double HALF_MM = 20, DISTANCE = 500, FOCAL = 1000;

static const struct patch white = {1, {{-20, -20, 0}, {20, -20, 0}, {20, 20, 0}, {-20, 20, 0}}};

/** What part of a photosite at x is within `half` of the middle, through a lens of that blur. */
static double within(double x, double half, double blur_px)
{
    double s = sqrt(2 * (blur_px * blur_px + 1.0 / 12));
    return 0.5 * (erf((x + half) / s) - erf((x - half) / s));
}

/** A white square of radiance 1 on a ground of 0.1, from straight above. */
static struct radiance map_of(double blur_px)
{
    struct radiance map = {.width = SIDE, .height = SIDE, .channels = 3};
    map.value = malloc(3 * SIDE * SIDE * sizeof *map.value);
    map.variance = malloc(3 * SIDE * SIDE * sizeof *map.variance);
    assert_true(map.value && map.variance);
    const double half = HALF_MM * FOCAL / DISTANCE, middle = 0.5 * (SIDE - 1);
    for (int i = 0; i < 3 * SIDE * SIDE; i++) {
        int y = i / 3 / SIDE;
        double x = i / 3 % SIDE - middle;
        double part = within(x, half, blur_px) * within(y - middle, half, blur_px);
        map.value[i] = (float)(0.1 + 0.9 * part);
        map.variance[i] = 1e-8F;
    }
    return map;
}

static void test_a_patch_is_white_to_its_last_facet(void **state)
{
    (void)state;
    static const double blurs[] = {0, 0.4, 0.8, 1.2};
    const double middle = 0.5 * (SIDE - 1);
    struct camera camera = {
        .width = SIDE, .height = SIDE, .focal = {FOCAL, FOCAL}, .center = {middle, middle}};
    struct view view = {.view_from_world = {{CAP_PI, 0, 0}, {0, 0, DISTANCE}},
                        .power = 1};  // y down, z away
    struct calibration c = {.camera = &camera, .view = &view, .cameras = 1, .views = 1};
    struct patch patch = white;
    const struct capture capture = {.patch = &patch, .patches = 1};
    const struct tag_family none = {0};
    for (size_t b = 0; b < sizeof blurs / sizeof *blurs; b++) {
        struct radiance map = map_of(blurs[b]);
        struct facets facets = {0};
        view.blur_px = blurs[b];
        assert_int_equal(cal_board_facets(&facets, &map, &c, 0, &capture, &none, NULL), STATUS_OK);
        assert_int_equal(facets.count, 16);
        for (int i = 0; i < facets.count; i++)
            assert_near(facets.facet[i].mean[1], 1, 5e-4);
        free(facets.facet);
        cap_radiance_free(&map);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_patch_is_white_to_its_last_facet),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
