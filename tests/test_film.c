/* Radiance images: the closed form, shadows, and the same bits from any number of threads. */
#include "film.h"
#include "near.h"
#include "place.h"
#include "shade.h"

#include <stdlib.h>
#include <string.h>

/** The scene of samples/tiny.yaml with one shot and its radiance image. */
struct fixture {
    struct scene scene;
    struct world world;
    float *value;
};

static int load(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    struct error err = {0};
    if (!f || sam_scene_read(&f->scene, SCENES "/tiny.yaml", &err)
        || sam_world_build(&f->world, &f->scene, &err)) {
        print_error("%s\n", err.text);
        return -1;
    }
    f->value = malloc(sizeof *f->value * 3 * (size_t)f->scene.camera.width
                      * (size_t)f->scene.camera.height);
    *state = f;
    return f->value ? 0 : -1;
}

static int unload(void **state)
{
    struct fixture *f = *state;
    sam_world_free(&f->world);
    sam_scene_free(&f->scene);
    free(f->value);
    free(f);
    return 0;
}

static struct ray ray_of(const struct scene *scene, const struct scene_shot *shot, double x,
                         double y)
{
    const double pixel[2] = {x, y};
    mat3 r = cal_rotation(shot->view_from_world.rotation);
    return (struct ray){cal_eye(shot->view_from_world),
                        mat3_mul_t(&r, cal_ray(&scene->camera, pixel))};
}

/** L = f I cos / r^2 at one place of the image, written down without world.c's help. false: it is
 *  not on the lit sample. */
static bool closed_form(const struct scene *scene, const struct scene_shot *shot, double x,
                        double y, double rgb[3])
{
    const struct scene_sample *sample = &scene->sample;
    struct ray ray = ray_of(scene, shot, x, y);
    vec3 m = vec3_sub(ray.origin, sample->place.center);
    double b = vec3_dot(m, ray.direction), radius = sample->place.radius;
    double q = b * b - vec3_dot(m, m) + radius * radius;
    if (q < 0)
        return false;
    vec3 p = sam_at(ray, -b - sqrt(q));
    vec3 n = vec3_scale(vec3_sub(p, sample->place.center), 1 / radius), tx, ty;
    vec3 to = vec3_sub(scene->lamp[shot->lamp].position, p);
    double r = vec3_length(to);
    vec3 wi = vec3_scale(to, 1 / r), wo = vec3_scale(ray.direction, -1);
    if (vec3_dot(wi, n) <= 0 || vec3_dot(wo, n) <= 0)
        return false;
    sam_frame(n, &tx, &ty);
    sam_material_eval(&sample->material,
                      (vec3){vec3_dot(wi, tx), vec3_dot(wi, ty), vec3_dot(wi, n)},
                      (vec3){vec3_dot(wo, tx), vec3_dot(wo, ty), vec3_dot(wo, n)}, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] *= scene->lamp[shot->lamp].intensity[c] * shot->power * vec3_dot(wi, n) / (r * r);
    return true;
}

/** Is the pixel inside: does all that is within a pixel of its middle lie on the lit sample? */
static bool is_interior(const struct scene *scene, const struct scene_shot *shot, int x, int y)
{
    double rgb[3];
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++)
            if (!closed_form(scene, shot, x + i, y + j, rgb))
                return false;
    return true;
}

/** The mean of the closed form over a pixel, by 12 x 12 points: good to 1e-5 where radiance bends
 *  like the root of the distance from the outline, a pixel away. */
static void closed_form_mean(const struct scene *scene, const struct scene_shot *shot, int x, int y,
                             double mean[3])
{
    enum { N = 12 };
    mean[0] = mean[1] = mean[2] = 0;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            double rgb[3];
            assert_true(
                closed_form(scene, shot, x + (i + 0.5) / N - 0.5, y + (j + 0.5) / N - 0.5, rgb));
            for (int c = 0; c < 3; c++)
                mean[c] += rgb[c] / (N * N);
        }
}

