/* Pixel means of pictures whose areas are known: half planes, wedges, discs, polynomials. */
#include "capture.h"
#include "near.h"
#include "pixel.h"

/** A picture as a function. */
struct picture {
    double a, b, c;  // of a line a x + b y = c, or a disc of radius c about (a, b)
};

static struct sight half_plane(const void *scene, double x, double y, int shade)
{
    const struct picture *p = scene;
    int inside = p->a * x + p->b * y > p->c;
    double v = shade && inside ? 1 : 0;
    return (struct sight){.id = inside, .rgb = {v, 2 * v, 0}};
}

static struct sight disc(const void *scene, double x, double y, int shade)
{
    const struct picture *p = scene;
    int inside = hypot(x - p->a, y - p->b) < p->c;
    double v = shade && inside ? 1 : 0;
    return (struct sight){.id = inside, .curved = 1, .rgb = {v, v, v}};
}

static struct sight cubic(const void *scene, double x, double y, int shade)
{
    (void)scene;
    (void)shade;
    double v = 1 + x + x * x - 3 * x * y + x * x * x - 2 * y * y * y;
    return (struct sight){.id = 1, .rgb = {v, v, v}};
}

static struct sight corner(const void *scene, double x, double y, int shade)
{
    const struct picture *p = scene;
    int inside = x > p->a && y > p->b;
    double v = shade && inside ? 1 : 0;
    return (struct sight){.id = inside, .rgb = {v, v, v}};
}

static void mean(struct sight (*look)(const void *, double, double, int), const struct picture *p,
                 double x, double y, int depth, double rgb[3])
{
    struct image_plane plane = {look, p, 1e-3, 1e-9};
    struct sight four[4] = {look(p, x - 0.5, y - 0.5, 1), look(p, x + 0.5, y - 0.5, 1),
                            look(p, x + 0.5, y + 0.5, 1), look(p, x - 0.5, y + 0.5, 1)};
    sam_pixel_mean(&plane, x, y, 1, depth, four, rgb);
}

/** Area of the unit square about (x, y) in which a x + b y > c, for a, b > 0: the triangle above
 *  the line less the parts of it beyond the square. */
static double area_above(const struct picture *p, double x, double y)
{
    double t = p->a * (x + 0.5) + p->b * (y + 0.5) - p->c, u = t - p->a, v = t - p->b;
    double w = t - p->a - p->b;
    double sum = fmax(t, 0) * fmax(t, 0) - fmax(u, 0) * fmax(u, 0) - fmax(v, 0) * fmax(v, 0)
                 + fmax(w, 0) * fmax(w, 0);
    return sum / (2 * p->a * p->b);
}

static void test_straight_edges_are_exact(void **state)
{
    (void)state;
    for (int i = 1; i < 300; i++) {
        double angle = CAP_PI / 2 * i / 300;
        struct picture line = {cos(angle), sin(angle), 0.013 * i - 2};
        for (int y = -3; y <= 3; y++)
            for (int x = -3; x <= 3; x++) {
                double rgb[3];
                mean(half_plane, &line, x, y, 0, rgb);
                // Each end of the edge is known to half of 1/256 px at worst.
                assert_near(rgb[0], area_above(&line, x, y), 1.0 / 512 * 1.5);
                assert_near(rgb[1], 2 * rgb[0], 1e-12);
            }
    }
}

// The mean over many random edges is free of bias: bisection errs to both sides alike.
static void test_straight_edges_have_no_bias(void **state)
{
    (void)state;
    double sum = 0, square = 0;
    int count = 0;
    for (int i = 1; i < 3000; i++) {
        double angle = CAP_PI / 2 * i / 3000;
        struct picture line = {cos(angle), sin(angle), fmod(i * 0.618034, 1) - 0.5};
        double rgb[3];
        mean(half_plane, &line, 0, 0, 0, rgb);
        double error = rgb[0] - area_above(&line, 0, 0);
        sum += error;
        square += error * error;
        count++;
    }
    double sigma = sqrt(square / count);
    assert_true(sigma < 1e-3);  // as the head of pixel.c promises
    assert_near(sum / count, 0, 5 * sigma / sqrt(count));
}

static void test_disc_has_its_area(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i++) {
        struct picture p = {0.05 * i, 0.031 * i, 3 + 0.71 * i};
        double total = 0;
        for (int y = -20; y <= 20; y++)
            for (int x = -20; x <= 20; x++) {
                double rgb[3];
                mean(disc, &p, x, y, 0, rgb);
                total += rgb[0];
            }
        // Chords in sixteenths of pixels lose 1/(12 R)/16 px along 2 pi R: 0.03 px of area; the
        // bisections of some 6 R pixels add 1e-3 sqrt(6 R).
        assert_near(total, CAP_PI * p.c * p.c, 0.04 + 5e-3 * sqrt(6 * p.c));
    }
}

static void test_cubics_are_exact(void **state)
{
    (void)state;
    double rgb[3];
    mean(cubic, NULL, 0, 0, 0, rgb);
    assert_near(rgb[0], 1 + 1.0 / 12, 1e-14);  // the mean of x^2 is 1/12; odd powers vanish
}

// A corner that pokes into a pixel through one side, past all of its looking places, is seen when
// the caller asks for depth.
static void test_depth_finds_what_hides_between(void **state)
{
    (void)state;
    struct picture p = {-0.3, 0.2, 0};
    double rgb[3];
    mean(corner, &p, 0, 0, 0, rgb);
    assert_near(rgb[0], 0.8 * 0.3, 5e-3);
    p = (struct picture){0.30, 0.35, 0};
    mean(corner, &p, 0, 0, 2, rgb);
    assert_near(rgb[0], 0.2 * 0.15, 5e-3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_straight_edges_are_exact),
        cmocka_unit_test(test_straight_edges_have_no_bias),
        cmocka_unit_test(test_disc_has_its_area),
        cmocka_unit_test(test_cubics_are_exact),
        cmocka_unit_test(test_depth_finds_what_hides_between),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
