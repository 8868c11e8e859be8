/* test_checks.c -- an even sample passes; stains, grain and one-sided light are found, in size. */
#include "checks.h"
#include "made_bins.h"
#include "near.h"

#include <string.h>

enum { SHOTS = 12, PHOTOSITES = 20000 };
static const struct sample ball = {.shape = SHAPE_SPHERE, .radius = 25, .center = {0, 0, 60}};

static vec3 somewhere(int i, int k)
{
    double z = 2 * made_chance(i, k) - 1, turn = 2 * CAP_PI * made_chance(i, k + 1);
    double flat = sqrt(1 - z * z);
    return (vec3){flat * cos(turn), flat * sin(turn), z};
}

static double gauss(int i)
{
    double u = made_chance(i, 50) + 1e-12;
    return sqrt(-2 * log(u)) * cos(2 * CAP_PI * made_chance(i, 51));  // Box and Muller 1958
}

// A photosite with a random normal, wi = the normal, and wo anywhere above.
static reflectance_sample photosite(int i)
{
    reflectance_sample s = {.normal = somewhere(i, 1), .weight = 0.5, .others = 1};
    s.point = vec3_add(ball.center, vec3_scale(s.normal, ball.radius));
    s.wi = s.normal;
    s.wo = somewhere(i, 3);
    if (vec3_dot(s.wo, s.normal) < 0)
        s.wo = vec3_scale(s.wo, -1);
    return s;
}

// The azimuth of h from "across the meridian", as the photosite above has it.
static double azimuth(const reflectance_sample *s)
{
    vec3 x = vec3_cross((vec3){0, 0, 1}, s->normal), out = vec3_add(s->wi, s->wo);
    return atan2(vec3_dot(vec3_cross(x, out), s->normal), vec3_dot(x, out));
}

static struct residuals shoot(double (*pattern)(const reflectance_sample *s))
{
    struct residuals all = {0};
    for (int shot = 0; shot < SHOTS; shot++) {
        struct shot_residuals one;
        memset(&one, 0, sizeof one);
        for (int k = 0; k < PHOTOSITES; k++) {
            int i = shot * PHOTOSITES + k;
            reflectance_sample s = photosite(i);
            s.residual = 0.1 * gauss(i) + (pattern ? pattern(&s) : 0);
            rec_residual_add(&one, &s, &ball);
        }
        rec_residuals_end_shot(&all, &one);
    }
    return all;
}

// Means of cells scatter by 0.1 / sqrt(12 20000 / 96) = 0.2 %: chi^2 a cell is (n - 1)/(n - 3) for
// n = 12 shots, +- sqrt(2/96) and what so few shots add.
static void test_an_even_sample_is_even(void **state)
{
    (void)state;
    struct residuals r = shoot(NULL);
    unevenness place = rec_unevenness(r.place, PLACE_CELLS);
    unevenness grain = rec_unevenness(r.grain, GRAIN_CELLS);
    assert_int_equal(place.cells, PLACE_CELLS);
    assert_int_equal(grain.cells, GRAIN_CELLS);
    assert_near(place.chi2, 11.0 / 9, 0.5);
    assert_true(place.rms < 0.002 && grain.rms < 0.001);
    assert_near(place.sigma, 0.002 * pow(2.0 / PLACE_CELLS, 0.25), 3e-4);
}

static double stain(const reflectance_sample *s)
{
    return s->normal.z > 0 ? 0.05 : -0.05;  // an edge of cells: every cell is off by 0.05
}

static void test_a_stain_is_found_in_size(void **state)
{
    (void)state;
    struct residuals r = shoot(stain);
    unevenness place = rec_unevenness(r.place, PLACE_CELLS);
    assert_near(place.rms, 0.05, 0.001);
    assert_true(place.chi2 > 100);
    // Within a cell of azimuth both signs meet.
    assert_true(rec_unevenness(r.grain, GRAIN_CELLS).rms < 0.003);
}

// Where half of a bin is the photosite's own shot, it differs from the bin's mean by half as much,
// and where the bin is all its own it tells nothing.
static void test_a_stain_is_found_among_few_shots(void **state)
{
    (void)state;
    struct residuals all = {0};
    for (int shot = 0; shot < SHOTS; shot++) {
        struct shot_residuals one;
        memset(&one, 0, sizeof one);
        for (int k = 0; k < PHOTOSITES; k++) {
            int i = shot * PHOTOSITES + k;
            reflectance_sample s = photosite(i);
            s.others = i % 3 ? 0.5 : 0;
            s.residual = i % 3 ? 0.1 * gauss(i) + 0.5 * stain(&s) : 100;
            rec_residual_add(&one, &s, &ball);
        }
        rec_residuals_end_shot(&all, &one);
    }
    assert_near(rec_unevenness(all.place, PLACE_CELLS).rms, 0.05, 0.002);
}

static double brushed(const reflectance_sample *s)
{
    return 0.04 * cos(2 * azimuth(s));
}

// The rms of a cosine is its amplitude / sqrt(2); cells of 10 degrees blunt it by sinc(10 deg).
static void test_a_grain_is_found_in_size(void **state)
{
    (void)state;
    struct residuals r = shoot(brushed);
    unevenness grain = rec_unevenness(r.grain, GRAIN_CELLS);
    assert_near(grain.rms, 0.04 / sqrt(2), 0.001);
    assert_true(grain.rms > 10 * grain.sigma);
}

