/* test_resolution.c -- sharpening and widening of bins by a model. */
#include "near.h"
#include "reconstruct.h"

static const struct fit glossy = {.value = {0.2, 0.2, 0.2, 0.1, 1.5}};

static struct bin bin_at(half_diff angles)
{
    struct bin b = {.index = rec_merl_index(angles), .count = 1, .centroid = angles};
    return b;
}

static struct fit fit_of(const char *name)
{
    struct fit fit = glossy;
    fit.model = rec_model_find(name);
    return fit;
}

// The mean of the model over an even spread of normals, 201 x 201 of them, comes back to the model.
static void test_an_averaged_highlight_comes_back(void **state)
{
    (void)state;
    struct fit fit = fit_of("ggx");
    half_diff at = {0.03, 0.3, 1};
    struct bin b = bin_at(at);
    const double half[2] = {0.02, 0.012};  // the normals' half widths: variance half^2 / 3
    double level[3], sum[3] = {0};
    vec3 w[2];
    enum { N = 100 };
    for (int i = -N; i <= N; i++)
        for (int j = -N; j <= N; j++) {
            double f[3], tilt = half[1] * j / N;
            rec_directions((half_diff){at.theta_h - half[0] * i / N, at.theta_d, at.phi_d}, &w[0],
                           &w[1]);
            for (int k = 0; k < 2; k++)
                w[k] = (vec3){w[k].x, w[k].y * cos(tilt) - w[k].z * sin(tilt),
                              w[k].y * sin(tilt) + w[k].z * cos(tilt)};
            fit.model->eval(fit.value, w[0], w[1], f);
            for (int c = 0; c < 3; c++)
                sum[c] += f[c] / ((2 * N + 1) * (2 * N + 1));
        }
    rec_directions(at, &w[0], &w[1]);
    fit.model->eval(fit.value, w[0], w[1], level);
    for (int c = 0; c < 3; c++)
        b.mean[c] = sum[c];
    b.spread[0] = half[0] * half[0] / 3;
    b.spread[1] = half[1] * half[1] / 3;
    struct bins bins = {.bin = &b, .count = 1};
    assert_true(fabs(sum[0] / level[0] - 1) > 0.01);  // there is something to undo
    rec_bins_sharpen(&bins, &fit);
    assert_near(b.mean[0] / level[0], 1, 1e-3);
}

// A blur much wider than the photosite spreads normals normally: 81 x 81 of them over 4 sigmas. A
// second call with the same model changes nothing; one with another replaces what the first did.
static void test_a_blurred_highlight_comes_back(void **state)
{
    (void)state;
    struct fit fit = fit_of("ggx"), wrong = fit_of("ggx");
    half_diff at = {0.03, 0.3, 1};
    struct bin b = bin_at(at);
    const double sigma = 0.02;
    double level[3], sum[3] = {0}, weights = 0;
    vec3 w[2];
    for (int i = -40; i <= 40; i++)
        for (int j = -40; j <= 40; j++) {
            double f[3], tilt = sigma * j / 10, weight = exp(-0.005 * (i * i + j * j));
            rec_directions((half_diff){at.theta_h - sigma * i / 10, at.theta_d, at.phi_d}, &w[0],
                           &w[1]);
            for (int k = 0; k < 2; k++)
                w[k] = (vec3){w[k].x, w[k].y * cos(tilt) - w[k].z * sin(tilt),
                              w[k].y * sin(tilt) + w[k].z * cos(tilt)};
            fit.model->eval(fit.value, w[0], w[1], f);
            weights += weight;
            for (int c = 0; c < 3; c++)
                sum[c] += weight * f[c];
        }
    rec_directions(at, &w[0], &w[1]);
    fit.model->eval(fit.value, w[0], w[1], level);
    for (int c = 0; c < 3; c++) {
        b.mean[c] = sum[c] / weights;
        b.noise[c] = 0.01 * b.mean[c];
    }
    b.spread[0] = b.spread[1] = sigma * sigma;
    struct bins bins = {.bin = &b, .count = 1, .blur2 = 10};
    wrong.value[3] = 0.2;
    assert_true(b.mean[0] / level[0] < 0.93);  // there is something to undo
    rec_bins_sharpen(&bins, &wrong);
    rec_bins_sharpen(&bins, &fit);
    assert_near(b.mean[0] / level[0], 1, 4e-3);
    assert_near(rec_bins_sharpen(&bins, &fit), 0, 1e-9);
}

