/* test_solid.c -- where rays meet samples, what samples hide, how they move. */
#include "solid.h"

#include "near.h"

static const struct sample ball = {.shape = SHAPE_SPHERE, .radius = 20, .center = {1, 2, 40}};
static const struct sample rod = {
    .shape = SHAPE_CYLINDER, .radius = 10, .height = 60, .center = {0, 0, 30}, .axis = {1, 0, 0}};

static void test_a_sphere_is_met_in_front(void **state)
{
    (void)state;
    solid_hit hit = cal_solid_meet(&ball, (vec3){1, 2, 140}, (vec3){0, 0, -1});
    assert_near(hit.s, 80, 1e-12);
    assert_near(vec3_length(vec3_sub(hit.normal, (vec3){0, 0, 1})), 0, 1e-12);
    assert_true(cal_solid_meet(&ball, (vec3){22, 2, 140}, (vec3){0, 0, -1}).s == INFINITY);
    assert_true(cal_solid_meet(&ball, (vec3){1, 2, 140}, (vec3){0, 0, 1}).s == INFINITY);
}

static void test_a_cylinder_has_a_side_and_caps(void **state)
{
    (void)state;
    solid_hit side = cal_solid_meet(&rod, (vec3){29, 6, 130}, (vec3){0, 0, -1});
    assert_near(side.s, 130 - 38, 1e-12);  // 6 8 10: the side is 8 above the axis there
    assert_near(vec3_length(vec3_sub(side.normal, (vec3){0, 0.6, 0.8})), 0, 1e-12);
    assert_false(side.cap);
    solid_hit cap = cal_solid_meet(&rod, (vec3){100, 3, 33}, (vec3){-1, 0, 0});
    assert_near(cap.s, 70, 1e-12);
    assert_true(cap.cap);
    assert_near(cap.normal.x, 1, 1e-12);
    assert_true(cal_solid_meet(&rod, (vec3){31, 0, 130}, (vec3){0, 0, -1}).s == INFINITY);
    assert_true(cal_solid_meet(&rod, (vec3){100, 8, 37}, (vec3){-1, 0, 0}).s == INFINITY);
}

// A cylinder hides what is behind it, and nothing beside its ends: it is no ball.
static void test_what_a_cylinder_hides(void **state)
{
    (void)state;
    assert_true(cal_sample_between(&rod, (vec3){0, 0, 200}, (vec3){0, 0, 0}, 0));
    assert_false(cal_sample_between(&rod, (vec3){0, 15, 200}, (vec3){0, 15, 0}, 0));
    assert_true(cal_sample_between(&rod, (vec3){0, 15, 200}, (vec3){0, 15, 0}, 6));
    assert_false(cal_sample_between(&rod, (vec3){0, 15, 200}, (vec3){0, 15, 0}, 4));
    // From its own side upwards: nothing between.
    assert_false(cal_sample_between(&rod, (vec3){5, 0, 40}, (vec3){50, 0, 500}, 0));
}

static void test_points_are_on_the_surface(void **state)
{
    (void)state;
    double area = 0;
    vec3 sum = {0, 0, 0};
    for (int k = 0; k < SOLID_POINTS; k++) {
        vec3 point, normal;
        double own;
        cal_solid_point(&rod, k, &point, &normal, &own);
        assert_near(hypot(point.y, point.z - 30), 10, 1e-12);
        assert_near(normal.x, 0, 1e-12);
        assert_true(fabs(point.x) < 30);
        area += own;
        sum = vec3_add(sum, normal);
    }
    assert_near(area, 2 * CAP_PI * 10 * 60, 1e-9);
    assert_true(vec3_length(sum) / SOLID_POINTS < 0.01);
}

static void test_a_quarter_turn_and_a_shift(void **state)
{
    (void)state;
    struct sample s = rod;
    assert_int_equal(cal_solid_move(&s, (vec3){0, 0, CAP_PI / 2}, (vec3){1, 2, 3}, NULL),
                     STATUS_OK);
    assert_near(vec3_length(vec3_sub(s.axis, (vec3){0, 1, 0})), 0, 1e-12);
    assert_near(vec3_length(vec3_sub(s.center, (vec3){1, 2, 33})), 0, 1e-12);
}

static void test_rotation_vectors_and_back(void **state)
{
    (void)state;
    for (int k = 0; k < 200; k++) {
        vec3 v = {sin(3.1 * k), sin(7.7 * k + 1), sin(1.3 * k + 2)};
        v = vec3_scale(vec3_normalize(v), k * 0.0157);  // up to just below pi
        mat3 r = cal_rotation(v);
        assert_near(vec3_length(vec3_sub(cal_rotation_vector(&r), v)), 0, 1e-9);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_sphere_is_met_in_front),
        cmocka_unit_test(test_a_cylinder_has_a_side_and_caps),
        cmocka_unit_test(test_what_a_cylinder_hides),
        cmocka_unit_test(test_points_are_on_the_surface),
        cmocka_unit_test(test_a_quarter_turn_and_a_shift),
        cmocka_unit_test(test_rotation_vectors_and_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
