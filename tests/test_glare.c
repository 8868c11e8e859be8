/* Glare: a scene is veiled photosite by photosite, by the kernels' definition; taking the veil off
 * gives the scene back. */
#include "glare.h"
#include "near.h"

#include <stdlib.h>
#include <unistd.h>

enum { WIDTH = 150, HEIGHT = 100, COUNT = 3 * WIDTH * HEIGHT };

static float truth[COUNT], value[COUNT], variance[COUNT];
static struct radiance map = {
    .width = WIDTH, .height = HEIGHT, .channels = 3, .value = value, .variance = variance};

/* A bright sheet on the left, a dark ball on its right, nothing about them; channels differ. */
static void make_scene(void)
{
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            bool sheet = x > 15 && x < 80 && y > 12 && y < 90;
            bool ball = hypot(x - 100, y - 50) < 25;
            double v = ball ? 0.05 : sheet ? 1 - 0.004 * x : 0.002;
            for (int c = 0; c < 3; c++)
                truth[3 * (y * WIDTH + x) + c] = (float)(v * (1 - 0.3 * c));
        }
}

/* Weights of a Gaussian of `sigma` photosites about `at`, within the image: they add up to 1. */
static void gaussian(double *weight, int count, int at, double sigma)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += weight[i] = exp(-0.5 * (i - at) * (i - at) / (sigma * sigma));
    for (int i = 0; i < count; i++)
        weight[i] /= sum;
}

static void gaussian_mean(double mean[3], int x, int y, double sigma)
{
    double along[WIDTH], down[HEIGHT];
    gaussian(along, WIDTH, x, sigma);
    gaussian(down, HEIGHT, y, sigma);
    mean[0] = mean[1] = mean[2] = 0;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++)
            for (int c = 0; c < 3; c++)
                mean[c] += down[v] * along[u] * (double)truth[3 * (v * WIDTH + u) + c];
}

static double even_mean(int c)
{
    double sum = 0;
    for (int i = c; i < COUNT; i += 3)
        sum += (double)truth[i];
    return 3 * sum / COUNT;
}

static void veil_evenly(double share)
{
    make_scene();
    for (int i = 0; i < COUNT; i++) {
        value[i] = (float)((1 - share) * (double)truth[i] + share * even_mean(i % 3));
        variance[i] = 1e-8f;
    }
}

static void test_an_even_veil_is_taken_off(void **state)
{
    (void)state;
    const double share[GLARE_TERMS] = {0.02};
    veil_evenly(0.02);
    assert_int_equal(cap_glare_remove(&map, share, 0, NULL), STATUS_OK);
    for (int i = 0; i < COUNT; i++)
        assert_near(value[i], truth[i], 1e-6);  // rounding of float
}

static void test_doubt_goes_into_the_variance(void **state)
{
    (void)state;
    const double share[GLARE_TERMS] = {0.02};
    veil_evenly(0.02);
    assert_int_equal(cap_glare_remove(&map, share, 0.002, NULL), STATUS_OK);
    for (int i = 0; i < COUNT; i += 997) {
        double veil = 0.02 * even_mean(i % 3);
        double due = (1e-8 + pow(0.1 * veil, 2)) / (0.98 * 0.98);
        assert_near(variance[i] / due, 1, 1e-4);
    }
}

static void test_what_was_not_measured_stays_so(void **state)
{
    (void)state;
    const double share[GLARE_TERMS] = {0.02};
    veil_evenly(0.02);
    variance[300] = INFINITY;
    assert_int_equal(cap_glare_remove(&map, share, 0.002, NULL), STATUS_OK);
    assert_true(variance[300] == INFINITY && isfinite(value[300]));
}

