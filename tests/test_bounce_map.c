/* test_bounce_map.c -- a matt ball over an evenly lit sheet, in closed form.
 *
 * J. H. Lambert, "Photometria", 1760: a polygon of radiance B, seen whole from a point, brings a
 * surface with the normal n the irradiance B/2 sum of (the angle of each edge) times (the normal of
 * the plane through edge and point) . n.
 */
#include "bounce_map.h"
#include "consensus.h"
#include "near.h"
#include "sample_at.h"
#include "surface.h"

#include <stdlib.h>
#include <string.h>

enum { CELLS = 60, WIDTH = 120, HEIGHT = 100 };
static const double side = 60, glowing = 0.7;

struct scene {
    struct camera camera;
    struct view view;
    struct lamp lamp;
    struct calibration calibration;
    struct lens_table lens;
    struct lookup *table;
    struct consensus known;
};

static struct lookup *table_of(const struct brdf *brdf)
{
    struct merl merl = {0};
    struct lookup *table = NULL;
    assert_int_equal(rec_brdf_table(&merl, brdf, 2, NULL), STATUS_OK);
    assert_int_equal(rec_lookup_make(&table, &merl, NULL), STATUS_OK);
    rec_merl_free(&merl);
    return table;
}

static struct scene *make_scene(void)
{
    struct scene *s = calloc(1, sizeof *s);
    s->camera = (struct camera){
        .name = "a", .width = WIDTH, .height = HEIGHT, .focal = {700, 700}, .center = {60, 50}};
    // The camera at (0, -400, 60) looks along y, with z up.
    s->view = (struct view){
        .name = "v", .power = 1.25, .view_from_world = {{CAP_PI / 2, 0, 0}, {0, 60, 400}}};
    s->lamp = (struct lamp){.name = "l", .position = {0, -500, 500}, .intensity = {1, 1, 1}};
    s->calibration = (struct calibration){
        .camera = &s->camera,
        .view = &s->view,
        .lamp = &s->lamp,
        .sample = {.shape = SHAPE_SPHERE, .radius = 25, .center = {0, 0, 60}},
        .cameras = 1,
        .views = 1,
        .lamps = 1,
        .surroundings = {.strength = 0.8, .count = CELLS * CELLS},
    };
    struct glow *glow = calloc(CELLS * CELLS, sizeof *glow);
    for (int i = 0; i < CELLS * CELLS; i++) {
        double cell = side / CELLS;
        int row = i / CELLS;
        glow[i] = (struct glow){
            .point = {(i % CELLS + 0.5) * cell - side / 2, (row + 0.5) * cell - side / 2, 0},
            .normal = {0, 0, 1},
            .x = {1, 0, 0},
            .side = cell,
            .radiance = {glowing, glowing / 2, 0}};
    }
    s->calibration.surroundings.glow = glow;
    const struct brdf matt = {.model = rec_model_find("lambert"), .value = {0.6, 0.6, 0.6}};
    s->table = table_of(&matt);
    assert_int_equal(rec_lens_make(&s->lens, &s->camera, NULL), STATUS_OK);
    return s;
}

static void free_scene(struct scene *s)
{
    rec_lens_free(&s->lens);
    rec_lookup_free(s->table);
    free(s->calibration.surroundings.glow);
    free(s);
}

// false: the sheet is not whole above the horizon.
static bool lambert_irradiance(vec3 p, vec3 n, double *irradiance)
{
    vec3 r[4];
    *irradiance = 0;
    for (int k = 0; k < 4; k++) {
        vec3 corner = {(k == 1 || k == 2 ? 0.5 : -0.5) * side, (k >= 2 ? 0.5 : -0.5) * side, 0};
        r[k] = vec3_normalize(vec3_sub(corner, p));
        if (vec3_dot(r[k], n) <= 0)
            return false;
    }
    for (int k = 0; k < 4; k++) {
        vec3 edge = vec3_cross(r[k], r[(k + 1) % 4]);
        double angle = atan2(vec3_length(edge), vec3_dot(r[k], r[(k + 1) % 4]));
        *irradiance += glowing / 2 * angle * vec3_dot(vec3_normalize(edge), n);
    }
    *irradiance = fabs(*irradiance);
    return true;
}

