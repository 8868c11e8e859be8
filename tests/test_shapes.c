/* Rays against shapes, by numbers that a reader can check on paper. */
#include "near.h"
#include "shapes.h"

static const vec3 X
= {1, 0, 0}, Y = {0, 1, 0}, Z = {0, 0, 1};

static void assert_vec3(vec3 actual, vec3 expected, double tolerance)
{
    assert_near(actual.x, expected.x, tolerance);
    assert_near(actual.y, expected.y, tolerance);
    assert_near(actual.z, expected.z, tolerance);
}

// At x = 3 from the centre, a sphere of radius 5 is 4 high: the 3-4-5 triangle.
static void test_sphere_is_met_where_pythagoras_says(void **state)
{
    (void)state;
    struct crossing c =
        sam_cross_sphere((struct ray){{3, 0, 100}, {0, 0, -1}}, (vec3){0, 0, 0}, 5, 0);
    assert_near(c.s, 96, 1e-12);
    assert_vec3(c.normal, (vec3){0.6, 0, 0.8}, 1e-15);
}

static void test_sphere_from_inside_shows_its_far_wall(void **state)
{
    (void)state;
    struct crossing c = sam_cross_sphere((struct ray) { {0, 0, 0}, X }, (vec3){1, 0, 0}, 5, 0);
    assert_near(c.s, 6, 1e-12);
}

static void test_sphere_beside_or_behind_is_missed(void **state)
{
    (void)state;
    assert_true(sam_cross_sphere((struct ray){{6, 0, 9}, {0, 0, -1}}, (vec3){0, 0, 0}, 5, 0).s
                == INFINITY);
    assert_true(sam_cross_sphere((struct ray){{0, 0, 9}, Z}, (vec3){0, 0, 0}, 5, 0).s == INFINITY);
}

// A point of the surface, as rounding leaves it, does not shadow itself from any side.
static void test_sphere_does_not_meet_itself(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++) {
        double a = i * 0.37, z = -1 + 2 * (i + 0.5) / 1000, r = sqrt(1 - z * z);
        vec3 n = {r * cos(a), r * sin(a), z}, t, b;
        sam_frame(n, &t, &b);
        vec3 center = {12.3, -45.6, 78.9}, p = vec3_add(center, vec3_scale(n, 25));
        vec3 grazing = vec3_normalize(vec3_add(vec3_scale(n, 1e-6), t));
        assert_true(sam_cross_sphere((struct ray){p, grazing}, center, 25, 1e-7).s == INFINITY);
    }
}

// Seen from ten metres, the limb and the middle are as sharp as from near.
static void test_sphere_keeps_its_digits_from_afar(void **state)
{
    (void)state;
    struct crossing c =
        sam_cross_sphere((struct ray){{4.999, 0, 1e4}, {0, 0, -1}}, (vec3){0, 0, 0}, 5, 0);
    assert_near(1e4 - c.s, sqrt(25 - 4.999 * 4.999), 1e-11);
}

static void test_rod_side_and_caps(void **state)
{
    (void)state;
    struct rod rod = {.center = {0, 0, 10}, .axis = Z, .radius = 5, .half = 10};
    struct crossing side = sam_cross_rod((struct ray) { {-20, 3, 5}, X }, &rod, 0);
    assert_near(side.s, 16, 1e-12);
    assert_int_equal(side.face, 0);
    assert_vec3(side.normal, (vec3){-0.8, 0.6, 0}, 1e-15);
    struct crossing top = sam_cross_rod((struct ray){{1, 1, 50}, {0, 0, -1}}, &rod, 0);
    assert_near(top.s, 30, 1e-12);
    assert_int_equal(top.face, 2);
    assert_vec3(top.normal, Z, 0);
    struct crossing slanted =
        sam_cross_rod((struct ray){{-9, 0, 24}, vec3_normalize((vec3){1, 0, -1})}, &rod, 0);
    assert_near(slanted.s, 4 * sqrt(2), 1e-12);  // the cap at (-5, 0, 20), its very rim
    assert_true(sam_cross_rod((struct ray) { {-20, 0, 20.5}, X }, &rod, 0).s == INFINITY);
    assert_true(sam_cross_rod((struct ray){{6, 0, 50}, {0, 0, -1}}, &rod, 0).s == INFINITY);
}

static void test_box_faces(void **state)
{
    (void)state;
    double c = cos(0.3), s = sin(0.3);
    struct box box = {.center = {10, 0, 0}, .axis = {{c, s, 0}, {-s, c, 0}, Z}, .half = {2, 3, 4}};
    struct crossing hit =
        sam_cross_box((struct ray){{10 + 20 * c, 20 * s, 1}, {-c, -s, 0}}, &box, 0);
    assert_near(hit.s, 18, 1e-12);
    assert_int_equal(hit.face, 1);
    assert_vec3(hit.normal, (vec3){c, s, 0}, 1e-15);
    struct crossing from_inside = sam_cross_box((struct ray){{10, 0, 0}, Z}, &box, 0);
    assert_near(from_inside.s, 4, 1e-12);
    assert_true(sam_cross_box((struct ray) { {10, 0, 5}, X }, &box, 0).s == INFINITY);
}

static void test_plane_ahead_and_behind(void **state)
{
    (void)state;
    struct ray slanted = {{0, 0, 3}, {0.8, 0, -0.6}};
    assert_near(sam_cross_plane(slanted, (vec3){7, 7, 0}, Z, 0), 5, 1e-12);
    assert_true(sam_cross_plane((struct ray){{0, 0, 3}, Z}, (vec3){0, 0, 0}, Z, 0) == INFINITY);
    assert_true(sam_cross_plane((struct ray){{0, 0, 3}, Y}, (vec3){0, 0, 0}, Z, 0) == INFINITY);
}

static void test_frames_are_right_handed(void **state)
{
    (void)state;
    for (int i = 0; i < 200; i++) {
        double a = i * 0.61, z = -1 + 2 * (i / 199.0), r = sqrt(fmax(0, 1 - z * z));
        vec3 n = {r * cos(a), r * sin(a), z}, x, y;
        sam_frame(n, &x, &y);
        assert_vec3(vec3_cross(x, y), n, 1e-14);
        assert_near(vec3_dot(x, x), 1, 1e-14);
        assert_near(vec3_dot(y, y), 1, 1e-14);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sphere_is_met_where_pythagoras_says),
        cmocka_unit_test(test_sphere_from_inside_shows_its_far_wall),
        cmocka_unit_test(test_sphere_beside_or_behind_is_missed),
        cmocka_unit_test(test_sphere_does_not_meet_itself),
        cmocka_unit_test(test_sphere_keeps_its_digits_from_afar),
        cmocka_unit_test(test_rod_side_and_caps),
        cmocka_unit_test(test_box_faces),
        cmocka_unit_test(test_plane_ahead_and_behind),
        cmocka_unit_test(test_frames_are_right_handed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
