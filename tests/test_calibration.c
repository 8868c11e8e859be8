/* test_calibration.c -- calibration.yaml: written and read without loss, and its messages. */
#include "calib.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/goniocam-calibration-XXXXXX";

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    char command[100];
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return system(command);
}

static void path_of(char path[200], const char *name)
{
    snprintf(path, 200, "%s/%s", folder, name);
}

// ---- the round trip

static struct seen_tag tags[2] = {{7, {{0.1, 1.0 / 3}, {2e-300, -5}, {1e17 / 3, 0}, {4, 5}}},
                                  {0, {{1, 2}, {3, 4}, {5, 6}, {7, 8}}}};
static struct camera cameras[2] = {{"wide: \"a\"",
                                    1080,
                                    720,
                                    {2030.1, 2029.0 / 7},
                                    {544.8, 353.6},
                                    {-0.12, 0.09, 6e-4, -4e-4, 1e-17},
                                    {0.03, 0.04},
                                    {0.1, 0.2},
                                    {1e-4, 2e-3, 3e-6, 4e-6, 5e-2},
                                    {-0.03, -0.01},
                                    0.0129},
                                   {"0123", 10, 20, {1, 2}, {3, 4}, {0}, {0}, {0}, {0}, {0}, 0}};
static struct view views[2] = {
    {"0x10",
     1,
     1,
     {{0.1, 0.2, 0.3}, {1.0 / 3, 2e5, -7}},
     {1e-5, 2e-5, 3e-5},
     {0.01, 0.02, 0.03},
     1.0142,
     1e-3,
     0.02,
     0.31,
     {0.015, 0, 0.0025},
     0.0004,
     tags,
     2},
    {"1e5", 0, 0, {{1, 2, 3}, {4, 5, 6}}, {0}, {0}, 0.98, 0, 0, 0, {0}, 0, NULL, 0}};
static struct lamp lamps[2] = {{"lamp0",
                                true,
                                false,
                                {-78.4274, -561.186, 298.1767},
                                {0, 0, 0},
                                12.5,
                                0.7,
                                {1e5, 1.1e5, 0.9e5},
                                {0.06, 0.07, 0.08},
                                {0},
                                {10, 11, 12},
                                {{0.0036, 1e-4, 2e-4, -3e-6},
                                 {1e-4, 0.0049, 3e-4, 4e-6},
                                 {2e-4, 3e-4, 0.0064, 5e-6},
                                 {-3e-6, 4e-6, 5e-6, 1e-8}},
                                {[CUE_BOARD] = {{0, 0, 1}, 0.002, 650, 1.5},
                                 [CUE_HIGHLIGHT] = {{0, 0.6, 0.8}, 0.001, 0, 0},
                                 [CUE_BALL] = {{0.6, 0, 0.8}, 0.003, 0, 0}},
                                {{0.6, 0, 0.8}, 4.5, 0.98, 0.003, 0.05},
                                {0}},
                               {"sun",
                                false,
                                true,
                                {0, 0, 0},
                                {0, 0.6, 0.8},
                                0,
                                0,
                                {1, 2, 3},
                                {0},
                                {1e-4, 2e-4, 3e-4},
                                {0.1, 0, 0},
                                {{0}},
                                {{{0, 0, 0}, 0, 0, 0}},
                                {{0, 0, 0}, 0, 0, 0, 0},
                                {0}}};
static const struct calibration full = {.camera = cameras,
                                        .view = views,
                                        .lamp = lamps,
                                        .sample = {.shape = SHAPE_CYLINDER,
                                                   .radius = 25.000000000000004,
                                                   .height = 80,
                                                   .center = {0.4, -0.3, 46},
                                                   .axis = {0, 0, 1},
                                                   .sigma_center = {0.007, 0.008, 0.009},
                                                   .sigma_radius = 0.01,
                                                   .sigma_turn = {1e-4, 2e-4, 3e-4},
                                                   .outline_rms_px = 0.2,
                                                   .outline_edges = 1234},
                                        .ball = {{.shape = SHAPE_SPHERE,
                                                  .radius = 10.1,
                                                  .center = {-50, 5, 10.25},
                                                  .sigma_center = {0.01, 0.02, 0.03},
                                                  .sigma_radius = 0.04,
                                                  .outline_rms_px = 0.1,
                                                  .outline_edges = 321}},
                                        .cameras = 2,
                                        .views = 2,
                                        .lamps = 2,
                                        .balls = 1};