// L = albedo/pi E, times power and strength. Cells are 1 mm and at least 35 mm away: the midpoint
// rule errs by (1/35)^2/24 of curvatures of some units, the grid by (step/width)^2 likewise.
static void test_a_sheet_lights_a_ball(void **state)
{
    (void)state;
    struct scene *s = make_scene();
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    struct bounce_map map;
    int compared = 0, grazing = 0;
    v.table = s->table;
    assert_int_equal(rec_bounce_make(&map, &s->calibration, 0, &v, rec_sample_box(&v), NULL),
                     STATUS_OK);
    for (int y = map.box.y0; y < map.box.y1; y++)
        for (int x = map.box.x0; x < map.box.x1; x++) {
            sight a;
            double irradiance, pixel[2] = {x, y};
            vec3 ray = mat3_mul_t(&v.view_from_world, cal_ray(&s->camera, pixel));
            meeting m = rec_meet(v.sample, v.eye, ray);
            if (!m.hit || !lambert_irradiance(m.point, m.normal, &irradiance))
                continue;
            a = (sight){.point = m.point, .normal = m.normal, .wo = vec3_scale(ray, -1)};
            const struct bounced_light light = rec_bounce_at(&map, &a, x, y);
            const double *radiance = light.radiance;
            double due = 0.6 / CAP_PI * irradiance * 1.25 * 0.8;
            assert_near(radiance[0], due, 0.01 * due);
            assert_near(radiance[1], radiance[0] / 2, 1e-12);
            assert_near(radiance[2], 0, 0);
            assert_near(light.doubt, 0, 1e-6);  // cells are all alike
            compared++;
            grazing += -vec3_dot(ray, m.normal) < 0.35;
        }
    assert_true(compared - grazing > 100 && grazing > 100);
    rec_bounce_free(&map);
    free_scene(s);
}

// The same of a glossy ball, whose lobe is narrow, under a lamp of 1e4.
static struct scene *make_glossy_scene(void)
{
    struct scene *s = make_scene();
    const struct brdf glossy = {.model = rec_model_find("ggx"),
                                .value = {0.02, 0.02, 0.02, 0.1, 1.5}};
    rec_lookup_free(s->table);
    s->table = table_of(&glossy);
    for (int c = 0; c < 3; c++)
        s->lamp.intensity[c] = 1e4;
    return s;
}

// What a narrow lobe mirrors of the sheet and its edge changes within a few photosites: the map
// between its nodes is the sum at each photosite, to 1 % of it where an f of 0.1 % reflectance
// would be seen beside it.
static void test_the_edge_of_a_sheet_in_a_narrow_lobe(void **state)
{
    (void)state;
    struct scene *s = make_glossy_scene();
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    struct bounce_map map;
    int compared = 0;
    v.table = s->table;
    assert_int_equal(rec_bounce_make(&map, &s->calibration, 0, &v, rec_sample_box(&v), NULL),
                     STATUS_OK);
    for (int y = map.box.y0; y < map.box.y1; y++)
        for (int x = map.box.x0; x < map.box.x1; x++) {
            double pixel[2] = {x, y};
            vec3 ray = mat3_mul_t(&v.view_from_world, cal_ray(&s->camera, pixel));
            meeting m = rec_meet(v.sample, v.eye, ray);
            if (!m.hit)
                continue;
            sight a = {.point = m.point, .normal = m.normal, .wo = vec3_scale(ray, -1)};
            const struct bounced_light light = rec_bounce_at(&map, &a, x, y);
            const struct bounced_light due =
                rec_bounce_sum(&map.through, s->calibration.surroundings.glow, CELLS * CELLS,
                               m.point, m.normal, a.wo);
            double radiance = due.radiance[0] * 1.25 * 0.8;
            // 1e4 / 660^2 of irradiance, 1e-3 / pi of f.
            double faint = 1e-3 / CAP_PI * 1e4 / (660.0 * 660.0);
            assert_near(light.radiance[0], radiance, 0.01 * (radiance + faint));
            compared += radiance > 10 * faint;
        }
    assert_true(compared > 1000);
    rec_bounce_free(&map);
    free_scene(s);
}

/** The sum at a place of the image. False: the ball is not seen there. */
static bool sum_at(const struct scene *s, const struct bounce_map *map, double x, double y,
                   sight *a, double *radiance)
{
    const struct viewing *v = map->viewing;
    const double pixel[2] = {x, y};
    vec3 ray = mat3_mul_t(&v->view_from_world, cal_ray(&s->camera, pixel));
    meeting m = rec_meet(v->sample, v->eye, ray);
    *a = (sight){m.point, m.normal, vec3_scale(ray, -1)};
    if (!m.hit || vec3_dot(a->normal, a->wo) < 0.05)
        return false;
    *radiance = rec_bounce_sum(&map->through, s->calibration.surroundings.glow, CELLS * CELLS,
                               a->point, a->normal, a->wo)
                    .radiance[0]
                * 1.25 * 0.8;
    return true;
}

