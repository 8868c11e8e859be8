/* test_formats.c -- files that hold a BRDF: their readers, and the pieces these are made of. */
#include "formats.h"
#include "near.h"
#include "rgl.h"
#include "spectrum.h"
#include "sphere.h"
#include "warp.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char path[] = "test_formats.file";
static const double degree = CAP_PI / 180;

static vec3 direction(double theta_deg, double phi_deg)
{
    double t = theta_deg * degree, p = phi_deg * degree;
    return (vec3){sin(t) * cos(p), sin(t) * sin(p), cos(t)};
}

static void put(const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

static enum status read_text(struct brdf *brdf, const char *text, struct error *err)
{
    put(text, strlen(text));
    return rec_brdf_read(brdf, path, err);
}

/* ---- text --------------------------------------------------------------------------------------
 */

static struct text_row {
    const char *name, *text;
    double red, blue;  // f at theta_i 30, theta_o 30, the mirror side
} texts[] = {
    {"six columns", "30 30 180 0.5 0.6 0.7\n0 60 0 0.1 0.1 0.1\n", 0.5, 0.7},
    {"seven columns, commas", "# azimuths\n30,10,30,190,0.5,0.6,0.7\n", 0.5, 0.7},
    {"named columns", "id, r, g, b, theta_i, theta_o, phi\n1, 0.5, 0.6, 0.7, 30, 30, 180\n", 0.5,
     0.7},
    {"half angles", "theta_h theta_d phi_d f\n0 30 77 0.5\n60 10 0 9\n", 0.5, 0.5},
    {"model", "{\"model\": \"lambert\", \"parameters\": {\"albedo\": [0.1, 0.2, 0.3]}}",
     0.1 / CAP_PI, 0.3 / CAP_PI},
    {"fits", "models:\n- {name: lambert, parameters: {albedo: {value: [0.1, 0.2, 0.3]}}}\n",
     0.1 / CAP_PI, 0.3 / CAP_PI},
    // Flat over the wavelengths: grey. Radians.
    {"Cornell", "3\n450 550 650 # nm\n0.5235987756 0 0.5235987756 3.141592654 0.5 0.5 0.5\n", 0.5,
     0.5},
    {"Cornell in degrees", "1\n550\n30 0 30 180 0.5\n80 0 10 0 0.1", 0.5, 0.5},
};
enum { TEXTS = sizeof texts / sizeof *texts };

static void test_text(void **state)
{
    const struct text_row *row = *state;
    struct brdf brdf = {0};
    double f[3];
    assert_int_equal(read_text(&brdf, row->text, NULL), STATUS_OK);
    rec_brdf_eval(&brdf, direction(30, 0), direction(30, 180), f);
    assert_near(f[0], row->red, 1e-6);
    assert_near(f[2], row->blue, 1e-6);
    rec_brdf_free(&brdf);
    unlink(path);
}

static struct bad_row {
    const char *name, *text, *told;
} bad[] = {
    {"prose", "hello\n", "no BRDF"},
    {"nothing", "", "no BRDF"},
    {"five numbers", "1 2 3 4 5\n", "no BRDF"},
    {"a short line", "30 30 180 1 1 1\n30 30 180 1 1\n", "line 2"},
    {"a word", "30 30 180 1 1 1\n30 30 180 1 x 1\n", "line 2"},
    {"below the horizon", "30 100 180 1 1 1\n", "horizon"},
    {"a torn table", "2\n500 600\n0.1 0 0.1 3 1\n", "2 wavelengths"},
    {"descending wavelengths", "2\n600 500\n0.1 0 0.1 3 1 1\n", "ascend"},
    {"no such model", "{\"model\": \"glass\", \"parameters\": {}}", "glass"},
    {"a missing parameter", "{\"model\": \"ggx\", \"parameters\": {\"alpha\": 0.1}}", "albedo"},
    {"a collection", "{\"sgd\": {}}", "#sgd/NAME"},
    {"not JSON", "{\"model\": ", "JSON"},
};
enum { BAD = sizeof bad / sizeof *bad };

static void test_bad_text(void **state)
{
    const struct bad_row *row = *state;
    struct brdf brdf = {0};
    struct error err = {0};
    assert_int_equal(read_text(&brdf, row->text, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, row->told));
    assert_non_null(strstr(err.text, path));
    assert_null(brdf.model);
    assert_null(brdf.kind);
    unlink(path);
}

static void test_collection_by_name(void **state)
{
    (void)state;
    struct brdf brdf = {0};
    struct error err = {0};
    double f[3];
    const char text[] = "{\"lambert\": {\"chalk\": {\"albedo\": [0.9, 0.9, 0.8]}}}";
    put(text, strlen(text));
    assert_int_equal(rec_brdf_read(&brdf, "test_formats.file#lambert/chalk", &err), STATUS_OK);
    rec_brdf_eval(&brdf, direction(0, 0), direction(10, 0), f);
    assert_near(f[2], 0.8 / CAP_PI, 1e-15);
    rec_brdf_free(&brdf);
    assert_int_equal(rec_brdf_read(&brdf, "test_formats.file#lambert/cheese", &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "cheese"));
    unlink(path);
}

// A plane of the four coordinates stays close to itself between measurements.
static void test_scattered_measurements_are_met(void **state)
{
    (void)state;
    struct brdf brdf = {0};
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    for (int i = 0; i < 18; i++)
        for (int o = 0; o < 18; o++)
            for (int p = 0; p <= 12; p++)
                fprintf(file, "%d %d %d %g 1 1\n", 5 * i, 5 * o, 15 * p, 1 + 0.01 * (i + o));
    fclose(file);
    assert_int_equal(rec_brdf_read(&brdf, path, NULL), STATUS_OK);
    for (int i = 1; i < 17; i++)
        for (int o = 1; o < 17; o++) {
            double f[3];
            rec_brdf_eval(&brdf, direction(5 * i, 20), direction(5 * o, 80), f);
            assert_near(f[0], 1 + 0.01 * (i + o), 1e-6);
            rec_brdf_eval(&brdf, direction(5 * i + 2, 0), direction(5 * o + 2, 51), f);
            assert_near(f[0], 1 + 0.01 * (i + o + 0.8), 0.02);  // a fifth of a step's neighbours
            assert_near(f[1], 1, 1e-9);
        }
    rec_brdf_free(&brdf);
    unlink(path);
}

/* ---- MIT ----------------------------------------------------------------------------------------
 */

// Red is 1 + theta_in's step at one turn of the sample, unmeasured at the other two.
static void test_mit_table(void **state)
{
    (void)state;
    enum { IN = 9, OUT = 6, DIFF = 12, TURNS = 3, COUNT = IN * OUT * DIFF * TURNS };
    int32_t header[16] = {IN, OUT, DIFF, TURNS, 0, 0, 1, 0, 0, 1, 3};
    struct {
        int32_t header[16];
        float value[3 * COUNT];
    } *file = calloc(1, sizeof *file);
    assert_non_null(file);
    memcpy(file->header, header, sizeof header);
    for (int i = 0; i < 3 * COUNT; i++)
        file->value[i] = i % TURNS == 1 ? (float)(1 + i % COUNT / (OUT * DIFF * TURNS)) : -1;
    put(file, sizeof *file);
    struct brdf brdf = {0};
    double f[3];
    assert_int_equal(rec_brdf_read(&brdf, path, NULL), STATUS_OK);
    rec_brdf_eval(&brdf, direction(25, 0), direction(40, 100), f);  // the middle of step 2
    assert_near(f[0], 3, 1e-6);
    rec_brdf_eval(&brdf, direction(30, 5), direction(70, 300), f);  // half way to step 3
    assert_near(f[1], 3.5, 1e-6);
    rec_brdf_free(&brdf);
    struct error err = {0};
    put(file, sizeof *file - 4);
    assert_int_equal(rec_brdf_read(&brdf, path, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "cut short"));
    free(file);
    unlink(path);
}

/* ---- RGL ----------------------------------------------------------------------------------------
 */

static void test_warp_there_and_back(void **state)
{
    (void)state;
    enum { W = 5, H = 4 };
    float value[2][H * W];
    const float zero[1] = {0}, place[2] = {0, 1};
    for (int i = 0; i < 2 * H * W; i++)
        value[i / (H * W)][i % (H * W)] = (float)(1 + (i * 7) % 5);
    struct warp warp = {0};
    assert_int_equal(rec_warp_make(&warp, value[0], W, H, (const int[2]){1, 2},
                                   (const float *const[2]){zero, place}, true, NULL),
                     STATUS_OK);
    double sum = 0;
    struct blend at = rec_warp_blend(&warp, (const double[2]){0, 0.3});
    for (int i = 0; i < 50; i++)
        for (int j = 0; j < 50; j++) {
            double u[2] = {(i + 0.5) / 50, (j + 0.5) / 50}, p[2], back[2];
            rec_warp_sample(&warp, &at, u, p);
            rec_warp_invert(&warp, &at, p, back);
            assert_near(back[0], u[0], 1e-12);
            assert_near(back[1], u[1], 1e-12);
            sum += rec_warp_eval(&warp, &at, u) / 2500;
        }
    assert_near(sum, 1, 0.01);  // the midpoint rule across kinks, 1/50 of a patch
    // Its density is what the map does to areas.
    double u[2] = {0.4, 0.6}, right[2] = {0.4 + 1e-6, 0.6}, up[2] = {0.4, 0.6 + 1e-6}, p[2], q[2],
           r[2];
    rec_warp_sample(&warp, &at, u, p);
    rec_warp_sample(&warp, &at, right, q);
    rec_warp_sample(&warp, &at, up, r);
    double area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    assert_near(rec_warp_eval(&warp, &at, p) * area, 1e-12, 1e-17);
    rec_warp_free(&warp);
}

static void test_empty_densities_are_refused(void **state)
{
    (void)state;
    const float zero[4] = {0}, negative[4] = {1, 1, -1, 1};
    struct warp warp = {0};
    assert_int_equal(rec_warp_make(&warp, zero, 2, 2, (const int[2]){1, 1},
                                   (const float *const[2]){zero, zero}, true, NULL),
                     STATUS_DATA);
    assert_int_equal(rec_warp_make(&warp, negative, 2, 2, (const int[2]){1, 1},
                                   (const float *const[2]){zero, zero}, true, NULL),
                     STATUS_DATA);
    assert_null(warp.value);
}

static void test_rgl_files_come_back(void **state)
{
    (void)state;
    struct brdf brdf = {.model = rec_model_find("ggx"), .value = {0.3, 0.2, 0.1, 0.2, 1.5}};
    struct run run;
    cap_run_begin(&run, 2, true);
    struct error err = {0};
    rec_rgl_write(&brdf, "test_formats", &run, &err);
    assert_string_equal(err.text, "");
    cap_run_end(&run);
    const char *names[2] = {"test_formats_rgb.bsdf", "test_formats_spec.bsdf"};
    for (int k = 0; k < 2; k++) {
        struct brdf back = {0};
        assert_int_equal(rec_brdf_read(&back, names[k], NULL), STATUS_OK);
        for (int i = 0; i < 60; i++) {
            double f[3], g[3];
            vec3 wi = direction(70.0 * (i % 7) / 6, 11 * i),
                 wo = direction(70.0 * (i % 9) / 8, 47 * i);
            rec_brdf_eval(&brdf, wi, wo, f);
            rec_brdf_eval(&back, wi, wo, g);
            for (int c = 0; c < 3; c++)
                assert_near(g[c], f[c], 0.03 * f[c]);
        }
        rec_brdf_free(&back);
    }
    // Any part of it is told apart from all of it.
    FILE *file = fopen(names[0], "r+b");
    assert_non_null(file);
    for (long size = 100000; size > 0; size /= 3) {
        struct brdf back = {0};
        assert_int_equal(ftruncate(fileno(file), size), 0);
        assert_int_equal(rec_brdf_read(&back, names[0], NULL), STATUS_FORMAT);
    }
    fclose(file);
    unlink(names[0]);
    unlink(names[1]);
}

/* ---- colour -------------------------------------------------------------------------------------
 */

static void test_spectra_keep_their_color(void **state)
{
    (void)state;
    static const double colors[][3] = {
        {1, 1, 1}, {0.2, 0.5, 0.1}, {0.9, 0.1, 0.02}, {0, 0, 1}, {1, 0.8, 0}};
    double wavelength[SPECTRUM_SIZE], weight[SPECTRUM_SIZE][3], spectrum[SPECTRUM_SIZE];
    for (int i = 0; i < SPECTRUM_SIZE; i++)
        wavelength[i] = rec_spectrum_wavelength(i);
    rec_spectrum_weights(weight, wavelength, SPECTRUM_SIZE);
    for (size_t k = 0; k < sizeof colors / sizeof *colors; k++) {
        double rgb[3] = {0, 0, 0};
        rec_spectrum_of_rgb(spectrum, colors[k]);
        for (int i = 0; i < SPECTRUM_SIZE; i++) {
            assert_true(spectrum[i] >= 0);
            if (k == 0)
                assert_near(spectrum[i], 1, 1e-9);
            for (int c = 0; c < 3; c++)
                rgb[c] += weight[i][c] * spectrum[i];
        }
        for (int c = 0; c < 3; c++)
            assert_near(rgb[c], colors[k][c], 1e-9);
    }
}

static double lab_inverse(double f)
{
    return f > 6.0 / 29 ? f * f * f : 3 * (6.0 / 29) * (6.0 / 29) * (f - 4.0 / 29);
}

// Linear sRGB of L*, a*, b*, with the matrix of IEC 61966-2-1.
static void rgb_of_lab(const double lab[3], double rgb[3])
{
    static const double m[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                   {-0.9692660, 1.8760108, 0.0415560},
                                   {0.0556434, -0.2040259, 1.0572252}};
    double y = (lab[0] + 16) / 116;
    double xyz[3] = {0.95047 * lab_inverse(y + lab[1] / 500), lab_inverse(y),
                     1.08883 * lab_inverse(y - lab[2] / 200)};
    for (int c = 0; c < 3; c++)
        rgb[c] = m[c][0] * xyz[0] + m[c][1] * xyz[1] + m[c][2] * xyz[2];
}

// Pairs 1, 7, 11, 17 and 25 of the table in Sharma, Wu and Dalal 2005.
static void test_color_difference_is_the_published_one(void **state)
{
    (void)state;
    static const double pairs[][7] = {
        {50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425},
        {50, 0, 0, 50, -1, 2, 2.3669},
        {50, 2.4900, -0.0010, 50, -2.4900, 0.0011, 7.2195},
        {50, 2.5, 0, 73, 25, -18, 27.1492},
        {60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        double a[3], b[3];
        rgb_of_lab(pairs[i], a);
        rgb_of_lab(pairs[i] + 3, b);
        assert_near(rec_delta_e(a, b), pairs[i][6], 1e-3);  // the matrices are rounded to 7 digits
    }
}

// f = 1/pi: linear radiance is the cosine of the lamp. Black against it has the mean square of
// that.
static void test_sphere_of_chalk(void **state)
{
    (void)state;
    float *chalk = malloc(2 * 3 * SPHERE_SIZE * SPHERE_SIZE * sizeof *chalk);
    float *black = chalk + 3 * SPHERE_SIZE * SPHERE_SIZE;
    assert_non_null(chalk);
    struct brdf white = {.model = rec_model_find("lambert"), .value = {1, 1, 1}};
    struct brdf none = {.model = rec_model_find("lambert"), .value = {0, 0, 0}};
    rec_lit_sphere(chalk, &white, 2);
    rec_lit_sphere(black, &none, 2);
    int middle = 3 * (SPHERE_SIZE / 2 * SPHERE_SIZE + SPHERE_SIZE / 2);
    assert_near(chalk[middle], cos(30 * degree), 0.005);  // half a pixel off the middle
    struct picture_errors errors;
    assert_int_equal(rec_sphere_compare(&errors, chalk, black, NULL), STATUS_OK);
    double square = 0;
    int n = 0;
    for (int i = 0; i < SPHERE_SIZE * SPHERE_SIZE; i++)
        if (rec_on_sphere(i % SPHERE_SIZE, i / SPHERE_SIZE)) {
            square += (double)chalk[3 * i] * (double)chalk[3 * i];
            n++;
        }
    assert_near(errors.psnr, -10 * log10(square / n), 1e-9);
    assert_int_equal(rec_sphere_compare(&errors, chalk, chalk, NULL), STATUS_OK);
    assert_true(isinf(errors.psnr));
    assert_near(errors.delta_e, 0, 1e-12);
    free(chalk);
}

int main(void)
{
    struct CMUnitTest tests[TEXTS + BAD + 16];
    int n = 0;
    for (int i = 0; i < TEXTS; i++)
        tests[n++] = (struct CMUnitTest){texts[i].name, test_text, NULL, NULL, &texts[i]};
    for (int i = 0; i < BAD; i++)
        tests[n++] = (struct CMUnitTest){bad[i].name, test_bad_text, NULL, NULL, &bad[i]};
    const struct CMUnitTest others[] = {
        cmocka_unit_test(test_collection_by_name),
        cmocka_unit_test(test_scattered_measurements_are_met),
        cmocka_unit_test(test_mit_table),
        cmocka_unit_test(test_warp_there_and_back),
        cmocka_unit_test(test_empty_densities_are_refused),
        cmocka_unit_test(test_rgl_files_come_back),
        cmocka_unit_test(test_spectra_keep_their_color),
        cmocka_unit_test(test_color_difference_is_the_published_one),
        cmocka_unit_test(test_sphere_of_chalk),
    };
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        tests[n++] = others[i];
    return _cmocka_run_group_tests("formats", tests, (size_t)n, NULL, NULL);
}