static void test_shots_in_any_order(void **state)
{
    (void)state;
    struct residuals forth = {0}, back = {0}, merged = {0}, half = {0};
    struct shot_residuals shot[3];
    memset(shot, 0, sizeof shot);
    for (int i = 0; i < 3 * PHOTOSITES; i++) {
        reflectance_sample s = photosite(i);
        s.residual = 0.1 * gauss(i);
        rec_residual_add(&shot[i % 3], &s, &ball);
    }
    for (int k = 0; k < 3; k++) {
        rec_residuals_end_shot(&forth, &shot[k]);
        rec_residuals_end_shot(&back, &shot[2 - k]);
        rec_residuals_end_shot(k == 1 ? &half : &merged, &shot[k]);
    }
    rec_residuals_merge(&merged, &half);
    assert_memory_equal(&forth, &back, sizeof forth);
    assert_memory_equal(&forth, &merged, sizeof forth);
}

static int warnings_of(const struct checks *k)
{
    struct run run;
    cap_run_begin(&run, 1, true);
    rec_checks_warn(k, &run);
    int warnings = run.warnings;
    cap_run_end(&run);
    return warnings;
}

// A dark side that shines is told where it is more than its error, by itself and beside the board.
static void test_light_on_the_dark_side_is_told(void **state)
{
    (void)state;
    const darkness dark = {0.001, 0.0002, 5}, bright = {0.02, 0.002, 5}, doubtful = {0.02, 0.01, 5};
    assert_int_equal(warnings_of(&(struct checks){.dark = {dark, dark}}), 0);
    assert_int_equal(warnings_of(&(struct checks){.dark = {bright, dark}}), 1);
    assert_int_equal(warnings_of(&(struct checks){.dark = {dark, bright}}), 1);
    assert_int_equal(warnings_of(&(struct checks){.dark = {doubtful, doubtful}}), 0);
    assert_int_equal(warnings_of(&(struct checks){.dark = {{0, NAN, 0}, {0, NAN, 0}}}), 0);
    assert_int_equal(warnings_of(&(struct checks){.excess = 0.5, .sigma_excess = 0.1}), 1);
    assert_int_equal(warnings_of(&(struct checks){.excess = 0.2, .sigma_excess = 0.1}), 0);
    assert_int_equal(warnings_of(&(struct checks){.excess = -0.5, .sigma_excess = 0.1}), 0);
}

// Half of a white table: albedo 1/2. One bin in two differs by 3 % +- 1 % when swapped.
static void test_numbers_of_made_bins(void **state)
{
    (void)state;
    const double half[] = {0.5, 0.5, 0.5};
    const struct model *lambert = rec_model_find("lambert");
    struct bins bins = made_bins(lambert, half, 101, 0);
    struct merl table = {malloc(3 * (size_t)MERL_BINS * sizeof(double))};
    struct census census = {.photosites = {[FATE_USED] = 990, [FATE_STRAY] = 10}};
    assert_non_null(table.value);
    for (size_t i = 0; i < 3 * (size_t)MERL_BINS; i++)
        table.value[i] = 0.5 / CAP_PI;
    for (int i = 0; i < bins.count; i++)
        for (int c = 0; c < 3; c++) {
            struct bin *b = &bins.bin[i];
            b->swapped[c] = i % 2 ? NAN : 0.03 * b->mean[c];
            b->swapped_noise[c] = 0.01 * b->mean[c];
            b->systematic = 0.01;
        }
    uint8_t *of_bin = malloc(MERL_BINS);
    struct checks k;
    assert_non_null(of_bin);
    memset(of_bin, BIN_EXTRAPOLATED, MERL_BINS);
    for (int i = 0; i < bins.count; i++)
        of_bin[bins.bin[i].index] = BIN_MEASURED;
    assert_int_equal(
        rec_checks(&k, &bins, &census, &table, of_bin, 0.1, &(struct surroundings){0}, NULL),
        STATUS_OK);
    assert_int_equal(k.reciprocity.bins, (bins.count + 1) / 2);
    assert_near(k.reciprocity.mean, 0.03, 1e-12);
    assert_near(k.reciprocity.typical, 0.03, 1e-12);
    assert_near(k.reciprocity.chi2, 9, 1e-9);
    assert_near(k.stray, 0.01, 1e-12);
    int measured = 0, all = 0;
    for (int i = 0; i < COVERAGE_BANDS; i++) {
        measured += k.coverage[i].measured;
        all += k.coverage[i].bins;
    }
    assert_int_equal(measured, bins.count);
    assert_int_equal(all, 1096216);  // bins above the horizon
    for (int i = 0; i < ALBEDO_ANGLES; i++) {
        const struct albedo *a = &k.albedo[i];
        double filled = a->filled[1];
        assert_near(a->value[1], 0.5, 1e-4);  // midpoint rule in half degrees
        assert_true(filled > 0 && filled <= a->value[1]);
        // Bins without noise: 1 % of what is measured and, apart from it, 10 % of what is not.
        assert_near(a->sigma[1], hypot(0.01 * (a->value[1] - filled), 0.1 * filled), 1e-9);
    }
    assert_int_equal(warnings_of(&k), 1);  // reciprocity; 1 % stray is the limit, not beyond it
    free(of_bin);
    rec_merl_free(&table);
    rec_bins_free(&bins);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_an_even_sample_is_even),
        cmocka_unit_test(test_a_stain_is_found_in_size),
        cmocka_unit_test(test_a_stain_is_found_among_few_shots),
        cmocka_unit_test(test_a_grain_is_found_in_size),
        cmocka_unit_test(test_shots_in_any_order),
        cmocka_unit_test(test_light_on_the_dark_side_is_told),
        cmocka_unit_test(test_numbers_of_made_bins),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
