/* test_samples.c -- photosites of a closed-form scene give back the f that was put in.
 */
#include "ball_scene.h"
#include "sample_at.h"

static const double grey[] = {0.2, 0.5, 0.8};

// The footprint's mean of cos/r^2 is the pixel's: f comes back to the map's float rounding, except
// next to the edges, where cos_o's root bends more than the quadrature's fifth degree follows.
static void test_lambert_comes_back(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    int used = 0;
    shoot(s);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            reflectance_sample a;
            bool hit;
            if (sample_at(&a, &v, &s->map, x, y, &hit))
                continue;
            vec3 wi, wo;
            rec_directions(a.angles, &wi, &wo);
            bool inner = wo.z > 0.5 && wi.z > 0.3;
            for (int c = 0; c < 3; c++)
                assert_near(a.f[c] * CAP_PI / grey[c], 1, inner ? 2e-5 : 3e-3);
            used++;
        }
    assert_true(used > 1500);
    free_scene(s);
}

// What the lens spreads light over is averaged like the photosite's own square; a little of the
// dark beyond the edges, more than two sigmas away, comes along.
static void test_blur_is_averaged(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    int used = 0;
    shoot(s);
    s->view.blur_px = blur(s, 0.8);
    assert_near(s->view.blur_px, 0.8, 0.01);
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            reflectance_sample a;
            bool hit;
            if (sample_at(&a, &v, &s->map, x, y, &hit))
                continue;
            vec3 wi, wo;
            rec_directions(a.angles, &wi, &wo);
            bool inner = wo.z > 0.5 && wi.z > 0.3;
            for (int c = 0; c < 3; c++)
                assert_near(a.f[c] * CAP_PI / grey[c], 1, inner ? 5e-4 : 3e-2);
            used++;
        }
    assert_true(used > 1200);
    free_scene(s);
}

// A highlight is averaged over the photosite: only the model's bend over it is left, and that is
// what spread[] tells.
static void test_gloss_comes_back_to_its_bend(void **state)
{
    (void)state;
    const double value[] = {0.2, 0.2, 0.2, 0.3, 1.5};
    struct scene *s = make_scene("ggx", value);
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    shoot(s);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            reflectance_sample a;
            bool hit;
            if (sample_at(&a, &v, &s->map, x, y, &hit))
                continue;
            vec3 wi, wo;
            double f[3];
            rec_directions(a.angles, &wi, &wo);
            s->model->eval(s->value, wi, wo, f);
            // Half the second derivative of a lobe of width 0.3 is below 3 / 0.09 of its height.
            double bend = 35 * (a.spread[0] + a.spread[1]) + 1e-4;
            assert_near(a.f[1] / f[1], 1, wo.z > 0.2 ? bend : bend + 3e-3);
        }
    free_scene(s);
}

static void test_fates(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    int count[FATES] = {0}, hits = 0;
    shoot(s);
    size_t middle = 3 * (size_t)(40 * WIDTH + 52);
    s->map.variance[middle + 1] = INFINITY;
    s->map.value[middle + 3] = NAN;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            reflectance_sample a;
            bool hit;
            enum fate fate = sample_at(&a, &v, &s->map, x, y, &hit);
            hits += hit;
            count[fate] += hit;
        }
    double radius = 25 * 605 / sqrt(400.0 * 400 - 625);  // of the outline, px
    assert_near((double)hits, CAP_PI * radius * radius, 0.02 * CAP_PI * radius * radius);
    // A ring of one photosite, and not two.
    assert_true(count[FATE_OUTLINE] > 0.8 * 2 * CAP_PI * radius);
    assert_true(count[FATE_OUTLINE] < 1.4 * 2 * CAP_PI * radius);
    assert_int_equal(count[FATE_SATURATED], 1);
    assert_int_equal(count[FATE_UNUSABLE], 1);
    assert_true(count[FATE_DARK] > 100);
    assert_true(count[FATE_TERMINATOR] > 20 && count[FATE_TERMINATOR] < 4 * radius);
    assert_int_equal(count[FATE_OCCLUDED], 0);
    free_scene(s);
}

// 1 where the sample is lit, averaged over pairs of photosites, and interpolated between the pairs
// by libjpeg's triangle, along one axis of [rows][columns].
static void share_pairs(double *part, int rows, int columns, int step, int line)
{
    double pair[WIDTH];
    for (int j = 0; j < rows; j++) {
        double *at = part + j * line;
        for (int i = 0; i < columns / 2; i++)
            pair[i] = (at[2 * i * step] + at[(2 * i + 1) * step]) / 2;
        for (int i = 1; i < columns - 1; i++)
            at[i * step] = 0.75 * pair[i / 2] + 0.25 * pair[i % 2 ? i / 2 + 1 : i / 2 - 1];
    }
}

