/* test_lamp.c -- lamps from facets whose radiance the closed form gives. */
#include "lamp.h"

#include "near.h"

#include <stdlib.h>
#include <string.h>

enum { VIEWS = 4 };

/** A scene: two lamps, four views, a patch, paper, and a glossy ball. */
struct scene {
    struct calibration calibration;
    struct capture capture;
    struct camera camera;
    struct view view[VIEWS];
    struct lamp lamp[2];
    struct light_place place[2];
    struct patch patch;
    struct facets board, sample;
    double power[VIEWS];
    vec3 position[2];
    double intensity[3];
};

static void add(struct facets *facets, struct facet facet)
{
    struct facet *grown = realloc(facets->facet, (size_t)(facets->count + 1) * sizeof *grown);
    assert_non_null(grown);
    facets->facet = grown;
    facets->facet[facets->count++] = facet;
}

/** A facet's ln L = ln(I k f cos/r^2), with a deterministic error of `noise`. */
static void light(struct scene *s, struct facet *f, const double reflectance[3], double noise)
{
    vec3 to = vec3_sub(s->position[s->view[f->view].light], f->point);
    double r = vec3_length(to), cosine = vec3_dot(to, f->normal) / r;
    for (int c = 0; c < 3; c++) {
        f->log_value[c] =
            log(s->intensity[c] * s->power[f->view] * reflectance[c] * cosine / (r * r))
            + noise * sin(3.7 * s->board.count + 5.1 * s->sample.count + c);
        f->sigma[c] = 0.001;
        f->mean[c] = exp(f->log_value[c]);
    }
    f->bright = true;
}

static void add_board(struct scene *s, int v, double noise)
{
    const double paper[3] = {0.25, 0.24, 0.22},
                 patch[3] = {0.99 / CAP_PI, 0.99 / CAP_PI, 0.99 / CAP_PI};
    for (int i = 0; i < 24; i++) {
        double a = 2 * CAP_PI * i / 24;
        struct facet f = {.view = v,
                          .material = MATERIAL_PAPER,
                          .normal = {0, 0, 1},
                          .point = {140 * cos(a), 100 * sin(a), 0},
                          .pixel = {200, 150}};
        light(s, &f, paper, noise);
        add(&s->board, f);
    }
    for (int i = 0; i < 9; i++) {
        struct facet f = {.view = v,
                          .material = MATERIAL_PATCH,
                          .normal = {0, 0, 1},
                          .point = {60 + 10.0 * (i % 3), 10.0 * (i / 3), 2},  // NOLINT: whole rows
                          .pixel = {200, 150}};
        light(s, &f, patch, noise);
        add(&s->board, f);
    }
}

/** A ball of a matte and a Blinn-Phong part: no member of the family that the fit uses. */
static void add_ball(struct scene *s, int v, double noise)
{
    vec3 eye = cal_eye(s->view[v].view_from_world);
    vec3 lamp = s->position[s->view[v].light];
    const struct sample *ball = &s->calibration.sample;
    for (int i = 0; i < 600; i++) {
        double z = 1 - (2 * i + 1) / 600.0, a = 2.399963 * i, flat = sqrt(1 - z * z);
        vec3 n = {flat * cos(a), flat * sin(a), z};
        vec3 p = vec3_add(ball->center, vec3_scale(n, ball->radius));
        vec3 wi = vec3_normalize(vec3_sub(lamp, p)), wo = vec3_normalize(vec3_sub(eye, p));
        if (vec3_dot(wi, n) < 0.1 || vec3_dot(wo, n) < 0.1)
            continue;
        double gloss = 0.5 * pow(vec3_dot(n, vec3_normalize(vec3_add(wi, wo))), 60);
        const double f[3] = {0.1 + gloss, 0.05 + gloss, 0.03 + gloss};
        struct facet facet = {
            .view = v, .material = MATERIAL_SAMPLE, .normal = n, .point = p, .pixel = {200, 150}};
        light(s, &facet, f, noise);
        add(&s->sample, facet);
    }
}

static void make_scene(struct scene *s, bool with_ball, double noise)
{
    *s = (struct scene){.position = {{-80, -560, 300}, {60, -300, 500}},
                        .intensity = {4e7, 3e7, 2e7},
                        .power = {1.02, 0.98, 1.01, 0.99}};
    s->camera =
        (struct camera){.width = 400, .height = 300, .focal = {1000, 1000}, .center = {200, 150}};
    s->patch.albedo = 0.99;
    for (int l = 0; l < 2; l++) {
        s->place[l] = (struct light_place){.name = l ? "high" : "low"};
        s->lamp[l] = (struct lamp){.name = s->place[l].name};
    }
    for (int v = 0; v < VIEWS; v++)
        s->view[v] = (struct view){.name = "v",
                                   .light = v % 2,
                                   .view_from_world = {.rotation = {2.2 + 0.15 * v, 0.2 * v, 0.1},
                                                       .translation = {0, 0, 650}}};
    s->calibration =
        (struct calibration){.camera = &s->camera,
                             .cameras = 1,
                             .view = s->view,
                             .views = VIEWS,
                             .lamp = s->lamp,
                             .lamps = 2,
                             .sample = {.shape = SHAPE_SPHERE, .center = {0, 0, 50}, .radius = 25}};
    s->capture = (struct capture){
        .flat = "flat.tif", .patch = &s->patch, .patches = 1, .light = s->place, .lights = 2};
    for (int v = 0; v < VIEWS; v++) {
        add_board(s, v, noise);
        if (with_ball)
            add_ball(s, v, noise);
    }
}