/** The mean of that over a lens's Gaussian and the photosite, by a Gaussian of their variance. */
static bool mean_at(const struct scene *s, const struct bounce_map *map, int x, int y, double *mean)
{
    enum { SIDE = 5 };  // steps of half a sigma: what lies beyond is 1 % of it
    const double blur = s->view.blur_px, step = 0.5 * sqrt(blur * blur + 1.0 / 12);
    double sum = 0, weights = 0;
    for (int j = -SIDE; j <= SIDE; j++)
        for (int i = -SIDE; i <= SIDE; i++) {
            double w = exp(-0.125 * (i * i + j * j)), radiance;
            sight unused;
            if (!sum_at(s, map, x + i * step, y + j * step, &unused, &radiance))
                return false;
            sum += w * radiance;
            weights += w;
        }
    *mean = sum / weights;
    return true;
}

// A soft lens mixes what a narrow lobe mirrors of the sheet, brighter and brighter towards the
// outline: what lies beside a photosite tells most of it.
static void test_a_photosite_sees_the_mean(void **state)
{
    (void)state;
    struct scene *s = make_glossy_scene();
    s->view.blur_px = 0.8;
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    struct bounce_map map;
    double left = 0, all = 0;
    int compared = 0, differ = 0;
    v.table = s->table;
    assert_int_equal(rec_bounce_make(&map, &s->calibration, 0, &v, rec_sample_box(&v), NULL),
                     STATUS_OK);
    for (int y = map.box.y0; y < map.box.y1; y += 3)
        for (int x = map.box.x0; x < map.box.x1; x += 11) {
            double middle, mean, faint = 1e-3 / CAP_PI * 1e4 / (660.0 * 660.0);
            sight a;
            if (!sum_at(s, &map, x, y, &a, &middle) || !mean_at(s, &map, x, y, &mean))
                continue;
            double seen = rec_bounce_seen(&map, &a, x, y).radiance[0];
            assert_near(seen, mean, 0.5 * fabs(middle - mean) + 0.015 * (mean + faint));
            left += fabs(seen - mean);
            all += fabs(middle - mean);
            differ += fabs(middle - mean) > 0.03 * (mean + faint);
            compared++;
        }
    assert_true(compared > 50);
    assert_true(differ > 5);
    assert_true(left < 0.2 * all);
    rec_bounce_free(&map);
    free_scene(s);
}

static void test_no_surroundings_no_light(void **state)
{
    (void)state;
    struct scene *s = make_scene();
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    struct bounce_map map;
    sight a = {.point = {0, -25, 60}, .normal = {0, -1, 0}, .wo = {0, -1, 0}};
    s->calibration.surroundings.strength = 0;  // direct light alone, as the night side told
    v.table = s->table;
    assert_int_equal(rec_bounce_make(&map, &s->calibration, 0, &v, rec_sample_box(&v), NULL),
                     STATUS_OK);
    const struct bounced_light light = rec_bounce_at(&map, &a, 60, 50);
    for (int c = 0; c < 3; c++)
        assert_near(light.radiance[c], 0, 0);
    rec_bounce_free(&map);
    free_scene(s);
}

