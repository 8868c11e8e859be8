/* test_shadow.c -- a sphere's shadow on a board, by counting how much of a ball lamp each place
 * sees, tells where the lamp is and how large. */
#include "shadow.h"

#include "near.h"

#include <stdlib.h>

enum { WIDTH = 400, HEIGHT = 300, FINE = 3, RINGS = 5 };
static const vec3 lamp_at = {-30, -520, 290};

struct scene {
    struct camera camera;
    struct view view;
    struct lamp lamp;
    struct calibration calibration;
    struct capture capture;
    struct tag_place tag[4];
    struct radiance map;
    struct run run;
};

/** Does the sphere stand between a place and one on the lamp? */
static bool hidden(const struct sample *s, vec3 from, vec3 to)
{
    vec3 way = vec3_normalize(vec3_sub(to, from)), c = vec3_sub(s->center, from);
    double along = vec3_dot(c, way);
    return vec3_dot(c, c) - along * along < s->radius * s->radius;
}

/** Irradiance of a place: the lamp's disc in parts of equal area, seen or not. */
static double lit(const struct scene *s, vec3 p, double radius)
{
    vec3 to = vec3_sub(lamp_at, p);
    double r = vec3_length(to), sum = 0;
    int parts = 0;
    vec3 z = vec3_scale(to, 1 / r), x = vec3_normalize(vec3_cross(z, (vec3){0, 0, 1}));
    vec3 y = vec3_cross(z, x), c = vec3_sub(s->calibration.sample.center, p);
    double past = vec3_length(vec3_cross(c, z)) - s->calibration.sample.radius;
    if (fabs(past) > 0.3 * radius)  // the disc is seen as a whole, or not at all
        return past > 0 ? z.z / (r * r) : 0;
    for (int i = 0; i < RINGS; i++)
        for (int j = 0; j < 6 * i + 3; j++, parts++) {
            double rho = radius * (i + 0.5) / RINGS, phi = 2 * CAP_PI * (j + 0.3) / (6 * i + 3);
            vec3 on = vec3_add(vec3_scale(x, rho * cos(phi)), vec3_scale(y, rho * sin(phi)));
            sum += !hidden(&s->calibration.sample, p, vec3_add(lamp_at, on));
        }
    return sum / parts * z.z / (r * r);
}

/** A camera right above, 600 mm: board and shadow, the mean over each pixel's square. */
static void make_scene(struct scene *s, double radius)
{
    *s = (struct scene){.run = {.threads = 1}};
    s->camera = (struct camera){.width = WIDTH,
                                .height = HEIGHT,
                                .focal = {1000, 1000},
                                .center = {WIDTH / 2.0, HEIGHT / 2.0}};
    s->view = (struct view){
        .view_from_world = {.rotation = {CAP_PI, 0, 0}, .translation = {0, 60, 600}}, .power = 1};
    s->lamp = (struct lamp){.name = "l", .position = lamp_at};
    s->calibration =
        (struct calibration){.camera = &s->camera,
                             .view = &s->view,
                             .lamp = &s->lamp,
                             .sample = {.shape = SHAPE_SPHERE, .radius = 25, .center = {0, 0, 45}},
                             .cameras = 1,
                             .views = 1,
                             .lamps = 1};
    for (int i = 0; i < 4; i++)
        s->tag[i] = (struct tag_place){.id = i,
                                       .size = 20,
                                       .center = {i & 1 ? 150 : -150, i & 2 ? 190 : -70, 0},
                                       .x_axis = {1, 0, 0},
                                       .y_axis = {0, 1, 0}};
    s->capture = (struct capture){.tag = s->tag, .tags = 4};
    s->map = (struct radiance){.width = WIDTH, .height = HEIGHT, .channels = 3};
    s->map.value = calloc(3 * WIDTH * HEIGHT, sizeof(float));
    s->map.variance = calloc(3 * WIDTH * HEIGHT, sizeof(float));
    assert_true(s->map.value && s->map.variance);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        double sum = 0;
        for (int k = 0; k < FINE * FINE; k++) {
            double u = i % WIDTH - WIDTH / 2.0 + (k % FINE + 0.5) / FINE - 0.5;
            double v = i / WIDTH - HEIGHT / 2.0 + (k / FINE + 0.5) / FINE - 0.5;  // NOLINT: rows
            sum += lit(s, (vec3){0.6 * u, 60 - 0.6 * v, 0}, radius);
        }
        for (int c = 0; c < 3; c++) {
            s->map.value[3 * i + c] = (float)(1e5 * sum / (FINE * FINE));
            s->map.variance[3 * i + c] = 1e-8F;
        }
    }
}