// The mean of the model over an evenly bright disc of directions to the lamp, seen from a place off
// the mirror direction and out of the plane of incidence, comes back to the model at its middle.
static void test_a_lamps_disc_comes_back(void **state)
{
    (void)state;
    struct fit fit = fit_of("ggx");
    for (int k = 0; k < 4; k++) {
        half_diff at = {0.02 * k, 0.4 + 0.2 * k, 0.6 * k};
        struct bin b = bin_at(at);
        const double radius = 0.04;
        double level[3], sum[3] = {0};
        vec3 wi, wo;
        rec_directions(at, &wi, &wo);
        fit.model->eval(fit.value, wi, wo, level);
        vec3 x = vec3_normalize(vec3_cross(wi, (vec3){0.3, 0.8, 0.1})), y = vec3_cross(wi, x);
        int count = 0;
        enum { N = 60 };
        for (int i = -N; i <= N; i++)
            for (int j = -N; j <= N; j++) {
                double f[3], u = radius * i / N, v = radius * j / N;
                if (i * i + j * j > N * N)
                    continue;
                vec3 in = vec3_add(wi, vec3_add(vec3_scale(x, u), vec3_scale(y, v)));
                fit.model->eval(fit.value, vec3_normalize(in), wo, f);
                for (int c = 0; c < 3; c++)
                    sum[c] += f[c];
                count++;
            }
        for (int c = 0; c < 3; c++)
            b.mean[c] = sum[c] / count;
        b.disc = radius * radius / 4;
        struct bins bins = {.bin = &b, .count = 1};
        double off = fabs(b.mean[0] / level[0] - 1);
        rec_bins_sharpen(&bins, &fit);
        assert_true(k > 0 || off > 0.03);  // there is something to undo
        assert_near(b.mean[0] / level[0], 1, 0.002 + 0.1 * off);
        if (k == 0)
            assert_int_equal(rec_bins_sharpening(&bins).bins, 1);
    }
}

static void test_a_matte_surface_has_nothing_to_sharpen(void **state)
{
    (void)state;
    struct fit fit = fit_of("lambert");
    struct bin b = bin_at((half_diff){0.5, 0.5, 1});
    struct bins bins = {.bin = &b, .count = 1};
    b.spread[0] = b.spread[1] = 1e-3;
    b.mean[0] = 0.7;
    rec_bins_sharpen(&bins, &fit);
    assert_near(b.mean[0], 0.7, 1e-15);
}

// On the flank of a lobe a tilt of t moves f by t df/dtheta_h.
static void test_tilt_times_slope_enters_sigma(void **state)
{
    (void)state;
    struct fit fit = fit_of("ggx");
    half_diff at = rec_merl_center(rec_merl_index((half_diff){0.08, 0.3, 1}));
    struct bin b = bin_at(at);
    struct bins bins = {.bin = &b, .count = 1};
    vec3 wi, wo;
    double up[3], down[3];
    b.tilt = 1e-3;
    b.noise[0] = 0.01;
    rec_directions((half_diff){at.theta_h + 1e-4, at.theta_d, at.phi_d}, &wi, &wo);
    fit.model->eval(fit.value, wi, wo, up);
    rec_directions((half_diff){at.theta_h - 1e-4, at.theta_d, at.phi_d}, &wi, &wo);
    fit.model->eval(fit.value, wi, wo, down);
    rec_bins_widen(&bins, &fit);
    double expected = 1e-3 * fabs(up[1] - down[1]) / 2e-4;
    assert_near(b.sigma[1], expected, 0.02 * expected);
    assert_near(b.sigma[0], hypot(expected, 0.01), 0.02 * expected);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_an_averaged_highlight_comes_back),
        cmocka_unit_test(test_a_blurred_highlight_comes_back),
        cmocka_unit_test(test_a_lamps_disc_comes_back),
        cmocka_unit_test(test_a_matte_surface_has_nothing_to_sharpen),
        cmocka_unit_test(test_tilt_times_slope_enters_sigma),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
