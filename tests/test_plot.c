#include "near.h"
#include "plot.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static struct brdf lambert(double red, double green, double blue)
{
    return (struct brdf){.model = rec_model_find("lambert"), .value = {red, green, blue}};
}

static const struct plot_options plain = {.theta_deg = {0, 45},
                                          .thetas = 2,
                                          .channel = {true, true, true},
                                          .fits = 1,
                                          .phi_d_deg = 90,
                                          .threads = 1};

static void test_axes_put_values_where_they_belong(void **state)
{
    (void)state;
    struct axes a = {.x = {.scale = SCALE_LOG, .low = 0.01, .high = 100},
                     .y = {.scale = SCALE_ROOT, .low = 0, .high = 90},
                     .left = 10,
                     .top = 20,
                     .width = 400,
                     .height = 300};
    point2 p = rec_axes_at(&a, 1, 22.5);  // the middle of four decades; a quarter's root
    assert_near(p.x, 210, 1e-9);
    assert_near(p.y, 170, 1e-9);
}

static void test_ranges_end_at_round_numbers(void **state)
{
    (void)state;
    double low = 0.013, high = 3.1;
    rec_decades(&low, &high, 4);
    assert_near(low, 0.01, 1e-12);
    assert_near(high, 5, 1e-12);
    low = 1e-9;
    high = 20;
    rec_decades(&low, &high, 4);
    assert_near(low, 0.002, 1e-12);
    assert_near(high, 20, 1e-12);
}

static void test_a_matt_sphere_is_as_bright_as_its_albedo(void **state)
{
    (void)state;
    struct brdf brdf = lambert(0.2, 0.5, 1);
    struct picture p = rec_sphere_picture(&brdf, (vec3){0, 0, 1}, 1, 65, 0, 1);
    uint32_t middle = p.argb[32 * 65 + 32];  // n = l = v: radiance is the albedo, in sRGB
    assert_int_equal(middle >> 24, 255);
    assert_int_equal(middle >> 16 & 255, 124);
    assert_int_equal(middle >> 8 & 255, 188);
    assert_int_equal(middle & 255, 255);
    assert_int_equal(p.argb[0], 0);  // off the sphere
    // 60 degrees off: half of it.
    int i = 32 + (int)lround(32.5 * sin(CAP_PI / 3));
    assert_in_range(p.argb[32 * 65 + i] & 255, 186, 190);
    rec_picture_free(&p);
}

static void test_the_ratio_of_equals_is_white_and_of_twice_is_red(void **state)
{
    (void)state;
    struct brdf a = lambert(0.2, 0.2, 0.2), b = lambert(0.4, 0.4, 0.4);
    struct picture same = rec_ratio_picture(&a, &a, 1, 90, 1.25);
    struct picture twice = rec_ratio_picture(&b, &a, 1, 90, 1.25);
    size_t at = 45 * MERL_THETA_H + 45;
    assert_int_equal(same.argb[at], rec_argb(0xf7f7f7));
    assert_int_equal(twice.argb[at], rec_argb(0xb2182b));
    assert_int_equal(same.argb[MERL_THETA_H - 1], 0);  // both angles at 90 degrees: no such bin
    rec_picture_free(&same);
    rec_picture_free(&twice);
}

static void test_coverage_tells_measured_from_filled(void **state)
{
    (void)state;
    uint8_t *status = malloc(MERL_BINS);
    for (int i = 0; i < MERL_BINS; i++)
        status[i] = rec_merl_above(i) ? BIN_EXTRAPOLATED : BIN_IMPOSSIBLE;
    for (int k = 0; k < MERL_PHI_D; k++) {
        status[k + MERL_PHI_D * (20 + MERL_THETA_D * 10)] = BIN_MEASURED;
        status[k + MERL_PHI_D * (21 + MERL_THETA_D * 10)] = BIN_INTERPOLATED;
    }
    struct picture p = rec_coverage_half(status);
    assert_int_equal(p.argb[(89 - 20) * 90 + 10], rec_argb(rec_ink_rgb(INK_MEASURED)));
    assert_int_equal(p.argb[(89 - 21) * 90 + 10], rec_argb(rec_ink_rgb(INK_MIRRORED)));
    assert_int_equal(p.argb[(89 - 22) * 90 + 10], rec_argb(rec_ink_rgb(INK_FILLED)));
    assert_int_equal(p.argb[89], 0);
    rec_picture_free(&p);
    // theta_i = theta_o = theta_d = 20.5 degrees where theta_h is near 0.
    p = rec_coverage_in_out(status);
    uint32_t red = p.argb[(44 - 10) * 45 + 10] >> 16 & 255;  // not all of its bins, but some
    assert_in_range(red, (rec_ink_rgb(INK_MEASURED) >> 16) + 1,
                    (rec_ink_rgb(INK_SPARSE) >> 16) - 1);
    rec_picture_free(&p);
    free(status);
}