static int pieces_of(const struct scene *s, struct shadow_piece *piece, double radius)
{
    struct board_plane plane;
    int found = 0;
    assert_true(shadow_board(&plane, &s->capture));
    int all = shadow_pieces(piece, 0, 60, 48, &s->map, &s->calibration, 0, &s->capture, &plane);
    for (int i = 0; i < all; i++)
        if (isfinite(shadow_edge_fit(&piece[i], radius, 1)))
            piece[found++] = piece[i];
    assert_true(found > 20);
    return found;
}

/** From a lamp that is 8 mm off. Half of the disc lies outside the limb where it is straight; that
 *  the limb bends shifts it by w^2/R, some hundredths of a millimetre here. */
static void check_place(double radius)
{
    struct scene s;
    struct shadow_piece *piece = calloc(60, sizeof *piece);
    struct lamp_cue cue;
    make_scene(&s, radius);
    s.lamp.position = vec3_add(lamp_at, (vec3){6, -3, 5});
    int count = pieces_of(&s, piece, radius);
    assert_int_equal(shadow_cue(&cue, &s.calibration, 0, piece, count, (vec3){0, 0, 1}, NULL),
                     STATUS_OK);
    vec3 to = vec3_sub(lamp_at, s.calibration.sample.center), way = vec3_normalize(to);
    double off = vec3_length(vec3_sub(cue.direction, way));
    print_message("radius %g: %.3f degrees off, sigma %.3f; %.1f mm too far, sigma %.1f\n", radius,
                  off * 180 / CAP_PI, cue.sigma * 180 / CAP_PI, cue.distance - vec3_length(to),
                  cue.sigma_distance);
    assert_true(cue.sigma > 0 && cue.sigma < 0.003);  // 0.15 mm of the board's surface in 90 mm
    assert_true(off < 0.0007);                        // what is here is edges alone: 0.06 mm
    assert_true(cue.distance > 0);
    assert_near(cue.distance, vec3_length(to), 3 * cue.sigma_distance);
    free(piece);
    cap_radiance_free(&s.map);
}

static void a_point_lamp_is_placed(void **state)
{
    (void)state;
    check_place(0);
}

static void a_ball_lamp_is_placed(void **state)
{
    (void)state;
    check_place(10);
}

static void the_size_of_a_lamp(void **state)
{
    (void)state;
    static const double radii[] = {0, 8, 15};
    for (int k = 0; k < 3; k++) {
        struct scene s;
        struct shadow_piece *piece = calloc(60, sizeof *piece);
        double sigma;
        make_scene(&s, radii[k]);
        int count = pieces_of(&s, piece, 0);
        double found = shadow_size(piece, count, 30, &s.run, &sigma);
        print_message("radius %g: %.2f +- %.2f mm\n", radii[k], found, sigma);
        assert_near(found, radii[k], fmax(3 * sigma, 1e-9));
        assert_true(sigma < 0.15 * radii[k] + 1e-9);
        free(piece);
        cap_radiance_free(&s.map);
    }
}

/** On tags, or outside of them, no edge is looked for; a sphere in front of it hides it. */
static void where_nothing_is_seen_nothing_is_told(void **state)
{
    (void)state;
    struct scene s;
    struct shadow_piece *piece = calloc(60, sizeof *piece);
    struct board_plane plane;
    struct lamp_cue cue = {.sigma = 1};
    make_scene(&s, 0);
    for (int i = 0; i < 4; i++)
        s.tag[i].center.y -= 300;
    assert_true(shadow_board(&plane, &s.capture));
    assert_int_equal(shadow_pieces(piece, 0, 60, 48, &s.map, &s.calibration, 0, &s.capture, &plane),
                     0);
    assert_int_equal(shadow_cue(&cue, &s.calibration, 0, piece, 0, plane.normal, NULL), STATUS_OK);
    assert_near(cue.sigma, 0, 0);
    s.tag[3].center.z = 30;
    assert_false(shadow_board(&plane, &s.capture));
    free(piece);
    cap_radiance_free(&s.map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_point_lamp_is_placed),
        cmocka_unit_test(a_ball_lamp_is_placed),
        cmocka_unit_test(the_size_of_a_lamp),
        cmocka_unit_test(where_nothing_is_seen_nothing_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
