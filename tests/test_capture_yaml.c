/* capture.yaml: what it says arrives, and what is wrong in it is told with file, line and key. */
#include "capture_yaml.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char path[] = "/tmp/test_capture_yaml_XXXXXX";

static int make_file(void **state)
{
    (void)state;
    int file = mkstemp(path);
    return file < 0 ? -1 : close(file);
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

/* Write text, read it, check it. */
static enum status check_text(struct capture *capture, struct capture_yaml *yaml, const char *text,
                              struct error *err)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
    enum status status = capture_yaml_read(yaml, path, err);
    return status ? status : capture_check(capture, yaml, err);
}

static struct row {
    const char *name, *text;
    int line;
    const char *story;  // what the message has to hold, besides file and line
} rows[] = {
    {"unknown key at the top", "goniocam: 1\nsampel: 3\n", 2, "sampel"},
    {"unknown key in a tag",
     "goniocam: 1\nboard:\n  family: tag36h11\n  tags:\n  - {id: 0, size: 24, center: [1, 2, 3]}\n"
     "  - {id: 1, sise: 24, center: [1, 2, 3]}\n",
     6, "sise"},
    {"unknown key after a list was made",
     "goniocam: 1\nflat: a.tif\nreference:\n  albedo: 0.5\n"
     "  corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n  colour: 3\n",
     6, "colour"},
    {"text for a number",
     "goniocam: 1\nsample: {shape: sphere,\n  radius: big,\n center: [0, 0, 0]}", 3,
     "sample.radius: this has to be a number"},
    {"a unit after a number", "goniocam: 1\nsample:\n  shape: sphere\n  radius: 25mm\n", 4,
     "sample.radius"},
    {"a list for a number", "goniocam: 1\nsample:\n  shape: sphere\n  radius: [1, 2]\n", 4,
     "sample.radius"},
    {"a number for a map", "goniocam: 1\nboard: 7\n", 2, "board"},
    {"no whole number",
     "goniocam: 1\nboard:\n  family: tag36h11\n  tags:\n"
     "  - {id: 1.5, size: 24, center: [1, 2, 3]}\n",
     5, "board.tags[0].id"},
    {"two of three coordinates",
     "goniocam: 1\nsample: {shape: sphere, radius: 1,\n  center: [1, 2]}\n", 3, "sample.center"},
    {"a missing key", "goniocam: 1\nboard:\n  family: tag36h11\n  tags:\n  - {size: 3}\n", 5, "id"},
    {"a tag of no size", "goniocam: 1\nboard:\n  family: tag36h11\n  tags:\n  - {id: 1}\n", 5,
     "board.tags[0].size: is missing (or one `tag_size`"},
    {"a board of nothing", "goniocam: 1\nboard:\n  family: tag36h11\n", 2,
     "board: says neither `tags` nor `tag_size`"},
    {"tags of no size", "goniocam: 1\nboard: {family: tag36h11,\n  tag_size: 0}\n", 3,
     "board.tag_size: has to be positive"},
    {"places known exactly",
     "goniocam: 1\nboard: {family: tag36h11, tag_size: 9,\n  place_sigma: 0}\n", 3,
     "board.place_sigma: has to be positive"},
    {"intrinsics that are not there", "goniocam: 1\ncamera:\n  intrinsics: nowhere.yaml\n", 3,
     "there is no such file"},
    {"intrinsics used somehow", "goniocam: 1\ncamera:\n  intrinsics: /dev/null\n  use: somehow\n",
     4, "neither fixed nor prior"},
    {"no version", "flat: a.tif\n", 1, "goniocam"},
    {"another version", "goniocam: 2\n", 1, "format 2"},
    {"a key twice", "goniocam: 1\nflat: a.tif\nflat: b.tif\n", 3, "flat: this key stands here for"},
    {"a glob without quotes", "goniocam: 1\nphotos:\n  pattern: *.tif\n", 3, ""},
    {"an alias", "goniocam: 1\nphotos: {pattern: *tif}\n", 2, "put quotes around a glob"},
    {"broken YAML", "goniocam: 1\nboard: {family: [tag36h11}\n", 2, ""},
    {"a negative radius",
     "goniocam: 1\nsample:\n  shape: sphere\n  center: [0, 0, 0]\n"
     "  radius: -2\n",
     5, "sample.radius: has to be positive"},
    {"a radius known too well",
     "goniocam: 1\nsample:\n  shape: sphere\n  center: [0, 0, 0]\n  radius: 2\n"
     "  radius_sigma: 0\n",
     6, "sample.radius_sigma: has to be positive"},
    {"no radius", "goniocam: 1\nsample:\n  shape: sphere\n  center: [0, 0, 0]\n", 2,
     "sample.radius"},
    {"an unknown shape", "goniocam: 1\nsample: {shape: cube, radius: 1, center: [0, 0, 0]}\n", 2,
     "'cube' is no shape"},
    {"an axis that is no unit vector",
     "goniocam: 1\nsample:\n  shape: cylinder\n  radius: 3\n"
     "  height: 9\n  center: [0, 0, 0]\n  axis: [0, 0, 2]\n",
     7, "sample.axis: this axis has"},
    {"a mesh with a radius", "goniocam: 1\nsample:\n  shape: mesh\n  file: a.ply\n  radius: 3\n", 5,
     "sample.radius"},
    {"a mesh of no size", "goniocam: 1\nsample:\n  shape: mesh\n  file: a.ply\n  scale: -1\n", 5,
     "sample.scale"},
    {"a mesh without a file", "goniocam: 1\nsample:\n  shape: mesh\n", 2, "sample.file"},
    {"a tag twice",
     "goniocam: 1\nboard:\n  family: tag36h11\n  tags:\n"
     "  - {id: 4, size: 24, center: [1, 2, 3]}\n  - {id: 4, size: 24, center: [9, 2, 3]}\n",
     6, "board.tags[1].id: tag 4"},
    {"a tag without size",
     "goniocam: 1\nboard:\n  family: tag36h11\n  tags:\n"
     "  - {id: 4, size: 0, center: [1, 2, 3]}\n",
     5, "board.tags[0].size"},
    {"tag axes that are not at right angles",
     "goniocam: 1\nboard:\n  family: tag36h11\n  tags:\n"
     "  - id: 4\n    size: 2\n    center: [1, 2, 3]\n    y_axis: [1, 0, 0]\n",
     8, "right angles"},
    {"a patch that is a line",
     "goniocam: 1\nreference:\n  albedo: 0.9\n"
     "  corners: [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]\n",
     4, "corners of a flat patch"},
    {"a patch that crosses itself",
     "goniocam: 1\nreference:\n- albedo: 0.9\n"
     "  corners: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]\n",
     4, "reference[0].corners"},
    {"an albedo above 1",
     "goniocam: 1\nreference: {albedo: 1.2,\n"
     "  corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]}\n",
     2, "albedo"},
    {"a patch without albedo",
     "goniocam: 1\nreference:\n  corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n", 3,
     "reference[0].albedo: is missing"},
    {"a patch without corners", "goniocam: 1\nreference:\n  albedo: 0.9\n", 3,
     "reference[0].corners: is missing"},
    {"a reference capture that is not there", "goniocam: 1\nreference:\n  capture: nowhere\n", 3,
     "reference[0].capture: is no capture"},
    {"a reference capture with corners",
     "goniocam: 1\nreference:\n  capture: white\n"
     "  corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n",
     4, "reference[0].corners: are those"},
    {"a reference capture beside a patch",
     "goniocam: 1\nreference:\n- capture: white\n"
     "- albedo: 0.9\n  corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n",
     3, "reference[0].capture: a capture is the only"},
    {"a reference sample brighter than white",
     "goniocam: 1\nreference:\n  capture: white\n  albedo: 1.1\n", 4, "reference[0].albedo"},
    {"two lamps of one name",
     "goniocam: 1\nlights:\n- {name: a, photos: x*}\n- {name: a, photos: y*}\n", 4,
     "lights[1].name"},
    {"a lamp of negative size", "goniocam: 1\nlights:\n- {name: a, photos: x*, radius: -3}\n", 3,
     "lights[0].radius"},
    {"a lamp in no frame", "goniocam: 1\nlights:\n- {name: a, photos: x*, frame: moon}\n", 3,
     "'moon'"},
    {"a response that is no file", "goniocam: 1\nresponse: my.txt\n", 2, "my.txt"},
    {"an occluder without size", "goniocam: 1\noccluders:\n- {shape: box, center: [0, 0, 1]}\n", 3,
     "occluders[0].size: is missing"},
    {"an occluder of no shape", "goniocam: 1\noccluders: [{shape: cone}]\n", 2,
     "'cone' is no shape"},
    {"a ball without size", "goniocam: 1\nballs:\n- {radius: 0, center: [0, 0, 1]}\n", 3,
     "balls[0].radius: has to be positive"},
    {"a ball without a place", "goniocam: 1\nballs: [{radius: 3}]\n", 2, "center"},
    {"more balls than there is room for",
     "goniocam: 1\nballs:\n- {radius: 1, center: [0, 0, 1]}\n- {radius: 1, center: [0, 0, 1]}\n"
     "- {radius: 1, center: [0, 0, 1]}\n- {radius: 1, center: [0, 0, 1]}\n"
     "- {radius: 1, center: [0, 0, 1]}\n",
     2, "at most 4"},
    {"read noise without gain", "goniocam: 1\nnoise: {read_noise: 5}\n", 2, "noise.read_noise"},
    {"white below black", "goniocam: 1\nnoise:\n  black: 128\n  white: 100\n", 4, "noise.white"},
    {"an empty list", "goniocam: 1\nlights: []\n", 2, "lights"},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_complaint(void **state)
{
    const struct row *r = *state;
    struct capture capture = {.folder = strdup("folder")};
    struct capture_yaml yaml = {0};
    struct error err = {0};
    char line[32];
    snprintf(line, sizeof line, ": line %d: ", r->line);
    assert_int_equal(check_text(&capture, &yaml, r->text, &err), STATUS_FORMAT);
    if (!strstr(err.text, path) || !strstr(err.text, line) || !strstr(err.text, r->story))
        fail_msg("'%s' lacks '%s' or '%s'", err.text, line, r->story);
    cap_capture_free(&capture);
    capture_yaml_free(&yaml);
}

static void test_one_thing_stands_for_a_list_of_it(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "goniocam: 1\nlights: [{name: a, photos: \"x*\"}]\nflat: b'[0-9].tif\nreference:\n"
        "    albedo: 0.5\n    corners: [[0, 0, 0], [1, 0, 0],\n      [1, 1, 0], [0, 1, 0]]\n"
        "dark: d.tif\n",
        "goniocam: 1\nlights:\n- {name: a, photos: [x*]}\nflat: [\"b'[0-9].tif\"]\nreference:\n"
        "- {albedo: 0.5, corners: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]}\n"
        "dark: [d.tif]\n",
        "{\"goniocam\": 1, \"lights\": [{\"name\": \"a\", \"photos\": \"x*\"}],"
        " \"flat\": \"b'[0-9].tif\", \"reference\": {\"albedo\": 0.5, \"corners\":"
        " [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]}, \"dark\": [\"d.tif\"]}",
    };
    for (int i = 0; i < 3; i++) {
        struct capture capture = {0};
        struct capture_yaml yaml = {0};
        struct error err = {0};
        if (check_text(&capture, &yaml, texts[i], &err))
            fail_msg("%s", err.text);
        assert_int_equal(yaml.root->light[0].photos, 1);
        assert_string_equal(yaml.root->light[0].photo[0], "x*");
        assert_int_equal(yaml.root->flats, 1);
        assert_string_equal(yaml.root->flat[0], "b'[0-9].tif");
        assert_true(capture_yaml_matches(yaml.root->flat, 1, "b'7.tif"));
        assert_string_equal(yaml.root->dark[0], "d.tif");
        assert_int_equal(capture.patches, 1);
        assert_near(capture.patch[0].corner[2].y, 1, 0);
        cap_capture_free(&capture);
        capture_yaml_free(&yaml);
    }
}

