/* Response curves: brackets of codes give back the curve that made them. */
#include "recover.h"
#include "synthetic.h"

#include <unistd.h>

enum { SHOTS = 4, FRAMES = 5, PHOTOSITES = 8000 };

/* Code of a linear value in [0, 1]. */
typedef double (*encoding)(double linear);

static double encode_srgb(double x)
{
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

static double encode_gamma(double x)
{
    return pow(x, 1 / 2.2);
}

/* Contrast raised in the middle, as cameras like it. */
static double encode_film(double x)
{
    double v = encode_srgb(x);
    return v + 0.12 * sin(2 * 3.14159265358979 * v) * v * -1;
}

static double encode_linear(double x)
{
    return x;
}

static struct row {
    const char *name;
    encoding encode;
    double tolerance;  // relative, over codes 25 to 230
} rows[] = {
    {"sRGB", encode_srgb, 0.01},
    {"gamma 2.2", encode_gamma, 0.02},
    {"a film-like curve", encode_film, 0.03},
    {"linear", encode_linear, 0.05},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void expose(struct bracket_sample *s, encoding encode, uint64_t *state)
{
    *s = (struct bracket_sample){.frames = FRAMES, .photosites = PHOTOSITES};
    s->time = calloc(FRAMES, sizeof *s->time);
    s->dn = calloc(FRAMES, sizeof *s->dn);
    assert_true(s->time && s->dn);
    for (int f = 0; f < FRAMES; f++) {
        s->time[f] = pow(4, f) / 1024;
        s->dn[f] = malloc(PHOTOSITES * sizeof *s->dn[f]);
        assert_non_null(s->dn[f]);
    }
    for (int i = 0; i < PHOTOSITES; i++) {
        double rate = 2048 * pow(10, -4 * random_uniform(state));
        for (int f = 0; f < FRAMES; f++) {
            double electrons = 40000 * fmin(rate * s->time[f], 1.2);
            double x = random_poisson(state, electrons) / 40000;
            s->dn[f][i] = (float)rint(255 * fmin(encode(fmin(x, 1)), 1));
        }
    }
}

static void test_curve(void **state)
{
    const struct row *r = *state;
    static struct bracket_sample sample[3][SHOTS];
    struct sample_set set = {.channel = {sample[0], sample[1], sample[2]}, .samples = SHOTS};
    struct curve curve;
    uint64_t random = 11;
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < SHOTS; k++)
            expose(&sample[c][k], r->encode, &random);
    assert_true(response_recover(&curve, &set));
    for (int c = 0; c < 3; c++) {
        double scale = 0, worst = 0;
        int count = 0;
        for (int pass = 0; pass < 2; pass++)  // one factor is free
            for (int i = 1; i < 1000; i++) {
                double x = i / 1000.0, code = 255 * r->encode(x);
                int z = (int)code;
                if (code < 25 || code > 230)
                    continue;
                double dn = (double)curve.dn[c][z]
                            + (code - z) * ((double)curve.dn[c][z + 1] - (double)curve.dn[c][z]);
                if (pass == 0) {
                    scale += log(dn / x);
                    count++;
                } else {
                    worst = fmax(worst, fabs(log(dn / x) - scale / count));
                }
            }
        assert_near(worst, 0, r->tolerance);
        for (int z = 1; z < 256; z++)
            assert_true(curve.dn[c][z] >= curve.dn[c][z - 1]);
    }
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < SHOTS; k++) {
            for (int f = 0; f < FRAMES; f++)
                free(sample[c][k].dn[f]);
            free(sample[c][k].dn);
            free(sample[c][k].time);
        }
}

static void test_file_round_trip(void **state)
{
    (void)state;
    char path[] = "/tmp/test_recover_XXXXXX";
    struct curve curve, back;
    struct error err = {0};
    close(mkstemp(path));
    response_known(&curve, RESPONSE_SRGB);
    curve.relative[1] = 0.0125;
    assert_int_equal(response_write(&curve, path, &err), STATUS_OK);
    assert_int_equal(response_read(&back, path, &err), STATUS_OK);
    assert_near(back.relative[1], 0.0125, 1e-12);
    for (int z = 0; z < 256; z++)
        assert_near(back.dn[2][z], curve.dn[2][z], 1e-6 * (double)curve.dn[2][z]);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs("0 0 0 0\n2 1 1 1\n", file);
    fclose(file);
    assert_int_equal(response_read(&back, path, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, path));
    remove(path);
    assert_int_equal(response_read(&back, path, &err), STATUS_IO);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 1];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_curve, NULL, NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_file_round_trip);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