/** Relative rms of the rendered sample's interior against the closed form's pixel means. */
static double rms_error(struct fixture *f, const struct scene_shot *shot)
{
    assert_int_equal(sam_film_expose(&f->world, shot, 2, f->value, NULL), STATUS_OK);
    double square = 0;
    int count = 0;
    for (int y = 0; y < f->scene.camera.height; y++)
        for (int x = 0; x < f->scene.camera.width; x++) {
            if (!is_interior(&f->scene, shot, x, y))
                continue;
            double mean[3];
            closed_form_mean(&f->scene, shot, x, y, mean);
            const float *value = &f->value[3 * (y * f->scene.camera.width + x)];
            for (int c = 0; c < 3; c++)
                square += pow(value[c] / mean[c] - 1, 2);
            count += 3;
        }
    assert_true(count > 3000);
    print_message("relative rms %.1e over %d pixels\n", sqrt(square / count), count / 3);
    return sqrt(square / count);
}

static void test_sample_shows_the_closed_form(void **state)
{
    struct fixture *f = *state;
    for (int i = 0; i < f->scene.shots; i += 4)
        assert_true(rms_error(f, &f->scene.shot[i]) < 1e-4);
}

// A glossier ball has a highlight that is 3 px wide; pixels there are divided until they are right.
static void test_a_narrow_highlight_too(void **state)
{
    struct fixture *f = *state;
    double *alpha = &f->scene.sample.material.part[0].parameter[3], before = *alpha;
    *alpha = 0.03;
    assert_true(rms_error(f, &f->scene.shot[0]) < 1e-4);
    *alpha = before;
}

static void test_threads_make_no_difference(void **state)
{
    struct fixture *f = *state;
    size_t size =
        sizeof(float) * 3 * (size_t)f->scene.camera.width * (size_t)f->scene.camera.height;
    float *other = malloc(size);
    for (int threads = 1; threads <= 5; threads += 2) {
        assert_int_equal(sam_film_expose(&f->world, &f->scene.shot[1], 2, f->value, NULL), 0);
        assert_int_equal(sam_film_expose(&f->world, &f->scene.shot[1], threads, other, NULL), 0);
        assert_memory_equal(f->value, other, size);
    }
    free(other);
}

/** What is seen straight from above at (x, y). */
static struct spot from_above(const struct fixture *f, double x, double y)
{
    struct vantage nowhere = sam_vantage_nowhere();
    return sam_spot(&f->world, &nowhere, (struct ray){{x, y, 20}, {0, 0, -1}});
}

// The centre of the sphere hides the lamp from the point of the board on the line through both.
static void test_the_ball_throws_its_shadow(void **state)
{
    struct fixture *f = *state;
    struct shot_view view = sam_shot_view(&f->world, &f->scene.shot[0]);
    vec3 c = f->scene.sample.place.center, l = view.light.position, up = {0, 0, 1};
    double s = c.z / (l.z - c.z);
    vec3 shadow = vec3_add(c, vec3_scale(vec3_sub(c, l), s));
    double aside = f->scene.sample.place.radius * l.z / (l.z - c.z);
    for (int side = -1; side <= 1; side += 2) {
        struct spot in = from_above(f, shadow.x + 0.98 * side * aside, shadow.y);
        struct spot out = from_above(f, shadow.x + 1.02 * side * aside, shadow.y);
        assert_int_equal(sam_lit(&view, &in, up), LIT_NOT);
        assert_int_equal(sam_lit(&view, &out, up), LIT_FULLY);
    }
}

