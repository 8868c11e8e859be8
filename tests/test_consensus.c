/* test_consensus.c -- neighbours of known scatter tell that scatter, and what strays from them. */
#include "consensus.h"
#include "made_bins.h"
#include "near.h"

static const double plastic[] = {0.3, 0.2, 0.1, 0.3, 1.5};  // albedo, alpha, ior
enum { STRIDE = 11 };

static struct fit fit_of(const char *name, const double *value)
{
    struct fit fit = {.model = rec_model_find(name)};
    for (int k = 0; k < rec_model_size(fit.model); k++)
        fit.value[k] = value[k];
    return fit;
}

static struct consensus consensus_of(const struct bins *bins, const struct fit *fit)
{
    struct consensus c = {0};
    struct run run;
    cap_run_begin(&run, 2, true);
    assert_int_equal(rec_consensus_make(&c, bins, fit, (double[2]){0, 0}, &run, NULL), STATUS_OK);
    cap_run_end(&run);
    return c;
}

static double mean_scale(const struct consensus *c, const struct bins *bins)
{
    double sum = 0;
    for (int i = 0; i < bins->count; i++)
        sum += (double)c->say[i].scale[1];
    return sum / bins->count;
}

// Claimed errors that are right stay; half as large as they are, they are doubled. The scale is at
// least 1, so that it overshoots by its own noise, a few per cent.
static void test_scale_is_real_over_claimed(void **state)
{
    (void)state;
    struct fit fit = fit_of("ggx", plastic);
    struct bins bins = made_bins(fit.model, plastic, STRIDE, 0.02);
    for (int too_small = 1; too_small <= 2; too_small++) {
        double was = bins.bin[0].sigma[1];
        for (int i = 0; i < bins.count; i++)
            for (int c = 0; c < 3; c++)
                bins.bin[i].sigma[c] /= too_small;
        struct consensus c = consensus_of(&bins, &fit);
        assert_near(mean_scale(&c, &bins), too_small, 0.06 * too_small);
        rec_consensus_widen(&bins, &c);
        assert_near(bins.bin[0].sigma[1], was, 0.3 * was);
        rec_consensus_free(&c);
    }
    rec_bins_free(&bins);
}

// A fit that is wrong everywhere, but smoothly, is no scatter: neighbours are wrong together.
static void test_a_smooth_misfit_is_no_scatter(void **state)
{
    (void)state;
    const double rough[] = {0.3, 0.2, 0.1, 0.6, 1.5}, grey[] = {0.4, 0.3, 0.2};
    struct fit truth = fit_of("ggx", rough), fit = fit_of("lambert", grey);
    struct bins bins = made_bins(truth.model, rough, STRIDE, 0.03);
    struct consensus c = consensus_of(&bins, &fit);
    assert_true(mean_scale(&c, &bins) < 1.4);
    rec_consensus_free(&c);
    rec_bins_free(&bins);
}

// Photosites within three sigma of their neighbours stay; half and double are left out, of a
// material that the fit (wrong by a third) does not know.
static void test_what_strays(void **state)
{
    (void)state;
    const double brighter[] = {0.45, 0.3, 0.15, 0.3, 1.5};
    struct fit truth = fit_of("ggx", plastic), fit = fit_of("ggx", brighter);
    struct bins bins = made_bins(truth.model, plastic, STRIDE, 0.02);
    for (int i = 0; i < bins.count; i++)
        bins.bin[i].alone = 0.75;
    struct consensus c = consensus_of(&bins, &fit);
    int kept = 0, doubled = 0, halved = 0, asked = 0;
    for (int i = 0; i < bins.count; i += 97) {
        const struct bin *b = &bins.bin[i];
        candidate a = {.angles = b->centroid, .channel = -1}, twice, half;
        comparison to;
        vec3 wi, wo;
        if (isnan(c.say[i].middle[0]))
            continue;
        rec_directions(b->centroid, &wi, &wo);
        truth.model->eval(truth.value, wi, wo, a.f);
        for (int k = 0; k < 3; k++)
            a.noise[k] = 4e-4 * a.f[k] * a.f[k];
        twice = half = a;
        for (int k = 0; k < 3; k++) {
            twice.f[k] *= 2;
            half.f[k] /= 2;
        }
        a.f[1] *= 1.06;
        kept += rec_consensus_allows(&c, b->index, &a, &to);
        assert_near(to.others, 0.25, 1e-6);
        assert_near(to.residual, 0.02,
                    0.05);  // 0.06 in one of three, and the neighbours' own noise
        doubled += rec_consensus_allows(&c, b->index, &twice, &to);
        assert_near(to.residual, 1, 0.1);
        half.channel = 2;  // a photosite of a mosaic: the others do not count
        half.f[0] = half.f[1] = 0;
        halved += rec_consensus_allows(&c, b->index, &half, &to);
        assert_near(to.residual, -0.5, 0.05);
        asked++;
    }
    assert_true(asked > 200);
    assert_true(kept > 0.99 * asked);
    assert_int_equal(doubled, 0);
    assert_int_equal(halved, 0);
    rec_consensus_free(&c);
    rec_bins_free(&bins);
}

// Noise of 0.3 times the bounced light, on a third of the bins: it comes back as 0.3.
static void test_bounce_scatter_is_found(void **state)
{
    (void)state;
    struct fit fit = fit_of("ggx", plastic);
    struct bins bins = made_bins(fit.model, plastic, STRIDE, 0.01);
    for (int i = 0; i < bins.count; i++)
        for (int c = 0; c < 3; c++) {
            struct bin *b = &bins.bin[i];
            double u = made_chance(i, 20 + c) + 1e-12, v = made_chance(i, 30 + c);
            double gauss = sqrt(-2 * log(u)) * cos(2 * CAP_PI * v);  // Box and Muller 1958
            b->bounced[c] = i % 3 ? 0 : 0.1;
            b->mean[c] *= 1 + 0.3 * b->bounced[c] * gauss;
        }
    struct consensus c = consensus_of(&bins, &fit);
    assert_near(c.bounce_scatter, 0.3, 0.03);
    rec_consensus_free(&c);
    rec_bins_free(&bins);
}

static void test_lonely_bins_are_left_alone(void **state)
{
    (void)state;
    struct fit fit = fit_of("ggx", plastic);
    struct bins bins = made_bins(fit.model, plastic, 40009, 0.02);
    struct consensus c = consensus_of(&bins, &fit);
    const struct bin *b = &bins.bin[0];
    candidate a = {.angles = b->centroid, .channel = -1, .f = {1e3, 1e3, 1e3}};
    comparison to;
    assert_true(rec_consensus_allows(&c, b->index, &a, &to));
    assert_true(isnan(to.residual));
    assert_near(mean_scale(&c, &bins), 1, 0);
    rec_consensus_free(&c);
    rec_bins_free(&bins);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scale_is_real_over_claimed),
        cmocka_unit_test(test_a_smooth_misfit_is_no_scatter),
        cmocka_unit_test(test_what_strays),
        cmocka_unit_test(test_bounce_scatter_is_found),
        cmocka_unit_test(test_lonely_bins_are_left_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