// What is looked at around a photosite holds all that its colour is made of, but for three of the
// four photosites of the pairs that lie askew: those weigh (1/4)^2 together.
static void test_shared_colour_keeps_off_edges(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    static double part[HEIGHT * WIDTH];
    static bool used[2][HEIGHT * WIDTH];
    double least[2] = {1, 1};
    int count[2] = {0};
    shoot(s);
    for (int k = 0; k < 2; k++) {
        v.chroma[0] = v.chroma[1] = 2 * k;
        for (int i = 0; i < HEIGHT * WIDTH; i++) {
            reflectance_sample a;
            bool hit;
            enum fate fate = sample_at(&a, &v, &s->map, i % WIDTH, i / WIDTH, &hit);
            used[k][i] = fate == FATE_USED;
            if (k == 0)
                part[i] = hit && fate != FATE_DARK;
        }
    }
    share_pairs(part, HEIGHT, WIDTH, 1, WIDTH);
    share_pairs(part, WIDTH, HEIGHT, WIDTH, 1);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < HEIGHT * WIDTH; i++)
            if (used[k][i]) {
                least[k] = fmin(least[k], part[i]);
                count[k]++;
            }
    assert_true(least[0] < 0.8);
    assert_true(least[1] >= 1 - 3.0 / 64);
    assert_true(count[1] > 0.8 * count[0]);
    free_scene(s);
}

// A ball for a lamp spreads wi by (a / 2r)^2 each way; where it has set in part, f is not measured.
static void test_a_lamp_of_real_size(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    const double radius = 40;
    int set = 0;
    shoot(s);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            reflectance_sample a;
            bool hit;
            s->lamp.radius = 0;
            if (sample_at(&a, &v, &s->map, x, y, &hit))
                continue;
            double r = vec3_length(vec3_sub(s->lamp.position, a.point));
            double cos_i = vec3_dot(vec3_sub(s->lamp.position, a.point), a.normal) / r;
            assert_near(a.disc, 0, 0);
            s->lamp.radius = radius;
            enum fate fate = sample_at(&a, &v, &s->map, x, y, &hit);
            set += fate == FATE_TERMINATOR;
            // Means over the photosite differ a little from its centre, which decides.
            if (fabs(cos_i - radius / r) > 2e-3)
                assert_int_equal(fate, cos_i < radius / r ? FATE_TERMINATOR : FATE_USED);
            if (fate == FATE_USED)
                assert_near(a.disc, radius * radius / (4 * r * r), 1e-4 * a.disc);
        }
    assert_true(set > 20);
    free_scene(s);
}

// A step of the sphere, the lamp or the radius moves ln(cos/r^2) by its derivative: the sigma for
// one direction at a time is the difference of two footprints.
static double log_irradiance(struct scene *s, int x, int y)
{
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    struct strip strip = strip_at(x, y);
    rec_strip_footprints(&strip, &v);
    assert_int_equal(strip.fate[x % LANES], FATE_USED);
    return log(strip.irradiance[x % LANES]);
}

static double systematic(struct scene *s, int x, int y)
{
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    reflectance_sample a;
    bool hit;
    assert_int_equal(sample_at(&a, &v, &s->map, x, y, &hit), FATE_USED);
    return a.systematic;
}

static void test_systematic_errors_are_derivatives(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    const int x = 42, y = 38;
    const double step = 1e-3;
    shoot(s);
    struct sample *p = &s->calibration.sample;
    double *moved[] = {&p->center.x,        &p->center.y,        &p->center.z,       &p->radius,
                       &s->lamp.position.x, &s->lamp.position.y, &s->lamp.position.z};
    double *sigma[] = {&p->sigma_center[0],        &p->sigma_center[1],
                       &p->sigma_center[2],        &p->sigma_radius,
                       &s->lamp.sigma_position[0], &s->lamp.sigma_position[1],
                       &s->lamp.sigma_position[2]};
    for (int k = 0; k < 7; k++) {
        double was = *moved[k];
        *moved[k] = was + step;
        double up = log_irradiance(s, x, y);
        *moved[k] = was - step;
        double down = log_irradiance(s, x, y);
        *moved[k] = was;
        *sigma[k] = step;
        assert_near(systematic(s, x, y), fabs(up - down) / 2, 0.01 * fabs(up - down) / 2 + 1e-7);
        *sigma[k] = 0;
    }
    s->view.sigma_power = 0.011;                          // of 1.1
    assert_near(systematic(s, x, y), 0.01, 0.01 * 2e-7);  // a few roundings of single precision
    free_scene(s);
}

