/* Printed tags: what the AprilTag library's own detector says of a rendered board. */
#include "film.h"
#include "near.h"
#include "place.h"
#include "tags.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 800, HEIGHT = 600, TAGS = 8 };

/** A board of TAGS tags; every other one is turned, each by another quarter. */
static struct scene board_scene(const char *family, double size, struct tag_place tag[TAGS])
{
    static struct scene_lamp lamp = {.position = {0, -50, 900}, .intensity = {1e6, 1e6, 1e6}};
    static struct scene_shot shot = {.power = 1};
    static const vec3 axis[4] = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
    for (int i = 0; i < TAGS; i++)
        tag[i] = (struct tag_place){.id = 3 * i,
                                    .size = size,
                                    .center = {(i % 4 - 1.5) * 60, (0.5 - i / 4) * 70, 0},
                                    .x_axis = axis[i % 4],
                                    .y_axis = axis[(i + 1) % 4]};
    struct scene scene = {
        .camera = {.width = WIDTH,
                   .height = HEIGHT,
                   .focal = {1000, 1000},
                   .center = {396, 303},
                   .distortion = {-0.1, 0.05, 0.001, -0.001, 0}},
        .lamp = &lamp,
        .lamps = 1,
        .shot = &shot,
        .shots = 1,
        .sample = {.place = {.shape = SHAPE_SPHERE, .radius = 1, .center = {0, 0, -500}},
                   .material = sam_material(rec_model_find("lambert"), (const double[]){0, 0, 0})},
        .board = {.size = {300, 200},
                  .albedo = 0.2,
                  .tag = tag,
                  .tags = TAGS,
                  .margin = 0.5 * size,
                  .thickness = 0.1,
                  .white = 0.8,
                  .black = 0.04},
    };
    snprintf(scene.board.family, sizeof scene.board.family, "%s", family);
    shot.view_from_world = sam_look_at((vec3){80, -260, 420}, (vec3){0, 0, 0}, 0.2);
    return scene;
}

static image_u8_t *photograph(const struct scene *scene)
{
    float *value = malloc(sizeof *value * WIDTH * HEIGHT * 3);
    struct world world;
    assert_int_equal(sam_world_build(&world, scene, NULL), STATUS_OK);
    assert_int_equal(sam_film_expose(&world, scene->shot, 2, value, NULL), STATUS_OK);
    float white = 0;
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 3; i++)
        white = fmaxf(white, value[i]);
    image_u8_t *image = image_u8_create(WIDTH, HEIGHT);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            image->buf[y * image->stride + x] =
                (uint8_t)(250 * value[3 * (y * WIDTH + x)] / white + 0.5f);
    sam_world_free(&world);
    free(value);
    return image;
}

/** The detected corners are where the tag's printed corners project to, in capture.h's order.
 *  The library counts pixels from the corner of the first: 0.5 less is our pixel. */
static void check(const struct scene *scene, const apriltag_detection_t *seen, double *square)
{
    const struct tag_place *tag = NULL;
    for (int i = 0; i < TAGS; i++)
        if (scene->board.tag[i].id == seen->id)
            tag = &scene->board.tag[i];
    assert_non_null(tag);
    assert_int_equal(seen->hamming, 0);
    for (int k = 0; k < 4; k++) {
        double pixel[2];
        vec3 p = cal_to_view(scene->shot[0].view_from_world, cap_tag_corner(tag, k));
        cal_project(&scene->camera, p, pixel);
        for (int i = 0; i < 2; i++) {
            double off = seen->p[k][i] - 0.5 - pixel[i];
            assert_near(off, 0, 0.35);
            *square += off * off / (8 * TAGS);
        }
    }
}

static void check_family(const char *name, double size, apriltag_family_t *family)
{
    struct tag_place tag[TAGS];
    struct scene scene = board_scene(name, size, tag);
    image_u8_t *image = photograph(&scene);
    apriltag_detector_t *detector = apriltag_detector_create();
    detector->quad_decimate = 1;
    apriltag_detector_add_family(detector, family);
    zarray_t *found = apriltag_detector_detect(detector, image);
    assert_int_equal(zarray_size(found), TAGS);
    double square = 0;
    for (int i = 0; i < TAGS; i++) {
        apriltag_detection_t *seen;
        zarray_get(found, i, &seen);
        check(&scene, seen, &square);
    }
    print_message("corners rms %.3f px\n", sqrt(square));
    // The library's corners of such tags in a linear image are good to 0.1 px (facts.md).
    assert_true(sqrt(square) < 0.12);
    apriltag_detections_destroy(found);
    apriltag_detector_destroy(detector);
    image_u8_destroy(image);
}

static void test_tag36h11_is_found_where_it_is(void **state)
{
    (void)state;
    apriltag_family_t *family = tag36h11_create();
    check_family("tag36h11", 40, family);
    tag36h11_destroy(family);
}

// A family of the newer kind: its border is white inside, and bits lie outside of it.
static void test_standard_tags_too(void **state)
{
    (void)state;
    apriltag_family_t *family = tagStandard41h12_create();
    check_family("tagStandard41h12", 25, family);
    tagStandard41h12_destroy(family);
}

static void test_a_pattern_has_a_black_border_on_white(void **state)
{
    (void)state;
    struct tag_family f;
    assert_true(sam_tag_family(&f, "tag36h11"));
    assert_int_equal(f.tags, 587);
    assert_int_equal(f.border, 8);
    for (int i = 0; i < 8; i++) {
        double x = i - 3.5;
        assert_false(sam_tag_white(&f, 5, x, 3.5));
        assert_false(sam_tag_white(&f, 5, x, -3.5));
        assert_false(sam_tag_white(&f, 5, -3.5, x));
        assert_true(sam_tag_white(&f, 5, x, 4.5));
        assert_true(sam_tag_white(&f, 5, 14.5, x));
    }
    sam_tag_family_free(&f);
    assert_false(sam_tag_family(&f, "tag36h12"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tag36h11_is_found_where_it_is),
        cmocka_unit_test(test_standard_tags_too),
        cmocka_unit_test(test_a_pattern_has_a_black_border_on_white),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