static void end_scene(struct scene *s)
{
    free(s->board.facet);
    free(s->sample.facet);
}

static void check(struct scene *s, double place_mm, double relative)
{
    for (int l = 0; l < 2; l++) {
        vec3 off = vec3_sub(s->lamp[l].position, s->position[l]);
        assert_near(vec3_length(off), 0, place_mm);
        double mean = (s->power[l] + s->power[l + 2]) / 2;
        for (int c = 0; c < 3; c++)
            assert_near(s->lamp[l].intensity[c] / (s->intensity[c] * mean), 1, relative);
        assert_near(s->view[l].power / (s->power[l] / mean), 1, relative);
        assert_near(s->view[l].power + s->view[l + 2].power, 2, 1e-12);
    }
}

static void test_start_is_near(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, false, 0.002);
    for (int l = 0; l < 2; l++) {
        assert_int_equal(cal_lamp_start(&s.calibration, l, &s.board, NULL), STATUS_OK);
        vec3 a = vec3_normalize(s.lamp[l].position), b = vec3_normalize(s.position[l]);
        assert_true(vec3_dot(a, b) > cos(20 * CAP_PI / 180));  // half a step of the grid, about
    }
    end_scene(&s);
}

static void test_board_alone(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, false, 0);
    const struct lamp_evidence evidence = {.board = &s.board, .doubt = 1};
    for (int l = 0; l < 2; l++)
        assert_int_equal(cal_lamp_start(&s.calibration, l, &s.board, NULL), STATUS_OK);
    assert_int_equal(cal_lamp_fit(&s.calibration, &s.capture, &evidence, true, NULL, NULL),
                     STATUS_OK);
    check(&s, 0.05, 1e-4);  // no noise: what the solver's tolerance leaves
    end_scene(&s);
}

static void test_glossy_ball_of_another_family(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, true, 0.003);
    const struct lamp_evidence evidence = {.board = &s.board, .sample = &s.sample, .doubt = 1};
    for (int l = 0; l < 2; l++)
        assert_int_equal(cal_lamp_start(&s.calibration, l, &s.board, NULL), STATUS_OK);
    assert_int_equal(cal_lamp_fit(&s.calibration, &s.capture, &evidence, true, NULL, NULL),
                     STATUS_OK);
    check(&s, 3, 0.005);  // the figures that the issue asks of a capture
    for (int l = 0; l < 2; l++)
        for (int k = 0; k < 3; k++)
            assert_true(s.lamp[l].sigma_position[k] > 0 && s.lamp[l].sigma_position[k] < 10);
    end_scene(&s);
}

/** Paper and patch get more light than predicted, by shares that differ from channel to channel. */
static void test_unknown_light_of_the_ball_is_found(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, false, 0);
    const double share[3] = {0.3, 0.2, 0.1};
    s.calibration.surroundings.strength = 1;
    s.calibration.surroundings.peak_unknown = true;
    for (int i = 0; i < s.board.count; i++)
        for (int c = 0; c < 3; c++) {
            struct facet *f = &s.board.facet[i];
            f->echo[ECHO_MIRROR + c][c] = 0.2 * exp(-vec3_dot(f->point, f->point) / 1e4);
            f->log_value[c] += share[c] * f->echo[ECHO_MIRROR + c][c];
        }
    const struct lamp_evidence evidence = {.board = &s.board, .doubt = 1};
    for (int l = 0; l < 2; l++)
        assert_int_equal(cal_lamp_start(&s.calibration, l, &s.board, NULL), STATUS_OK);
    assert_int_equal(cal_lamp_fit(&s.calibration, &s.capture, &evidence, true, NULL, NULL),
                     STATUS_OK);
    check(&s, 0.5, 1e-3);  // shares are drawn towards 0 a little
    end_scene(&s);
}

static void test_shadowed_paper_does_not_matter(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, true, 0.001);
    const struct lamp_evidence evidence = {.board = &s.board, .sample = &s.sample, .doubt = 1};
    for (int i = 0; i < s.board.count; i += 12)  // in the shadow of something that nobody declared
        for (int c = 0; c < 3; c++)
            s.board.facet[i].log_value[c] -= 2;
    for (int l = 0; l < 2; l++)
        assert_int_equal(cal_lamp_start(&s.calibration, l, &s.board, NULL), STATUS_OK);
    assert_int_equal(cal_lamp_fit(&s.calibration, &s.capture, &evidence, true, NULL, NULL),
                     STATUS_OK);
    check(&s, 3, 0.005);
    end_scene(&s);
}

static void test_no_paper_is_refused(void **state)
{
    (void)state;
    struct scene s;
    struct error err;
    make_scene(&s, false, 0);
    struct facets none = {0};
    assert_int_equal(cal_lamp_start(&s.calibration, 0, &none, &err), STATUS_DATA);
    assert_non_null(strstr(err.text, "low"));
    end_scene(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_start_is_near),
        cmocka_unit_test(test_board_alone),
        cmocka_unit_test(test_glossy_ball_of_another_family),
        cmocka_unit_test(test_unknown_light_of_the_ball_is_found),
        cmocka_unit_test(test_shadowed_paper_does_not_matter),
        cmocka_unit_test(test_no_paper_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