// A lamp that is pulled away along its beam by 1 % and is 2 % stronger for it lights the sample as
// before; as two errors on their own these come to 2.8 %. theta_h turns by half of what wi does.
static void test_errors_of_a_lamp_cancel(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    const int x = 42, y = 38;
    shoot(s);
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    reflectance_sample a;
    bool hit;
    assert_int_equal(sample_at(&a, &v, &s->map, x, y, &hit), FATE_USED);
    double r = vec3_length(vec3_sub(s->lamp.position, a.point));
    const double away[4] = {0.01 * r * a.wi.x, 0.01 * r * a.wi.y, 0.01 * r * a.wi.z, 0.02};
    for (int i = 0; i < 16; i++)
        s->lamp.covariance[i / 4][i % 4] = away[i / 4] * away[i % 4];
    assert_near(systematic(s, x, y), 0, 2e-5);
    for (int i = 0; i < 3; i++)
        s->lamp.covariance[i][3] = s->lamp.covariance[3][i] = 0;
    assert_near(systematic(s, x, y), 0.02 * sqrt(2), 2e-5);

    vec3 h = vec3_add(a.wi, a.wo), out = vec3_sub(h, vec3_scale(a.normal, vec3_dot(h, a.normal)));
    vec3 across = vec3_sub(out, vec3_scale(a.wi, vec3_dot(out, a.wi)));
    double turn = 1e-3, by = turn * r / vec3_length(across);
    const double aside[4] = {by * across.x, by * across.y, by * across.z, 0};
    for (int i = 0; i < 16; i++)
        s->lamp.covariance[i / 4][i % 4] = aside[i / 4] * aside[i % 4];
    s->lamp.covariance[3][3] = 1e-12;
    v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    assert_int_equal(sample_at(&a, &v, &s->map, x, y, &hit), FATE_USED);
    double before = a.angles.theta_h;
    s->lamp.position = vec3_add(s->lamp.position, vec3_scale(across, by));
    double tilt = a.tilt;
    v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    assert_int_equal(sample_at(&a, &v, &s->map, x, y, &hit), FATE_USED);
    double moved = fabs(a.angles.theta_h - before);
    assert_near(tilt, moved, 0.15 * moved);  // the tangent is that of n, not of h
    free_scene(s);
}

// The board between eye and sample hides it; beside the sample it does not.
static void test_the_board_hides_what_is_behind_it(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    shoot(s);
    s->calibration.sample.center.z -= 300;  // the same view from (0, 0, -300) of the world
    s->view.view_from_world.translation.z = 300;
    s->lamp.position.z -= 300;
    struct board_extent before = {{-50, -50}, {50, 50}}, beside = {{20, -50}, {50, 50}};
    reflectance_sample a;
    bool hit;
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, &before);
    assert_int_equal(sample_at(&a, &v, &s->map, 50, 40, &hit), FATE_OCCLUDED);
    v = rec_viewing(&s->calibration, 0, &s->lens, &beside);
    assert_int_equal(sample_at(&a, &v, &s->map, 50, 40, &hit), FATE_USED);
    free_scene(s);
}

// A rod of 3 mm radius before the ball hides a strip of it, and throws a shadow of about its width;
// what it leaves is as it was.
static void test_a_rod_hides_and_shadows(void **state)
{
    (void)state;
    struct scene *s = make_scene("lambert", grey);
    shoot(s);
    struct occluder rod = {.shape = OCCLUDER_CYLINDER,
                           .radius = 3,
                           .height = 200,
                           .center = {-12, 0, 355},
                           .axis = {0, 1, 0}};
    struct blocker blocker = {.of = &rod};
    struct blockers blockers = {&blocker, 1};
    struct viewing free_view = rec_viewing(&s->calibration, 0, &s->lens, NULL), v = free_view;
    v.blockers = &blockers;
    int count[FATES] = {0};
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            reflectance_sample a, b;
            bool hit;
            enum fate before = sample_at(&a, &free_view, &s->map, x, y, &hit);
            enum fate fate = sample_at(&b, &v, &s->map, x, y, &hit);
            count[fate]++;
            if (before != FATE_USED || fate == FATE_USED)
                assert_int_equal(fate, before);
            // The ray through x = -12 +- 3 mm at z = 355 is hidden, with 1.5 photosites more.
            double u = (x - s->camera.center[0]) / s->camera.focal[0] * 355 + 12;
            if (before == FATE_USED && fabs(u) < 3)
                assert_int_equal(fate, FATE_OCCLUDED);
            if (fate == FATE_OCCLUDED)
                assert_true(fabs(u) < 3 + 2.5 * 355 / s->camera.focal[0]);
        }
    assert_true(count[FATE_OCCLUDED] > 200 && count[FATE_SHADOWED] > 100);
    free_scene(s);
}

