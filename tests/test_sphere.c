/* test_sphere.c -- a sphere's centre and radius from edges and from painted outlines. */
#include "sphere.h"

#include "near.h"
#include "ring.h"

#include <stdlib.h>
#include <string.h>

static const vec3 CENTER = {1.5, -2, 40};
static const double RADIUS = 20;

/** Edges where the outline is, with an error of `noise` pixels in turns. */
static int true_edges(struct edge *edge, const struct calibration *c, int each, double noise)
{
    int n = 0;
    for (int v = 0; v < c->views; v++) {
        mat3 r = cal_rotation(c->view[v].view_from_world.rotation);
        struct cone cone = cal_outline_cone(cal_eye(c->view[v].view_from_world), CENTER, RADIUS);
        for (int k = 0; k < each; k++, n++) {
            double off = noise * sin(7.3 * n) / c->camera->focal[0];
            vec3 ray = cal_cone_ray(&cone, cone.half_angle + off, 2 * CAP_PI * k / each);
            edge[n] = (struct edge){.view = v, .sigma_px = 0.05};
            assert_true(cal_direction_pixel(c->camera, &r, ray, edge[n].pixel));
        }
    }
    return n;
}

static void test_exact_edges_give_the_exact_sphere(void **state)
{
    (void)state;
    struct calibration c;
    struct camera camera;
    struct view view[VIEWS];
    struct edge edge[VIEWS * 40];
    make_views(&c, &camera, view);
    int count = true_edges(edge, &c, 40, 0);
    struct sample s = {
        .shape = SHAPE_SPHERE, .center = {0, 0, 38}, .radius = 20.1, .sigma_radius = 1e3};
    assert_int_equal(cal_sphere_fit(&s, &c, edge, count, NULL), STATUS_OK);
    assert_near(vec3_length(vec3_sub(s.center, CENTER)), 0, 1e-7);
    assert_near(s.radius, RADIUS, 1e-6);
    assert_int_equal(s.outline_edges, count);
}

static void test_wild_edges_are_left_out(void **state)
{
    (void)state;
    struct calibration c;
    struct camera camera;
    struct view view[VIEWS];
    struct edge edge[VIEWS * 40];
    make_views(&c, &camera, view);
    int count = true_edges(edge, &c, 40, 0.05);
    for (int i = 0; i < count; i += 5)  // a fifth of them: a shadow's edge, say
        edge[i].pixel[0] += 6;
    struct sample s = {
        .shape = SHAPE_SPHERE, .center = {0, 0, 38}, .radius = 20.1, .sigma_radius = 0.1};
    assert_int_equal(cal_sphere_fit(&s, &c, edge, count, NULL), STATUS_OK);
    // 190 edges of 0.035 px rms, 0.5 mm a pixel
    assert_near(vec3_length(vec3_sub(s.center, CENTER)), 0, 0.01);
    // those moved along the outline are still on it: about a third of the fifth
    assert_true(s.outline_edges <= count - count / 8);
}

static void test_too_few_edges_are_refused(void **state)
{
    (void)state;
    struct calibration c;
    struct camera camera;
    struct view view[VIEWS];
    make_views(&c, &camera, view);
    struct edge edge = {.view = 0};
    struct sample s = {.shape = SHAPE_SPHERE, .radius = 20};
    struct error err;
    assert_int_equal(cal_sphere_fit(&s, &c, &edge, 1, &err), STATUS_DATA);
    assert_non_null(strstr(err.text, "edges"));
}

/** Radiance at a pixel: a matte ball lit from the eye (cos_o, which falls as the square root of
 *  the depth inside its outline) before `ground`; the mean over 8 x 8 points. */
static float paint(const struct cone *cone, const struct camera *camera, const mat3 *r, int x,
                   int y, double ground)
{
    double sum = 0;
    for (int k = 0; k < 64; k++) {
        double pixel[2] = {x + (k % 8 - 3.5) / 8, y + (k / 8 - 3.5) / 8};  // NOLINT: whole rows
        vec3 ray = mat3_mul_t(r, cal_ray(camera, pixel));
        double sine = sin(acos(fmin(vec3_dot(ray, cone->axis), 1))) / sin(cone->half_angle);
        sum += sine < 1 ? sqrt(1 - sine * sine) + 0.1 : ground;
    }
    return (float)(sum / 64);
}

static void painted_edges(double ground)
{
    struct calibration c;
    struct camera camera;
    struct view view[VIEWS];
    make_views(&c, &camera, view);
    mat3 r = cal_rotation(view[1].view_from_world.rotation);
    struct cone cone = cal_outline_cone(cal_eye(view[1].view_from_world), CENTER, RADIUS);
    struct radiance map = {.width = 400, .height = 300};
    map.value = calloc(3 * 400 * 300, sizeof *map.value);
    map.variance = calloc(3 * 400 * 300, sizeof *map.variance);
    for (int i = 0; i < 400 * 300; i++)
        for (int k = 0; k < 3; k++) {
            map.value[3 * i + k] = paint(&cone, &camera, &r, i % 400, i / 400, ground);
            map.variance[3 * i + k] = 1e-6F;
        }
    struct edge *edge = NULL;
    int count = 0;
    vec3 guess = vec3_add(CENTER, (vec3){0.3, 0.2, -0.2});  // most of a pixel away
    assert_int_equal(cal_outline_edges(&edge, &count, &map, &camera, &view[1], 1, guess, RADIUS,
                                       2.5, true, NULL),
                     STATUS_OK);
    assert_true(count > 20);
    double sum = 0;
    for (int i = 0; i < count; i++) {
        vec3 ray = mat3_mul_t(&r, cal_ray(&camera, edge[i].pixel));
        sum += (acos(vec3_dot(ray, cone.axis)) - cone.half_angle) * 1200;
        assert_near((acos(vec3_dot(ray, cone.axis)) - cone.half_angle) * 1200, 0, 0.15);
    }
    assert_near(sum / count, 0, 0.03);  // no bias beyond a thirtieth of a pixel
    free(edge);
    cap_radiance_free(&map);
}

static void test_bright_limb_before_dark_ground(void **state)
{
    (void)state;
    painted_edges(0);
}

static void test_limb_before_bright_ground(void **state)
{
    (void)state;
    painted_edges(1.5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact_edges_give_the_exact_sphere),
        cmocka_unit_test(test_wild_edges_are_left_out),
        cmocka_unit_test(test_too_few_edges_are_refused),
        cmocka_unit_test(test_bright_limb_before_dark_ground),
        cmocka_unit_test(test_limb_before_bright_ground),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
