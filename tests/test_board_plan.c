/* test_board_plan.c -- a printable board: nothing overlaps, and a scan of the page holds its tags
 * where capture.yaml will say. */
#include "board_draw.h"
#include "detect.h"
#include "near.h"

#include <stdlib.h>

static struct tag_family family;
static struct board_plan plan;

static void make(const char *paper_name, const char *family_name)
{
    double paper[2];
    assert_true(board_plan_paper(paper, paper_name));
    assert_int_equal(pattern_open(&family, family_name, NULL), STATUS_OK);
    assert_int_equal(board_plan_make(&plan, paper, 0, &family, NULL), STATUS_OK);
}

static void papers_have_names_and_sizes(void **state)
{
    (void)state;
    double paper[2];
    assert_true(board_plan_paper(paper, "A3"));
    assert_near(paper[0], 420, 0);
    assert_near(paper[1], 297, 0);
    assert_true(board_plan_paper(paper, "300x210.5"));
    assert_near(paper[0], 300, 0);
    assert_near(paper[1], 210.5, 0);
    assert_false(board_plan_paper(paper, "300"));
    assert_false(board_plan_paper(paper, "-3x5"));
    assert_false(board_plan_paper(paper, "a4 "));
}

/** Half the printed pattern, white surround included. */
static double reach(const struct tag_place *tag)
{
    return 0.5 * tag->size * family.tags->total_width / family.tags->width_at_border;
}

static void nothing_overlaps(void **state)
{
    (void)state;
    static const char *const papers[] = {"a5", "a4", "a3", "letter", "a0", "250x250", "200x400"};
    static const char *const families[] = {"tag36h11", "tag25h9", "tagStandard41h12"};
    for (int p = 0; p < 7; p++)
        for (int f = 0; f < 3; f++) {
            make(papers[p], families[f]);
            assert_true(plan.tags >= 12);
            for (int i = 0; i < plan.tags; i++) {
                const struct tag_place *a = &plan.tag[i];
                double r = reach(a), half = 0.5 * plan.patch_side;
                assert_true(fabs(a->center.x) + r < 0.5 * plan.paper[0] - 5);
                assert_true(fabs(a->center.y) + r < 0.5 * plan.paper[1] - 5);
                assert_true(a->center.y - r > plan.ruler_y + 6);
                assert_true(hypot(fmax(fabs(a->center.x) - r, 0), fmax(fabs(a->center.y) - r, 0))
                            > plan.sample_radius);
                assert_true(fabs(a->center.x - plan.patch[0]) > r + half
                            || fabs(a->center.y - plan.patch[1]) > r + half);
                for (int k = 0; k < i; k++) {
                    const struct tag_place *b = &plan.tag[k];
                    assert_int_not_equal(a->id, b->id);
                    assert_true(fabs(a->center.x - b->center.x) > 2 * r - 1e-9
                                || fabs(a->center.y - b->center.y) > 2 * r - 1e-9);
                }
            }
            assert_true(plan.ruler >= 100 && plan.ruler < plan.paper[0] - 10);
            pattern_close(&family);
        }
}

static void small_paper_is_told(void **state)
{
    (void)state;
    const double paper[2] = {80, 60};
    struct error err = {0};
    assert_int_equal(pattern_open(&family, "tag36h11", NULL), STATUS_OK);
    assert_int_equal(board_plan_make(&plan, paper, 0, &family, &err), STATUS_DATA);
    assert_int_equal(board_plan_make(&plan, (const double[]){297, 210}, 90, &family, &err),
                     STATUS_DATA);
    pattern_close(&family);
}

/** A printer that shrinks by one per cent shrinks all lengths by one per cent. */
static void a_measured_ruler_scales_all(void **state)
{
    (void)state;
    make("a4", "tag36h11");
    struct board_plan meant = plan;
    assert_near(meant.ruler, 150, 0);
    board_plan_scale(&plan, 148.5);
    assert_near(plan.tag[0].size, 0.99 * meant.tag[0].size, 1e-12);
    assert_near(plan.tag[3].center.x, 0.99 * meant.tag[3].center.x, 1e-12);
    assert_near(plan.patch[0], 0.99 * meant.patch[0], 1e-12);
    assert_near(plan.ruler, 148.5, 1e-12);
    pattern_close(&family);
}

/** The page at `scale` pixels a millimetre, as a radiance map. */
static void scan(struct radiance *map, double scale)
{
    int width = (int)(plan.paper[0] * scale), height = (int)(plan.paper[1] * scale);
    cairo_surface_t *surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
    cairo_t *cr = cairo_create(surface);
    cairo_set_source_rgb(cr, 1, 1, 1);
    cairo_paint(cr);
    cairo_scale(cr, scale, scale);
    assert_int_equal(board_draw(cr, &plan, &family, NULL), STATUS_OK);
    cairo_surface_flush(surface);
    size_t count = 3 * (size_t)width * (size_t)height;
    *map = (struct radiance){.width = width,
                             .height = height,
                             .value = malloc(count * sizeof(float)),
                             .variance = calloc(count, sizeof(float))};
    assert_non_null(map->value);
    const unsigned char *from = cairo_image_surface_get_data(surface);
    int stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int c = 0; c < 3; c++)
                map->value[3 * ((size_t)y * (size_t)width + (size_t)x) + (size_t)c] =
                    from[(size_t)y * (size_t)stride + 4 * (size_t)x + (size_t)c] / 255.0f;
    cairo_destroy(cr);
    cairo_surface_destroy(surface);
}

/** Every tag is found, and its corners are where the plan has them, to AprilTag's 0.2 px. */
static void the_page_shows_its_tags(void **state)
{
    (void)state;
    static const char *const families[] = {"tag36h11", "tag25h9", "tag16h5", "tagStandard41h12"};
    const double scale = 4.3;
    for (int f = 0; f < 4; f++) {
        struct radiance map;
        struct detector detector = {0};
        make("a4", families[f]);
        struct capture capture = {.tag = plan.tag, .tags = plan.tags};
        struct detection *found = NULL;
        int count = 0;
        scan(&map, scale);
        assert_int_equal(detector_begin(&detector, families[f], NULL), STATUS_OK);
        assert_int_equal(detector_find(&detector, &capture, &map, &found, &count, NULL), STATUS_OK);
        assert_int_equal(count, plan.tags);
        for (int i = 0; i < count; i++)
            for (int k = 0; k < 4; k++) {
                vec3 p = cap_tag_corner(&plan.tag[found[i].id], k);
                double x = (p.x + 0.5 * plan.paper[0]) * scale - 0.5;
                double y = (0.5 * plan.paper[1] - p.y) * scale - 0.5;
                assert_near(found[i].corner[k][0], x, 0.3);
                assert_near(found[i].corner[k][1], y, 0.3);
            }
        detector_end(&detector);
        pattern_close(&family);
        cap_radiance_free(&map);
        free(found);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(papers_have_names_and_sizes),
        cmocka_unit_test(nothing_overlaps),
        cmocka_unit_test(small_paper_is_told),
        cmocka_unit_test(a_measured_ruler_scales_all),
        cmocka_unit_test(the_page_shows_its_tags),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