static void test_values_arrive(void **state)
{
    (void)state;
    static const char text[] =
        "goniocam: 1\n"
        "board: {family: tag36h11, tags: [{id: 7, size: 40, center: [-130, 130.5, 0]},\n"
        "  {id: 8, size: 20, center: [1, 2, 3], x_axis: [0, 1, 0], y_axis: [0, 0, 1]}]}\n"
        "sample: {shape: cylinder, radius: 25.0, height: 90, center: [0, 0, 60], axis: [0, 1, 0]}\n"
        "lights: [{name: a, photos: x*, frame: camera}, {name: b, photos: [y*, z*],\n"
        "  position: [1, 2, 3], radius: 12}]\n"
        "balls: [{radius: 10, center: [-50, 5, 10]}, {radius: 6, radius_sigma: 0.2, center: [1, 2, "
        "3]}]\n"
        "noise: {black: 64, gain: 2}\n";
    struct capture capture = {0};
    struct capture_yaml yaml = {0};
    struct error err = {0};
    if (check_text(&capture, &yaml, text, &err))
        fail_msg("%s", err.text);
    assert_int_equal(capture.balls, 2);
    assert_near(capture.ball[0].center.x, -50, 0);
    assert_near(capture.ball[0].radius_sigma, 0.05, 1e-12);  // a caliper's half per cent
    assert_near(capture.ball[1].radius, 6, 0);
    assert_near(capture.ball[1].radius_sigma, 0.2, 0);
    assert_string_equal(capture.family, "tag36h11");
    assert_int_equal(capture.tags, 2);
    assert_int_equal(capture.tag[0].id, 7);
    // Bottom left of a tag of 40 mm about (-130, 130.5); top right of one that stands upright.
    vec3 a = cap_tag_corner(&capture.tag[0], 0), b = cap_tag_corner(&capture.tag[1], 2);
    assert_near(a.x, -150, 1e-12);
    assert_near(a.y, 110.5, 1e-12);
    assert_near(b.y, 12, 1e-12);
    assert_near(b.z, 13, 1e-12);
    assert_int_equal(capture.sample.shape, SHAPE_CYLINDER);
    assert_near(capture.sample.height, 90, 0);
    assert_near(capture.sample.axis.y, 1, 0);
    assert_int_equal(capture.lights, 2);
    assert_true(capture.light[0].on_camera);
    assert_false(capture.light[0].has_position);
    assert_true(capture.light[1].has_position);
    assert_near(capture.light[1].position.z, 3, 0);
    assert_near(capture.light[0].radius, 0, 0);
    assert_near(capture.light[1].radius, 12, 0);
    assert_near(capture.black, 64, 0);
    assert_near(capture.gain, 2, 0);
    assert_true(isnan(capture.white) && isnan(capture.read_noise));
    cap_capture_free(&capture);
    capture_yaml_free(&yaml);
}

static void test_no_file(void **state)
{
    (void)state;
    struct capture_yaml yaml = {0};
    struct error err = {0};
    assert_int_equal(capture_yaml_read(&yaml, "/nowhere/capture.yaml", &err), STATUS_IO);
    assert_non_null(strstr(err.text, "/nowhere/capture.yaml"));
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 3];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_complaint, NULL, NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_one_thing_stands_for_a_list_of_it);
    tests[ROWS + 1] = (struct CMUnitTest)cmocka_unit_test(test_values_arrive);
    tests[ROWS + 2] = (struct CMUnitTest)cmocka_unit_test(test_no_file);
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