// Under a lamp of real size the shadow has a soft edge: at the point from where the ball's outline
// passes through the lamp's middle, half of the lamp is seen, and all or nothing a lamp's image
// away.
static void test_a_lamp_of_real_size_has_a_penumbra(void **state)
{
    struct fixture *f = *state;
    struct scene scene = f->scene;
    struct world world = f->world;
    struct scene_lamp lamp = scene.lamp[0];
    lamp.radius = 3;
    lamp.position = (vec3){0, 0, 600};
    scene.lamp = &lamp;
    world.scene = &scene;
    struct shot_view view = sam_shot_view(&world, &scene.shot[0]);
    vec3 c = scene.sample.place.center, up = {0, 0, 1};
    double d = lamp.position.z - c.z, radius = scene.sample.place.radius;
    double shadow = lamp.position.z * radius / sqrt(d * d - radius * radius);  // on the board
    double soft = lamp.radius * c.z / d;  // half the width of the penumbra
    double seen[5];
    for (int i = 0; i < 5; i++) {
        double x = c.x * lamp.position.z / d + shadow + (i - 2) * 0.75 * soft, rgb[3];
        struct spot spot = from_above(f, x, 0);
        enum lit lit = sam_lit(&view, &spot, up);
        sam_shade(&view, &spot, lit, up, rgb);
        struct incidence in = sam_light_part(&view.light, spot.point, 0, 1);
        seen[i] = rgb[0] / (spot.albedo / CAP_PI * in.irradiance[0] * in.wi.z);
    }
    assert_near(seen[0], 0, 0);
    assert_near(seen[2], 0.5,
                0.06);  // a third of a part of 96 on either side, and the ball's curve
    assert_near(seen[4], 1, 1e-3);
    assert_true(seen[0] < seen[1] && seen[1] < seen[2] && seen[2] < seen[3] && seen[3] < seen[4]);
}

// A lying cylinder, with the normal and the light of its curved side written down directly.
static void test_a_cylinder_shows_the_closed_form(void **state)
{
    struct fixture *f = *state;
    struct scene scene = f->scene;
    struct world world = f->world;
    struct sample_place *place = &scene.sample.place;
    *place = (struct sample_place){.shape = SHAPE_CYLINDER,
                                   .radius = 20,
                                   .height = 60,
                                   .center = {0, 0, 60},
                                   .axis = {0.6, 0.8, 0}};
    scene.post.radius = 0;
    world.scene = &scene;
    world.post.radius = 0;
    world.rod = (struct rod){place->center, place->axis, place->radius, place->height / 2};
    struct shot_view view = sam_shot_view(&world, &scene.shot[0]);
    for (int i = 0; i < 400; i++) {
        double along = (i % 20 - 9.5) * 3, turn = CAP_PI * (i / 20 + 0.5) / 20, rgb[3], f_rgb[3];
        vec3 across = {0.8 * cos(turn), -0.6 * cos(turn), sin(turn)}, x, y;
        vec3 p = vec3_add(place->center, vec3_add(vec3_scale(place->axis, along),
                                                  vec3_scale(across, place->radius)));
        vec3 wo = vec3_normalize(vec3_sub(view.eye, p)), to = vec3_sub(view.light.position, p);
        vec3 wi = vec3_normalize(to);
        double cos_i = vec3_dot(wi, across), cos_o = vec3_dot(wo, across);
        if (cos_i < 0.02 || cos_o < 0.02)
            continue;
        struct spot spot =
            sam_spot(&world, &view.eye_vantage, (struct ray){view.eye, vec3_scale(wo, -1)});
        assert_int_equal(spot.matter, MATTER_SAMPLE);
        assert_near(vec3_length(vec3_sub(spot.point, p)), 0, 1e-9);
        sam_shade(&view, &spot, sam_lit(&view, &spot, wo), wo, rgb);
        sam_frame(across, &x, &y);
        sam_material_eval(&scene.sample.material, (vec3){vec3_dot(wi, x), vec3_dot(wi, y), cos_i},
                          (vec3){vec3_dot(wo, x), vec3_dot(wo, y), cos_o}, f_rgb);
        double expected = f_rgb[1] * view.light.intensity[1] * cos_i / vec3_dot(to, to);
        assert_near(rgb[1], expected, 1e-9 * expected);
    }
}