// Where the board's light is uncertain by more than 0.3 of f nothing is measured: 1 % of a light
// that is a tenth of all harms nothing, a hundred times it does.
static void test_too_much_of_it_is_no_measurement(void **state)
{
    (void)state;
    struct scene *s = make_scene();
    for (int c = 0; c < 3; c++)
        s->lamp.intensity[c] = 1e5;  // f is 2 or so
    struct viewing v = rec_viewing(&s->calibration, 0, &s->lens, NULL);
    struct bounce_map bounce;
    struct radiance map = {.width = WIDTH, .height = HEIGHT, .channels = 3};
    map.value = malloc(3 * WIDTH * HEIGHT * sizeof *map.value);
    map.variance = malloc(3 * WIDTH * HEIGHT * sizeof *map.variance);
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        map.value[i] = 1;
        map.variance[i] = 1e-6F;
    }
    s->known.slot = calloc(MERL_BINS, sizeof *s->known.slot);
    v.consensus = &s->known;
    v.table = s->table;
    assert_int_equal(rec_bounce_make(&bounce, &s->calibration, 0, &v, rec_sample_box(&v), NULL),
                     STATUS_OK);
    v.bounce = &bounce;
    int count[FATES] = {0};
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            reflectance_sample calm, wild;
            bool hit;
            v.bounce_scatter = 0.01;
            enum fate before = sample_at(&calm, &v, &map, x, y, &hit);
            v.bounce_scatter = 100;
            enum fate after = sample_at(&wild, &v, &map, x, y, &hit);
            count[after]++;
            assert_int_not_equal(before, FATE_BOUNCED);
            if (before != FATE_USED)
                continue;
            double mean = (calm.bounced[0] + calm.bounced[1] + calm.bounced[2]) / 3;
            assert_int_equal(after, 100 * mean > 0.3 ? FATE_BOUNCED : FATE_USED);
        }
    assert_true(count[FATE_BOUNCED] > 50 && count[FATE_USED] > 50);
    rec_bounce_free(&bounce);
    cap_radiance_free(&map);
    free(s->known.slot);
    free_scene(s);
}

/** An even sheet of n x n cells, or a board of stripes of cells. */
static struct glow *make_cells(int n, bool stripes)
{
    struct glow *cell = calloc((size_t)(n * n), sizeof *cell);
    for (int i = 0; i < n * n; i++) {
        int row = i / n;
        double bright = stripes && row % 2 ? 0 : glowing, s = side / n;
        cell[i] =
            (struct glow){.point = {(i % n + 0.5) * s - side / 2, (row + 0.5) * s - side / 2, 0},
                          .normal = {0, 0, 1},
                          .x = {1, 0, 0},
                          .side = s,
                          .radiance = {bright, bright, bright}};
    }
    return cell;
}

// A lobe narrower than a cell looks from here: the sum is that of cells of an eighth, wherever the
// mirror direction meets a cell. A sheet that differs from cell to cell leaves the more doubt the
// fewer cells the lobe sees.
static void test_cells_wider_than_the_lobe(void **state)
{
    (void)state;
    const struct brdf brdf = {.model = rec_model_find("ggx"), .value = {0.1, 0.1, 0.1, 0.05, 1.5}};
    const struct brdf matt = {.model = rec_model_find("lambert"), .value = {0.6, 0.6, 0.6}};
    struct lookup *table = table_of(&brdf), *even = table_of(&matt);
    const struct bounce_through narrow = rec_bounce_through(table);
    const struct bounce_through wide = rec_bounce_through(even);
    struct glow *coarse = make_cells(10, false), *fine = make_cells(80, false);
    struct glow *stripes = make_cells(10, true);
    // GGX falls to half where (1 + tan^2/alpha^2)^2 = 2, but for the matte part and shadowing.
    assert_near(narrow.gloss, 0.05 * sqrt(sqrt(2) - 1), 0.05 * 0.1);
    assert_near(wide.gloss, CAP_PI / 2, 0);
    for (int k = 0; k < 5; k++) {
        vec3 point = {1.3 * k - 2, 0.7 * k, 30}, n = vec3_normalize((vec3){0, -1, -1});
        vec3 wo = vec3_normalize((vec3){0.02 * k, -1, 0.01 * k});
        struct bounced_light a = rec_bounce_sum(&narrow, coarse, 100, point, n, wo);
        struct bounced_light b = rec_bounce_sum(&narrow, fine, 6400, point, n, wo);
        assert_near(a.radiance[1] / b.radiance[1], 1, 0.01);
        struct bounced_light few = rec_bounce_sum(&narrow, stripes, 100, point, n, wo);
        struct bounced_light many = rec_bounce_sum(&wide, stripes, 100, point, n, wo);
        assert_true(few.doubt > 0.1 && few.doubt < 1);
        assert_true(many.doubt > 0.01 && many.doubt < 0.5 * few.doubt);
    }
    free(coarse);
    free(fine);
    free(stripes);
    rec_lookup_free(table);
    rec_lookup_free(even);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_sheet_lights_a_ball),
        cmocka_unit_test(test_the_edge_of_a_sheet_in_a_narrow_lobe),
        cmocka_unit_test(test_a_photosite_sees_the_mean),
        cmocka_unit_test(test_no_surroundings_no_light),
        cmocka_unit_test(test_too_much_of_it_is_no_measurement),
        cmocka_unit_test(test_cells_wider_than_the_lobe),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