static void test_a_cut_knows_mirror_side_and_horizon(void **state)
{
    (void)state;
    struct plot_source source = {
        .brdf = {.model = rec_model_find("ggx"), .value = {0.1, 0.1, 0.1, 0.05, 1.5}}};
    struct cut *cut = malloc(sizeof *cut);
    rec_cut(cut, &source, &source.brdf, 45);
    int brightest = 0;
    for (int i = 0; i < CUT_POINTS; i++)
        brightest = cut->f[1][i] > cut->f[1][brightest] ? i : brightest;
    assert_near(cut->theta_o_deg[brightest], 45, 1);
    assert_near(cut->theta_o_deg[0], -89.5, 1e-9);
    free(cut);
}

// Counts what is drawn, and remembers the last text.
struct drawn {
    int paths, texts, pictures, open;
};

static struct drawn drawn_by(const char *svg)
{
    struct drawn d = {0};
    for (const char *c = svg; (c = strchr(c, '<')); c++) {
        d.paths += strncmp(c, "<path", 5) == 0;
        d.texts += strncmp(c, "<text", 5) == 0;
        d.pictures += strncmp(c, "<image", 6) == 0;
        d.open += (strncmp(c, "<g ", 3) == 0) - (strncmp(c, "</g>", 4) == 0);
    }
    return d;
}

static void test_the_page_has_groups_for_channels_and_no_numbers_that_are_none(void **state)
{
    (void)state;
    char *svg = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&svg, &size);
    struct pen pen = rec_pen_page(to);
    struct plot_source source = {.name = "a<b", .brdf = lambert(0.1, 0.2, 0.3)};
    rec_plot_polar(&pen, &source, &plain, 1, (point2){0, 0}, 400, 250);
    rec_plot_cartesian(&pen, &source, &plain, 1, (point2){0, 0}, 400, 300);
    rec_plot_slice(&pen, &source, &plain, (point2){0, 0}, 100);
    rec_write(&pen, (point2){0, 0}, ALIGN_LEFT, 10, INK_TEXT, "%s", source.name);
    fclose(to);
    struct drawn d = drawn_by(svg);
    assert_true(d.paths > 20 && d.texts > 20);
    assert_int_equal(d.pictures, 5);  // colour, three channels, a scale
    assert_int_equal(d.open, 0);
    assert_non_null(strstr(svg, "class=\"ch ch2\""));
    assert_non_null(strstr(svg, "a&lt;b"));
    assert_null(strstr(svg, "nan"));
    free(svg);
}

static void test_files_of_each_kind_are_what_their_names_say(void **state)
{
    (void)state;
    static const struct {
        const char *name, *starts;
    } file[] = {{"plot.png", "\x89PNG"}, {"plot.svg", "<?xml"}, {"plot.pdf", "%PDF"}};
    struct plot_source source[2] = {{.name = "a", .brdf = lambert(0.1, 0.2, 0.3)},
                                    {.name = "b", .brdf = lambert(0.2, 0.2, 0.3)}};
    char folder[] = "/tmp/goniocam_plot_test_XXXXXX";
    assert_non_null(mkdtemp(folder));
    for (int i = 0; i < 3; i++) {
        char start[8] = {0}, *path = cap_path(folder, file[i].name);
        assert_int_equal(rec_plot(PLOT_COMPARISON, source, 2, &plain, path, NULL), STATUS_OK);
        FILE *in = fopen(path, "rb");
        assert_non_null(in);
        assert_int_equal(fread(start, 1, 5, in), 5);
        fclose(in);
        assert_memory_equal(start, file[i].starts, strlen(file[i].starts));
        unlink(path);
        free(path);
    }
    struct error err = {0};
    assert_int_equal(rec_plot(PLOT_SPHERE, source, 1, &plain, "plot.gif", &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, ".pdf"));
    assert_int_equal(rec_plot(PLOT_COVERAGE, source, 1, &plain, "plot.png", &err), STATUS_DATA);
    assert_int_equal(rec_plot(PLOT_COMPARISON, source, 1, &plain, "plot.png", &err), STATUS_DATA);
    assert_int_equal(access("plot.png", F_OK), -1);
    rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_axes_put_values_where_they_belong),
        cmocka_unit_test(test_ranges_end_at_round_numbers),
        cmocka_unit_test(test_a_matt_sphere_is_as_bright_as_its_albedo),
        cmocka_unit_test(test_the_ratio_of_equals_is_white_and_of_twice_is_red),
        cmocka_unit_test(test_coverage_tells_measured_from_filled),
        cmocka_unit_test(test_a_cut_knows_mirror_side_and_horizon),
        cmocka_unit_test(test_the_page_has_groups_for_channels_and_no_numbers_that_are_none),
        cmocka_unit_test(test_files_of_each_kind_are_what_their_names_say),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