// White paper, from above: L = albedo/pi I cos / r^2.
static void test_paper_is_matt(void **state)
{
    struct fixture *f = *state;
    struct shot_view view = sam_shot_view(&f->world, &f->scene.shot[0]);
    struct tag_place *tag = &f->scene.board.tag[0];
    vec3 p = {tag->center.x - tag->size / 2 - 1, tag->center.y, 0}, up = {0, 0, 1};
    struct spot spot = from_above(f, p.x, p.y);
    double rgb[3], r = vec3_length(vec3_sub(view.light.position, p));
    sam_shade(&view, &spot, LIT_FULLY, up, rgb);
    assert_near(rgb[1],
                0.8 / CAP_PI * view.light.intensity[1] * view.light.position.z / (r * r * r),
                1e-15);
}

// In even light from everywhere, a matt ball shows its albedo, a white one nothing of its shape.
static void test_ambient_light(void **state)
{
    struct fixture *f = *state;
    const double white[] = {0.2, 0.5, 1};
    struct scene_sample matt = {.material = sam_material(rec_model_find("lambert"), white)};
    struct ambient_albedo albedo;
    sam_ambient_albedo(&matt.material, &albedo);
    struct scene scene = f->scene;
    struct world world = f->world;
    scene.sample.material = matt.material;
    scene.ambient[0] = scene.ambient[1] = scene.ambient[2] = 3;
    world.scene = &scene;
    struct shot_view view = sam_shot_view(&world, &f->scene.shot[0]);
    view.ambient = &albedo;
    for (int i = 0; i <= 90; i += 9) {
        struct spot spot = {.matter = MATTER_SAMPLE, .normal = {0, 0, 1}};
        double angle = i * CAP_PI / 180, rgb[3] = {0, 0, 0};
        sam_ambient_add(&view, &spot, (vec3){sin(angle), 0, cos(angle)}, rgb);
        for (int c = 0; c < 3; c++)
            assert_near(rgb[c], 3 * white[c], 1e-12);
    }
}

// Cones only leave out what is not there: with and without them, the image is the same.
static void test_cones_change_nothing(void **state)
{
    struct fixture *f = *state;
    struct shot_view view = sam_shot_view(&f->world, &f->scene.shot[2]);
    struct vantage nowhere = sam_vantage_nowhere();
    for (int i = 0; i < 200000; i++) {
        double x = fmod(i * 0.754877666, 1) * f->scene.camera.width;
        double y = fmod(i * 0.569840291, 1) * f->scene.camera.height;
        struct ray ray = ray_of(&f->scene, &f->scene.shot[2], x, y);
        struct spot a = sam_spot(&f->world, &view.eye_vantage, ray);
        struct spot b = sam_spot(&f->world, &nowhere, ray);
        assert_int_equal(a.surface, b.surface);
        vec3 to = vec3_sub(view.light.position, a.point);
        double far = vec3_length(to);
        struct ray towards = {a.point, vec3_scale(to, 1 / far)};
        if (a.matter != MATTER_NONE)
            assert_int_equal(sam_blocked(&f->world, &view.lamp_vantage, towards, far),
                             sam_blocked(&f->world, &nowhere, towards, far));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sample_shows_the_closed_form),
        cmocka_unit_test(test_a_narrow_highlight_too),
        cmocka_unit_test(test_threads_make_no_difference),
        cmocka_unit_test(test_the_ball_throws_its_shadow),
        cmocka_unit_test(test_paper_is_matt),
        cmocka_unit_test(test_a_lamp_of_real_size_has_a_penumbra),
        cmocka_unit_test(test_a_cylinder_shows_the_closed_form),
        cmocka_unit_test(test_ambient_light),
        cmocka_unit_test(test_cones_change_nothing),
    };
    return cmocka_run_group_tests(tests, load, unload);
}
