/* test_raster.c -- a fine mesh of a ball is measured as the ball is; its own shadow is found.
 *
 * The net has facets of 0.7 degrees: R (1 - cos(0.35 deg)) = 0.5 um within the ball.
 */
#include "near.h"
#include "raster.h"

#include <stdlib.h>

enum { AROUND = 512, UP = 256, POINTS = AROUND * (UP + 1), TRIANGLES = 2 * AROUND * UP };
static const double RADIUS = 25;
static const vec3 CENTER = {1, 2, 400};

struct scene {
    struct camera camera;
    struct view view;
    struct lamp lamp;
    struct calibration calibration;
    struct lens_table lens;
};

static void begin_scene(struct scene *s)
{
    s->camera = (struct camera){
        .name = "a", .width = 300, .height = 200, .focal = {1500, 1500}, .center = {150.3, 95.1}};
    s->view = (struct view){.name = "v", .power = 1};
    s->lamp =
        (struct lamp){.name = "l", .position = {-250, -300, 80}, .intensity = {1e5, 1e5, 1e5}};
    s->calibration =
        (struct calibration){.camera = &s->camera,
                             .view = &s->view,
                             .lamp = &s->lamp,
                             .sample = {.shape = SHAPE_SPHERE, .radius = RADIUS, .center = CENTER},
                             .cameras = 1,
                             .views = 1,
                             .lamps = 1};
    assert_int_equal(rec_lens_make(&s->lens, &s->camera, NULL), STATUS_OK);
}

// A ball as a net of meridians, and beside it (where `plate`) a square between ball and lamp.
static struct mesh *ball(bool plate)
{
    vec3 *point = malloc((POINTS + 4) * sizeof *point);
    vec3 *normal = malloc((POINTS + 4) * sizeof *normal);
    unsigned(*triangle)[3] = malloc((TRIANGLES + 2) * sizeof *triangle);
    for (int j = 0; j <= UP; j++)
        for (int i = 0; i < AROUND; i++) {
            double theta = CAP_PI * j / UP, phi = 2 * CAP_PI * i / AROUND;
            vec3 n = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            normal[j * AROUND + i] = n;
            point[j * AROUND + i] = vec3_add(CENTER, vec3_scale(n, RADIUS));
        }
    for (unsigned t = 0; t < TRIANGLES / 2; t++) {
        unsigned j = t / AROUND, i = t % AROUND, next = (i + 1) % AROUND;
        unsigned a = j * AROUND + i, b = a + AROUND, c = j * AROUND + next, d = c + AROUND;
        const unsigned both[6] = {a, b, d, a, d, c};
        for (int k = 0; k < 6; k++)
            triangle[2 * t + (unsigned)k / 3][k % 3] = both[k];
    }
    // 60 mm from the ball's middle towards the lamp, 4 mm each way.
    vec3 z = vec3_normalize(vec3_sub((vec3){-250, -300, 80}, CENTER));
    vec3 x = vec3_normalize(vec3_cross(z, (vec3){0, 0, 1})), y = vec3_cross(z, x);
    for (int k = 0; k < 4; k++) {
        double u = k == 0 || k == 3 ? -4 : 4, v = k < 2 ? -4 : 4;
        point[POINTS + k] = vec3_add(vec3_add(CENTER, vec3_scale(z, 60)),
                                     vec3_add(vec3_scale(x, u), vec3_scale(y, v)));
        normal[POINTS + k] = z;
    }
    for (int k = 0; k < 6; k++)
        triangle[TRIANGLES + k / 3][k % 3] = POINTS + (const unsigned[6]){0, 1, 2, 0, 2, 3}[k];
    struct mesh *mesh = NULL;
    assert_int_equal(cal_mesh_make(&mesh, point, normal, POINTS + (plate ? 4 : 0),
                                   (const unsigned(*)[3])triangle, TRIANGLES + (plate ? 2 : 0),
                                   NULL),
                     STATUS_OK);
    free(point);
    free(normal);
    free(triangle);
    return mesh;
}

static struct strip strip_of(const struct viewing *v, int x0, int y)
{
    struct strip s = {.x0 = x0, .y = y, .from = 0, .to = LANES};
    rec_strip_footprints(&s, v);
    return s;
}

static void see_as_mesh(struct scene *s, struct mesh *mesh, int chroma, struct viewing *v,
                        struct raster *raster)
{
    struct sample *sample = &s->calibration.sample;
    sample->shape = SHAPE_MESH;
    sample->mesh = mesh;
    cal_mesh_reach(mesh, &sample->center, &sample->radius);
    *v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    v->chroma[0] = v->chroma[1] = chroma;
    assert_int_equal(rec_raster_make(raster, v, (pixel_box){0, 0, 300, 200}, NULL), STATUS_OK);
    v->raster = raster;
}

/** A fine mesh of a ball, and the ball, seen alike. */
struct pair {
    struct scene s, t;
    struct raster raster;
    struct viewing of_ball, of_mesh;
};

