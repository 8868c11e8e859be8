/* test_limb.c -- an edge is found where it is, through any lens: profiles averaged over photosite
 * and lens by the midpoint rule in fine steps.
 */
#include "limb.h"
#include "near.h"

#include <stdlib.h>

static struct row {
    const char *name;
    double blur, edge;
    double inside[3], outside[2];  // of the limb model
    // px: where the step is small or the lens very soft, edges move by up to 2.5 px a pixel of
    // blur, which is found to 0.03.
    double limit;
    double bend;  // of the surface, 1/px
} rows[] = {
    {"a bright limb on black, sharp", 0, 0.3, {1, 0.5, 0.02}, {0, 0}, 0.01, 0},
    {"a bright limb on black, soft", 0.7, 0.3, {1, 0.5, 0.02}, {0, 0}, 0.01, 0},
    {"a steep limb, soft", 0.7, -0.4, {0.2, 1, 0.3}, {0.1, 0.01}, 0.075, 0},
    {"a dark limb before a bright board", 0.5, 0.1, {0.4, 0.2, 0}, {1.2, -0.02}, 0.01, 0},
    {"a very soft lens", 1.0, 0.2, {1, 0.5, 0.02}, {0.1, 0}, 0.075, 0},
    {"a thin cylinder, matt, its lamp in front", 0, 0.2, {0, 1, 0}, {0.05, 0}, 0.01, 1.0 / 22},
    {"a thinner one, its lamp aside", 0.5, -0.25, {0.7, 0.3, -0.05}, {0.05, 0}, 0.01, 1.0 / 15},
};
enum { ROWS = sizeof rows / sizeof *rows };

static double bare(const struct row *r, double depth)
{
    double c = sqrt(fmax(depth - 0.5 * r->bend * depth * depth, 0));
    return depth > 0 ? r->inside[0] + r->inside[1] * c + r->inside[2] * depth
                     : r->outside[0] + r->outside[1] * depth;
}

// Averaged over a photosite, and over the lens to 5 sigmas.
static double seen(const struct row *r, double depth)
{
    enum { FINE = 100, STEPS = 100 };
    double sum = 0, weights = 0;
    for (int k = -STEPS; k <= STEPS; k++) {
        double w = exp(-0.5 * pow(5.0 * k / STEPS, 2));
        for (int i = 0; i < FINE; i++)
            sum += w * bare(r, depth + 5.0 * k / STEPS * r->blur + (i + 0.5) / FINE - 0.5) / FINE;
        weights += w;
    }
    return sum / weights;
}

static struct sector profile(const struct row *r)
{
    struct sector s = {.count = 0, .bend = r->bend};
    for (double d = -LIMB_INSIDE_PX; d < LIMB_OUTSIDE_PX; d += 0.17) {
        double value = seen(r, r->edge - d);
        s.site[s.count++] = (struct site){d, value, 1e-6 * (value * value + 1e-2)};
    }
    return s;
}

static void test_row(void **state)
{
    const struct row *r = *state;
    struct sector s = profile(r);
    struct limb_lens lens;
    double edge, sigma;
    limb_lens_find(&lens, &s, 1, INFINITY);
    assert_near(lens.blur, r->blur, 0.03);
    assert_true(limb_edge(&s, &lens, &edge, &sigma));
    assert_near(edge, r->edge, r->limit);
}

// The blur of the tags is taken where the outline does not speak against it.
static void test_tags_tell_the_blur(void **state)
{
    (void)state;
    struct sector s = profile(&rows[1]);
    struct limb_lens lens;
    limb_lens_find(&lens, &s, 1, rows[1].blur + 0.05);
    assert_near(lens.blur, rows[1].blur + 0.05, 0);
    limb_lens_find(&lens, &s, 1, rows[1].blur + 0.2);
    assert_near(lens.blur, rows[1].blur, 0.03);
    s = profile(&rows[0]);  // the photosite hides what little a sharp lens spreads
    limb_lens_find(&lens, &s, 1, 0.2);
    assert_near(lens.blur, 0.2, 0);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 1];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_row, NULL, NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_tags_tell_the_blur);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