static void test_a_turned_box_blocks(void **state)
{
    (void)state;
    // 2 x 20 x 2 mm about (10, 0, 0), turned by a quarter about z: it lies along x.
    struct occluder box = {.shape = OCCLUDER_BOX,
                           .center = {10, 0, 0},
                           .size = {2, 20, 2},
                           .rotation = {0, 0, CAP_PI / 2}};
    struct blocker blocker = {.of = &box,
                              .box_from_world = cal_rotation((vec3){0, 0, -CAP_PI / 2})};
    struct blockers blockers = {&blocker, 1};
    vec3 below = {1, 0, -5}, above = {1, 0, 5}, beside = {-0.5, 0, 5};
    assert_true(rec_blocked(&blockers, below, above, 0));
    assert_false(rec_blocked(&blockers, (vec3){-0.5, 0, -5}, beside, 0));
    assert_true(rec_blocked(&blockers, (vec3){-0.5, 0, -5}, beside, 0.6));
    assert_false(rec_blocked(&blockers, (vec3){1, 0, 2}, above, 0));  // the segment ends before it
}

// A cylinder's normal at the middle of its face looks back along the ray; its ends are edges.
static void test_cylinder(void **state)
{
    (void)state;
    struct sample c = {.shape = SHAPE_CYLINDER,
                       .radius = 20,
                       .height = 60,
                       .center = {0, 0, 300},
                       .axis = {0, 2, 0}};
    meeting m = rec_meet(&c, (vec3){0}, (vec3){0, 0, 1});
    assert_true(m.hit);
    assert_near(m.point.z, 280, 1e-12);
    assert_near(m.normal.z, -1, 1e-14);
    vec3 beyond_end = vec3_normalize((vec3){0, 30.1, 280}), before_end = {0, 29.9, 280};
    assert_false(rec_meet(&c, (vec3){0}, beyond_end).hit);
    assert_true(rec_meet(&c, (vec3){0}, vec3_normalize(before_end)).hit);
    assert_false(rec_meet(&c, (vec3){0}, vec3_normalize((vec3){21, 0, 300})).hit);
    assert_false(rec_meet(&c, (vec3){0}, (vec3){0, 0, -1}).hit);
}

static void test_a_ball_blocks(void **state)
{
    (void)state;
    struct blocker blocker = {.center = {10, 0, 0}, .radius = 3};
    struct blockers blockers = {&blocker, 1};
    vec3 below = {12, 0, -9}, above = {12, 0, 9};
    assert_true(rec_blocked(&blockers, below, above, 0));
    assert_false(rec_blocked(&blockers, (vec3){14, 0, -9}, (vec3){14, 0, 9}, 0.5));
    assert_true(rec_blocked(&blockers, (vec3){14, 0, -9}, (vec3){14, 0, 9}, 1.5));
    assert_false(rec_blocked(&blockers, (vec3){12, 0, 4}, above, 0));  // it begins beyond
}

// Balls stand where the calibration found them; one that it left out is where it was said to be.
static void test_balls_are_where_they_were_found(void **state)
{
    (void)state;
    const struct capture capture = {.ball = {{.radius = 3, .center = {10, 0, 0}}}, .balls = 1};
    struct calibration c = {.balls = 0};
    for (int found = 0; found < 2; found++) {
        struct blockers blockers = {0};
        c.balls = found;
        c.ball[0] = (struct sample){.shape = SHAPE_SPHERE, .radius = 3.1, .center = {11, 0, 0}};
        assert_int_equal(rec_blockers_make(&blockers, &capture, &c, NULL), STATUS_OK);
        assert_int_equal(blockers.count, 1);
        assert_near(blockers.blocker[0].center.x, found ? 11 : 10, 0);
        assert_near(blockers.blocker[0].radius, found ? 3.1 : 3, 0);
        rec_blockers_free(&blockers);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lambert_comes_back),
        cmocka_unit_test(test_blur_is_averaged),
        cmocka_unit_test(test_gloss_comes_back_to_its_bend),
        cmocka_unit_test(test_fates),
        cmocka_unit_test(test_shared_colour_keeps_off_edges),
        cmocka_unit_test(test_a_lamp_of_real_size),
        cmocka_unit_test(test_systematic_errors_are_derivatives),
        cmocka_unit_test(test_errors_of_a_lamp_cancel),
        cmocka_unit_test(test_the_board_hides_what_is_behind_it),
        cmocka_unit_test(test_a_rod_hides_and_shadows),
        cmocka_unit_test(test_a_turned_box_blocks),
        cmocka_unit_test(test_a_ball_blocks),
        cmocka_unit_test(test_balls_are_where_they_were_found),
        cmocka_unit_test(test_cylinder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
