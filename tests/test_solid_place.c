/* test_solid_place.c -- outlines of cylinders in closed form, and cylinders placed by outlines. */
#include "solid_place.h"

#include "near.h"
#include "ring.h"

#include <stdlib.h>
#include <string.h>

static const struct sample rod = {.shape = SHAPE_CYLINDER,
                                  .radius = 15,
                                  .height = 60,
                                  .center = {1.5, -2, 40},
                                  .axis = {0.98, 0.15, 0.130766968306220}};

// A tangent plane through the eye holds the outline of the side: its distance from the axis is R.
static void test_the_side_touches_its_outline(void **state)
{
    (void)state;
    struct calibration c;
    struct camera camera;
    struct view view[VIEWS];
    int sides = 0;
    make_views(&c, &camera, view);
    for (int v = 0; v < VIEWS; v++) {
        struct contour_point *p;
        int count;
        vec3 eye = cal_eye(view[v].view_from_world), axis = vec3_normalize(rod.axis);
        assert_int_equal(cal_contour(&p, &count, &rod, &camera, &view[v], NULL), STATUS_OK);
        assert_true(count > 20);
        for (int i = 0; i < count; i++) {
            vec3 to = vec3_sub(rod.center, eye);
            assert_near(vec3_length(p[i].across), 1, 1e-9);
            if (fabs(vec3_dot(p[i].across, axis)) > 1e-3)
                continue;  // the rim of a cap
            sides++;
            assert_near(fabs(vec3_dot(to, p[i].across)), rod.radius, 0.02);
        }
        free(p);
    }
    assert_true(sides > 100);
}

/** How far outwards of `pixel` the true solid ends, along `normal`. */
static double true_off(const struct sample *truth, const struct calibration *c, int v,
                       const struct contour_point *at)
{
    const struct view *view = &c->view[v];
    mat3 r = cal_rotation(view->view_from_world.rotation);
    double low = -60, high = 60;
    for (int k = 0; k < 40; k++) {
        double off = 0.5 * (low + high);
        double pixel[2] = {at->pixel[0] + off * at->normal[0], at->pixel[1] + off * at->normal[1]};
        vec3 ray = mat3_mul_t(&r, cal_ray(c->camera, pixel));
        bool sees = cal_solid_meet(truth, cal_eye(view->view_from_world), ray).s < INFINITY;
        *(sees ? &low : &high) = off;
    }
    return 0.5 * (low + high);
}

/** The edges that photographs of `truth` would show, seen from where *guess has them. */
static struct contour_edge *edges_of(const struct sample *truth, const struct sample *guess,
                                     const struct calibration *c, int *count, double wild)
{
    struct contour_edge *edge = NULL;
    *count = 0;
    for (int v = 0; v < VIEWS; v++) {
        struct contour_point *p;
        int points;
        assert_int_equal(cal_contour(&p, &points, guess, c->camera, &c->view[v], NULL), STATUS_OK);
        edge = realloc(edge, (size_t)(*count + points) * sizeof *edge);
        assert_non_null(edge);
        for (int i = 0; i < points; i++)
            edge[(*count)++] = (struct contour_edge){
                p[i], v, true_off(truth, c, v, &p[i]) + (i % 6 == 0 ? wild : 0), 0.05};
        free(p);
    }
    return edge;
}

static void place(struct sample *s, double wild, bool free_radius)
{
    struct calibration c;
    struct camera camera;
    struct view view[VIEWS];
    struct solid_prior prior = {
        .radius = s->radius, .radius_sigma = 0.005 * s->radius, .free_radius = free_radius};
    make_views(&c, &camera, view);
    for (int round = 0; round < 5; round++) {
        int count;
        struct contour_edge *edge = edges_of(&rod, s, &c, &count, wild);
        assert_int_equal(cal_solid_fit(s, &prior, edge, count, VIEWS, 0.5, NULL), STATUS_OK);
        free(edge);
    }
}

static void test_a_cylinder_is_found_from_a_wrong_place(void **state)
{
    (void)state;
    struct sample s = rod;
    s.center = vec3_add(s.center, (vec3){1, -0.8, 1.2});
    s.axis = vec3_normalize(vec3_add(s.axis, (vec3){0, 0.03, -0.02}));
    place(&s, 0, false);
    assert_near(vec3_length(vec3_sub(s.center, rod.center)), 0, 2e-3);
    assert_near(vec3_length(vec3_cross(s.axis, vec3_normalize(rod.axis))), 0, 1e-4);
    assert_true(s.sigma_turn[2] > 0 && s.sigma_turn[2] < 0.01);
    assert_true(s.sigma_radius == 0);
}

static void test_its_radius_too(void **state)
{
    (void)state;
    struct sample s = rod;
    s.radius *= 1.003;
    place(&s, 0, true);
    assert_near(s.radius, rod.radius, 5e-3);
    assert_true(s.sigma_radius > 0);
}

// Every sixth edge is a shadow's, 8 pixels out.
static void test_wild_edges_are_left_out(void **state)
{
    (void)state;
    struct sample s = rod;
    s.center.x += 0.5;
    place(&s, 8, false);
    assert_near(vec3_length(vec3_sub(s.center, rod.center)), 0, 5e-3);
}

static void test_too_few_edges(void **state)
{
    (void)state;
    struct sample s = rod;
    struct solid_prior prior = {.radius = rod.radius};
    struct error err = {0};
    assert_int_equal(cal_solid_fit(&s, &prior, NULL, 0, VIEWS, 0.5, &err), STATUS_DATA);
    assert_non_null(strstr(err.text, "only 0 edges"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_side_touches_its_outline),
        cmocka_unit_test(test_a_cylinder_is_found_from_a_wrong_place),
        cmocka_unit_test(test_its_radius_too),
        cmocka_unit_test(test_wild_edges_are_left_out),
        cmocka_unit_test(test_too_few_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