static void assert_same_views(const struct view *a, const struct view *b)
{
    assert_string_equal(a->name, b->name);
    assert_int_equal(a->camera, b->camera);
    assert_int_equal(a->light, b->light);
    assert_memory_equal(&a->view_from_world, &b->view_from_world, sizeof a->view_from_world);
    assert_memory_equal(a->sigma_rotation, b->sigma_rotation, sizeof a->sigma_rotation);
    assert_memory_equal(a->sigma_translation, b->sigma_translation, sizeof a->sigma_translation);
    assert_true(a->power == b->power && a->sigma_power == b->sigma_power);
    assert_true(a->rms_px == b->rms_px && a->blur_px == b->blur_px);
    assert_memory_equal(a->glare, b->glare, sizeof a->glare);
    assert_true(a->sigma_glare == b->sigma_glare);
    assert_int_equal(a->tags, b->tags);
    for (int i = 0; i < a->tags; i++) {
        assert_int_equal(a->tag[i].id, b->tag[i].id);
        assert_memory_equal(a->tag[i].corner, b->tag[i].corner, sizeof a->tag[i].corner);
    }
}

// The name is a pointer: compare it as text, and the rest as bytes.
static void assert_same_cameras(struct camera a, struct camera b)
{
    assert_string_equal(a.name, b.name);
    a.name = b.name = NULL;
    assert_memory_equal(&a, &b, sizeof a);
}

static void assert_same_lamps(const struct lamp *a, const struct lamp *b)
{
    assert_string_equal(a->name, b->name);
    assert_true(a->on_camera == b->on_camera && a->at_infinity == b->at_infinity);
    assert_memory_equal(&a->position, &b->position, sizeof a->position);
    assert_memory_equal(&a->direction, &b->direction, sizeof a->direction);
    assert_true(a->radius == b->radius && a->sigma_radius == b->sigma_radius);
    assert_memory_equal(a->intensity, b->intensity, sizeof a->intensity);
    assert_memory_equal(a->sigma_position, b->sigma_position, sizeof a->sigma_position);
    assert_memory_equal(a->sigma_direction, b->sigma_direction, sizeof a->sigma_direction);
    assert_memory_equal(a->sigma_intensity, b->sigma_intensity, sizeof a->sigma_intensity);
    assert_memory_equal(a->covariance, b->covariance, sizeof a->covariance);
    assert_memory_equal(a->cue, b->cue, sizeof a->cue);
}

static void test_what_is_written_is_read(void **state)
{
    (void)state;
    char path[200];
    struct calibration c = {0};
    path_of(path, "full.yaml");
    assert_int_equal(cal_calibration_write(&full, path, NULL), STATUS_OK);
    struct error err = {0};
    if (cal_calibration_read(&c, path, &err))
        fail_msg("%s", err.text);
    assert_int_equal(c.cameras, 2);
    assert_int_equal(c.views, 2);
    assert_int_equal(c.lamps, 2);
    for (int i = 0; i < 2; i++) {
        assert_same_cameras(c.camera[i], full.camera[i]);
        assert_same_views(c.view + i, full.view + i);
        assert_same_lamps(c.lamp + i, full.lamp + i);
    }
    assert_int_equal(c.sample.shape, full.sample.shape);
    assert_true(c.sample.radius == full.sample.radius && c.sample.height == full.sample.height);
    assert_memory_equal(&c.sample.center, &full.sample.center, sizeof c.sample.center);
    assert_memory_equal(&c.sample.axis, &full.sample.axis, sizeof c.sample.axis);
    assert_memory_equal(c.sample.sigma_center, full.sample.sigma_center,
                        sizeof c.sample.sigma_center);
    assert_true(c.sample.sigma_radius == full.sample.sigma_radius);
    assert_true(c.sample.outline_rms_px == full.sample.outline_rms_px);
    assert_int_equal(c.sample.outline_edges, full.sample.outline_edges);
    assert_int_equal(c.balls, full.balls);
    assert_memory_equal(&c.ball[0], &full.ball[0], sizeof c.ball[0]);
    cal_calibration_free(&c);
    cal_calibration_free(&c);  // an empty owner may be freed
}

// ---- messages

#define CAMERA "cameras:\n- {name: a, width: 4, height: 3, focal: [5, 5], center: [1, 1]}\n"
#define LIGHT  "lights:\n- {name: l, position: [0, 0, 9], intensity: [1, 1, 1]}\n"
#define SHOT                                                                                       \
    "shots:\n- {name: s, camera: a, light: l, rotation: [0, 0, 0], translation: [0, 0, 1]}\n"