static void test_a_wide_veil_is_taken_off(void **state)
{
    (void)state;
    const double share[GLARE_TERMS] = {0, 0.03, 0};
    const double sigma = hypot(WIDTH, HEIGHT) / 6;
    make_scene();
    static double veil[COUNT];
    for (int y = 0; y < HEIGHT; y++)  // the kernel is so wide that its squares of 5 do for the map
        for (int x = 0; x < WIDTH; x++) {
            int middle = 3 * ((y / 5 * 5 + 2) * WIDTH + x / 5 * 5 + 2), i = 3 * (y * WIDTH + x);
            if (x % 5 == 0 && y % 5 == 0)
                gaussian_mean(&veil[middle], x + 2, y + 2, sigma);
            for (int c = 0; c < 3; c++) {
                veil[i + c] = veil[middle + c];
                value[i + c] = (float)(0.97 * (double)truth[i + c] + 0.03 * veil[middle + c]);
            }
        }
    assert_int_equal(cap_glare_remove(&map, share, 0, NULL), STATUS_OK);
    for (int y = 2; y < HEIGHT; y += 5)
        for (int x = 2; x < WIDTH; x += 5)
            for (int c = 0; c < 3; c++) {
                int i = 3 * (y * WIDTH + x) + c;
                // A hundredth of the veil, where the scene has edges within a cell.
                assert_near(value[i], truth[i], 0.01 * 0.03 * veil[i] + 1e-6);
            }
}

static void test_a_map_in_its_file_is_cleared_where_somebody_looks(void **state)
{
    (void)state;
    const double share[GLARE_TERMS] = {0.02, 0.01, 0};
    char path[] = "/tmp/test_glare_XXXXXX";
    struct radiance in_file = {0};
    int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    veil_evenly(0.02);
    for (int i = 0; i < COUNT; i++)
        variance[i] = 1e-6f;
    assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
    assert_int_equal(cap_radiance_open(&in_file, path, NULL), STATUS_OK);
    assert_non_null(in_file.file);
    assert_int_equal(cap_glare_remove(&in_file, share, 0.002, NULL), STATUS_OK);
    assert_int_equal(cap_glare_remove(&map, share, 0.002, NULL), STATUS_OK);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        float v[3], var[3];
        cap_radiance_at(&in_file, i % WIDTH, i / WIDTH, v, var);
        for (int c = 0; c < 3; c++) {  // seven digits of floats, in another order
            assert_near(v[c], value[3 * i + c], 1e-6);
            assert_near(var[c], variance[3 * i + c], 1e-11);
        }
    }
    remove(path);
    cap_radiance_free(&in_file);
}

/* The map at path, freed of a veil of one share, is the scene `times` as bright; how far it is off.
 */
static double worst_of_file(const char *path, double part, double times)
{
    const double share[GLARE_TERMS] = {part, 0, 0};
    struct radiance in_file = {0};
    double worst = 0;
    assert_int_equal(cap_radiance_open(&in_file, path, NULL), STATUS_OK);
    assert_int_equal(cap_glare_remove(&in_file, share, 0, NULL), STATUS_OK);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        float v[3], var[3];
        cap_radiance_at(&in_file, i % WIDTH, i / WIDTH, v, var);
        for (int c = 0; c < 3; c++)
            worst = fmax(worst, fabs((double)v[c] - times * (double)truth[3 * i + c]));
    }
    cap_radiance_free(&in_file);
    return worst;
}

/* A veil that was kept is that of the same file and shares, and of no other. */
static void test_a_file_opened_again_is_cleared_alike(void **state)
{
    (void)state;
    char path[] = "/tmp/test_glare_XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    veil_evenly(0.1);
    assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
    const double first = worst_of_file(path, 0.1, 1);
    assert_true(first < 1e-4);
    assert_true(worst_of_file(path, 0.1, 1) == first);
    assert_true(worst_of_file(path, 0.05, 1) > 0.01);
    for (int i = 0; i < COUNT; i++)
        value[i] *= 2;
    assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
    assert_true(worst_of_file(path, 0.1, 2) < 2e-4);
    remove(path);
}

static void test_no_share_changes_nothing(void **state)
{
    (void)state;
    const double none[GLARE_TERMS] = {0};
    make_scene();
    for (int i = 0; i < COUNT; i++)
        value[i] = truth[i];
    assert_int_equal(cap_glare_remove(&map, none, 0, NULL), STATUS_OK);
    for (int i = 0; i < COUNT; i++)
        assert_true(value[i] == truth[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_an_even_veil_is_taken_off),
        cmocka_unit_test(test_doubt_goes_into_the_variance),
        cmocka_unit_test(test_what_was_not_measured_stays_so),
        cmocka_unit_test(test_a_wide_veil_is_taken_off),
        cmocka_unit_test(test_a_map_in_its_file_is_cleared_where_somebody_looks),
        cmocka_unit_test(test_a_file_opened_again_is_cleared_alike),
        cmocka_unit_test(test_no_share_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
