/* test_lookup.c -- tables between the middles of their bins: exact there, even elsewhere. */
#include "made_table.h"
#include "near.h"

static struct brdf brdf;

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

static int begin(void **state)
{
    (void)state;
    const double value[] = {0.3, 0.1, 0.02, 0.12, 1.5};
    brdf.table = made_table(rec_model_find("ggx"), value);
    // Something that depends on phi_d in every way a table can: no model here does.
    for (int bin = 0; bin < MERL_BINS; bin++)
        if (brdf.table.value[bin] >= 0)
            brdf.table.value[bin] *= 1 + 0.3 * sin(2 * rec_merl_center(bin).phi_d);
    return rec_brdf_prepare(&brdf, NULL);
}

static int end(void **state)
{
    (void)state;
    rec_brdf_free(&brdf);
    return 0;
}

// Places err by 2e-8 rad, that is 1e-6 bins, and floats by 1e-7; a highlight falls by up to half
// from bin to bin.
static void test_the_middles_are_the_table(void **state)
{
    (void)state;
    for (int bin = 0; bin < MERL_BINS; bin += 7) {
        vec3 wi, wo;
        double f[3];
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (wi.z <= 0 || wo.z <= 0)
            continue;
        rec_brdf_eval(&brdf, wi, wo, f);
        for (int c = 0; c < 3; c++) {
            double expected = brdf.table.value[(size_t)c * MERL_BINS + (size_t)bin];
            assert_near(f[c], expected, 3e-6 * expected);
        }
    }
}

static void test_reciprocity(void **state)
{
    (void)state;
    for (int i = 0; i < 20000; i++) {
        vec3 wi = direction(1.57 * (i % 23) / 22, 0.1 * i);
        vec3 wo = direction(1.57 * (i % 19) / 18, 0.37 * i);
        double f[3], g[3];
        rec_brdf_eval(&brdf, wi, wo, f);
        rec_brdf_eval(&brdf, wo, wi, g);
        for (int c = 0; c < 3; c++)
            assert_near(f[c], g[c], 1e-5 * f[c]);
    }
}

// Along any path in steps of 1e-6 rad f changes by no more than its steepest slope allows, where
// nearest bins would jump by several per cent: through the highlight's middle, where phi_d turns
// about, through retro-reflection, and across the fold of phi_d.
static void test_no_edge_is_seen(void **state)
{
    (void)state;
    static const struct {
        double theta_i, theta_o, phi_o, by_theta, by_phi;
    } path[] = {
        {0.5, 0.5, CAP_PI, 1, 0}, {0.5, 0.5, CAP_PI, 0, 1},   {0.7, 0.7, 0, 1, 0},
        {0.7, 0.7, 0, 0.3, 1},    {0.3, 1.2, 2, 1, 0.5},      {1.4, 1.45, 3.1, 1, 1},
        {1e-9, 0.4, 0.1, 0, 1},   {0.2, 1.5, 0.4, 0.6, -0.8}, {1.5, 1.5, CAP_PI, 1, 0},
    };
    const double step = 1e-6;
    for (size_t k = 0; k < sizeof path / sizeof *path; k++) {
        double before[3], f[3];
        for (int i = -20000; i < 20000; i++) {
            double theta = path[k].theta_o + path[k].by_theta * i * step;
            double phi = path[k].phi_o + path[k].by_phi * i * step;
            vec3 wi = direction(path[k].theta_i, 0), wo = direction(theta, phi);
            rec_brdf_eval(&brdf, wi, wo, f);
            for (int c = 0; c < 3 && i > -20000; c++)
                assert_near(f[c], before[c], 2e-3 * fmax(f[c], before[c]));
            for (int c = 0; c < 3; c++)
                before[c] = f[c];
        }
    }
}

// The table has no values there, and light at grazing angles is still continued, not cut.
static void test_the_horizon(void **state)
{
    (void)state;
    double f[3], g[3];
    for (double theta = 0; theta < 1.5; theta += 0.1) {
        vec3 wi = direction(theta, 0);
        rec_brdf_eval(&brdf, wi, direction(CAP_PI / 2 - 1e-6, 1), f);
        rec_brdf_eval(&brdf, wi, direction(CAP_PI / 2 - 0.02, 1), g);
        for (int c = 0; c < 3; c++)
            assert_true(f[c] > 0.5 * g[c] && f[c] < 2 * g[c]);
        rec_brdf_eval(&brdf, wi, direction(CAP_PI / 2 + 1e-6, 1), f);
        assert_near(f[0] + f[1] + f[2], 0, 0);
    }
}

static void test_many_are_as_one(void **state)
{
    (void)state;
    enum { N = 1000 };
    static vec3 wi[N], wo[N];
    static double f[N][3];
    for (int i = 0; i < N; i++) {
        wi[i] = direction(1.7 * (i % 37) / 36, 0.1 * i);  // some below the horizon
        wo[i] = direction(1.5 * (i % 41) / 40, 0.77 * i);
    }
    rec_brdf_eval_many(&brdf, wi, wo, f, N);
    for (int i = 0; i < N; i++) {
        double one[3];
        rec_brdf_eval(&brdf, wi[i], wo[i], one);
        assert_memory_equal(one, f[i], sizeof one);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_middles_are_the_table), cmocka_unit_test(test_reciprocity),
        cmocka_unit_test(test_no_edge_is_seen),           cmocka_unit_test(test_the_horizon),
        cmocka_unit_test(test_many_are_as_one),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