static struct message {
    const char *name, *text, *expected[2];
} messages[] = {
    {"unknown key", CAMERA SHOT LIGHT "samples: 3\n", {"samples", "nexpected"}},
    {"missing key", CAMERA LIGHT, {"shots", "issing"}},
    {"wrong type",
     "cameras:\n- {name: a, width: wide, height: 3, focal: [5, 5], center: [1, 1]}\n",
     {"line 2", "width"}},
    {"too few numbers",
     "cameras:\n- {name: a, width: 4, height: 3, focal: [5], center: [1, 1]}\n",
     {"line 2", "focal"}},
    {"no such camera",
     CAMERA LIGHT "shots:\n- {name: s, camera: b, rotation: [0, 0, 0], translation: [0, 0, 1]}\n",
     {"shot s", "'b'"}},
    {"no such light", CAMERA SHOT "lights: []\n", {"shot s", "'l'"}},
    {"no focal length",
     "cameras:\n- {name: a, width: 4, height: 3, focal: [0, 5], center: [1, 1]}\n" SHOT LIGHT,
     {"camera a", "focal"}},
    {"half a light",
     CAMERA SHOT "lights:\n- {name: l, position: [0, 0, 9]}\n",
     {"light l", "intensity"}},
    {"a frame that is none",
     CAMERA SHOT "lights:\n- {name: l, frame: moon, position: [0, 0, 9], intensity: [1, 1, 1]}\n",
     {"light l", "moon"}},
    {"no radius",
     CAMERA SHOT LIGHT "sample: {shape: sphere, center: [0, 0, 0]}\n",
     {"sample", "radius"}},
    {"another version", "goniocam: 2\n" CAMERA SHOT LIGHT, {"version 2", ""}},
    {"no YAML", "cameras: [\n", {"", ""}},
    {"empty", "", {"", ""}},
};
enum { MESSAGES = sizeof messages / sizeof *messages };

static void test_message(void **state)
{
    const struct message *m = *state;
    char path[200];
    path_of(path, "broken.yaml");
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(m->text, file);
    fclose(file);
    struct calibration c = {.cameras = 77};
    struct error err = {0};
    assert_int_equal(cal_calibration_read(&c, path, &err), STATUS_FORMAT);
    assert_int_equal(c.cameras, 77);  // untouched
    assert_non_null(strstr(err.text, "broken.yaml: "));
    for (int i = 0; i < 2; i++)
        if (!strstr(err.text, m->expected[i]))
            fail_msg("'%s' does not tell of '%s'", err.text, m->expected[i]);
}

static void test_a_calibration_without_luxury(void **state)
{
    (void)state;
    char path[200];
    path_of(path, "plain.yaml");
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(CAMERA SHOT LIGHT "sample: {shape: sphere, center: [1, 2, 3], radius: 4}\n", file);
    fclose(file);
    struct calibration c = {0};
    assert_int_equal(cal_calibration_read(&c, path, NULL), STATUS_OK);
    assert_true(c.view[0].power == 1);
    assert_int_equal(c.view[0].light, 0);
    assert_true(c.sample.shape == SHAPE_SPHERE && c.sample.radius == 4);
    assert_false(c.lamp[0].on_camera);
    cal_calibration_free(&c);
}

static void test_a_file_that_is_not_there(void **state)
{
    (void)state;
    struct calibration c = {0};
    struct error err = {0};
    assert_int_equal(cal_calibration_read(&c, "/nowhere/c.yaml", &err), STATUS_IO);
    assert_non_null(strstr(err.text, "/nowhere/c.yaml"));
    assert_int_equal(cal_calibration_write(&full, "/nowhere/c.yaml", &err), STATUS_IO);
}

int main(void)
{
    const struct CMUnitTest others[] = {
        cmocka_unit_test(test_what_is_written_is_read),
        cmocka_unit_test(test_a_calibration_without_luxury),
        cmocka_unit_test(test_a_file_that_is_not_there),
    };
    enum { OTHERS = sizeof others / sizeof *others };
    struct CMUnitTest tests[MESSAGES + OTHERS];
    for (int i = 0; i < MESSAGES; i++)
        tests[i] = (struct CMUnitTest){messages[i].name, test_message, NULL, NULL, &messages[i]};
    memcpy(tests + MESSAGES, others, sizeof others);
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