static void begin_pair(struct pair *p, int chroma)
{
    p->raster = (struct raster){0};
    begin_scene(&p->s);
    begin_scene(&p->t);
    p->of_ball = rec_viewing(&p->s.calibration, 0, &p->s.lens, NULL);
    p->of_ball.chroma[0] = p->of_ball.chroma[1] = chroma;
    see_as_mesh(&p->t, ball(false), chroma, &p->of_mesh, &p->raster);
}

static void end_pair(struct pair *p)
{
    rec_raster_free(&p->raster);
    cal_mesh_free(p->t.calibration.sample.mesh);
    rec_lens_free(&p->s.lens);
    rec_lens_free(&p->t.lens);
}

// Directions as a ball's to the size of a facet, which smooth normals make second order; spreads
// and curvature to a few per cent away from the outline.
static void test_a_fine_mesh_is_measured_as_its_ball(void **state)
{
    (void)state;
    struct pair p;
    begin_pair(&p, 0);
    int used = 0, alike = 0;
    for (int y = 0; y < 200; y++)
        for (int x0 = 0; x0 < 300; x0 += LANES) {
            struct strip a = strip_of(&p.of_ball, x0, y), b = strip_of(&p.of_mesh, x0, y);
            for (int i = 0; i < LANES && x0 + i < 300; i++) {
                alike += a.fate[i] == b.fate[i];
                if (a.fate[i] != FATE_USED || b.fate[i] != FATE_USED)
                    continue;
                vec3 n = rec_lane_wide(&a.normal, i), m = rec_lane_wide(&b.normal, i);
                double cos_o = vec3_dot(n, rec_lane_wide(&a.wo, i));
                bool inner = cos_o > 0.3;
                assert_near(vec3_length(vec3_sub(n, m)), 0, inner ? 2e-4 : 3e-2);
                assert_near(b.irradiance[i] / a.irradiance[i], 1, inner ? 5e-3 : 0.5);
                assert_near(b.curvature[i] * RADIUS, 1, inner ? 0.05 : 0.5);
                if (cos_o > 0.8)
                    assert_near(b.spread[0][i] / a.spread[0][i], 1, 0.3);
                used++;
            }
        }
    assert_true(used > 10000);
    assert_true(alike > 300 * 200 - 3 * 2 * CAP_PI * 94);  // but for a ring at the outline
    end_pair(&p);
}

// Photosites that share their colour by four (JPEG 4:2:0) have a part of what lies up to 2.5 px
// away: near the outline, of 94 px radius, none is used that a ball's would not be, but for a few
// where a facet's edge stands back.
static void test_shared_colour_keeps_off_edges(void **state)
{
    (void)state;
    struct pair p;
    begin_pair(&p, 2);
    int used = 0, mixed = 0, lost = 0;
    for (int y = 0; y < 200; y++)
        for (int x0 = 0; x0 < 300; x0 += LANES) {
            struct strip a = strip_of(&p.of_ball, x0, y), b = strip_of(&p.of_mesh, x0, y);
            for (int i = 0; i < LANES && x0 + i < 300; i++) {
                used += b.fate[i] == FATE_USED;
                mixed += b.fate[i] == FATE_USED && a.fate[i] != FATE_USED;
                lost += b.fate[i] != FATE_USED && a.fate[i] == FATE_USED;
            }
        }
    assert_true(used > 9000);
    assert_true(mixed < 0.3 * 2 * CAP_PI * 94);
    assert_true(lost < 1.5 * 2 * CAP_PI * 94);
    end_pair(&p);
}

// The plate's shadow on the ball is (8 mm)^2 seen from the lamp, a little less for the lamp's
// nearness.
static void test_a_mesh_shadows_itself(void **state)
{
    (void)state;
    struct scene s;
    struct raster raster = {0};
    struct viewing v;
    begin_scene(&s);
    see_as_mesh(&s, ball(true), 0, &v, &raster);
    int shadowed = 0;
    vec3 z = vec3_normalize(vec3_sub(v.lamp_position, CENTER));
    for (int y = 0; y < 200; y++)
        for (int x0 = 0; x0 < 300; x0 += LANES) {
            struct strip a = strip_of(&v, x0, y);
            for (int i = 0; i < LANES && x0 + i < 300; i++)
                if (a.fate[i] == FATE_SHADOWED) {
                    vec3 out = vec3_sub(rec_lane(&a.point, i), CENTER);
                    if (vec3_dot(out, z) < 0.2 * RADIUS)
                        continue;  // by a facet at the terminator
                    vec3 off = vec3_sub(out, vec3_scale(z, vec3_dot(out, z)));
                    assert_true(vec3_length(off) < 1.1 * 4 * sqrt(2));  // the lamp is 500 mm away
                    shadowed++;
                }
        }
    assert_true(shadowed > 50);
    rec_raster_free(&raster);
    cal_mesh_free(s.calibration.sample.mesh);
    rec_lens_free(&s.lens);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_fine_mesh_is_measured_as_its_ball),
        cmocka_unit_test(test_shared_colour_keeps_off_edges),
        cmocka_unit_test(test_a_mesh_shadows_itself),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
