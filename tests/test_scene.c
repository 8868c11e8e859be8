/* SCENE.yaml: what is read, what stands in for keys left out, and what errors name. */
#include "near.h"
#include "scene.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define HEAD  "goniocam_scene: 1\ncamera: {size: [90, 60]}\nexposures: [0.1]\n"
#define LAMP  "lights: [{position: [0, -300, 400]}]\n"
#define BALL  "sample: {radius: 10, material: {model: lambert, albedo: 0.5}}\n"
#define BOARD "board: {size: [80, 60], tags: {grid: {columns: 2, rows: 2, size: 16, pitch: 30}}}\n"
#define SHOT  "shots: [{look: {eye: [0, -300, 300]}}]\n"

static char path[] = "/tmp/test_scene_XXXXXX";

static enum status read_text(struct scene *scene, const char *text, struct error *err)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
    *err = (struct error){0};
    return sam_scene_read(scene, path, err);
}

static struct row {
    const char *name, *text, *line, *story;
} rows[] = {
    {"unknown key", HEAD LAMP BALL BOARD SHOT "sensr: {}\n", ":8:", "unknown key 'sensr'"},
    {"unknown key below", HEAD LAMP BALL BOARD "shots:\n- look: {eye: [0, 0, 9], rol: 3}\n",
     ":8:", "unknown key 'rol'"},
    {"not a number", "goniocam_scene: 1\ncamera:\n  size: [90, 60]\n  aperture: wide\n",
     ":4:", "aperture: a number is wanted, not 'wide'"},
    {"out of range", HEAD LAMP "sample: {radius: -1}\n", ":5:", "radius: -1 is not in"},
    {"key missing", "goniocam_scene: 1\ncamera: {}\nsample: {shape: sphere}\n",
     ":3:", "the key 'radius' is missing"},
    {"no such model", HEAD LAMP "sample:\n  radius: 5\n  material: {model: velvet}\n",
     ":7:", "model: none is called 'velvet'"},
    {"a parameter missing", HEAD LAMP "sample:\n  radius: 5\n  material: {model: lambert}\n",
     ":7:", "the key 'albedo' is missing"},
    {"wrong count", "goniocam_scene: 1\ncamera: {distortion: [1, 2]}\n",
     ":2:", "distortion: a list of 5 numbers is wanted"},
    {"no such lamp", HEAD LAMP BALL BOARD "shots:\n- look: {eye: [0, 0, 9], light: sun}\n",
     ":8:", "light: no lamp is called 'sun'"},
    {"no such family", HEAD LAMP BALL "board: {family: tag1h1, tags: []}\n" SHOT,
     ":6:", "no 'tag1h1'"},
    {"no such id", HEAD LAMP BALL "board: {tags: [{id: 587, size: 9, center: [0, 0, 0]}]}\n" SHOT,
     ":6:", "no id 587"},
    {"bits cut off",
     HEAD LAMP BALL "board: {family: tagStandard41h12, margin: 3, tags: [{id: 0, size: 9, center: "
                    "[0, 0, 0]}]}\n" SHOT,
     ":6:", "bits of tagStandard41h12 reach 3.6 mm"},
    {"camera in the sample",
     HEAD LAMP BALL BOARD "shots:\n- look: {eye: [0, 0, 21], target: [0, 0, 0]}\n",
     ":8:", "camera of shot 0 is inside the sample"},
    {"lamp in the board", HEAD "lights: [{position: [90, 0, 5], radius: 6}]\n" BALL BOARD SHOT,
     ":7:", "lamp of shot 0 is in"},
    {"a mosaic as TIFF", HEAD "sensor: {mosaic: rggb}\nfiles: tiff\n", ":5:", "writes dng"},
    {"no such thing", HEAD LAMP BALL BOARD SHOT "things:\n- {shape: cone, center: [9, 9, 9]}\n",
     ":9:", "shape: ball, cylinder or box, not 'cone'"},
    {"a sample that is a mirror", HEAD LAMP "sample: {radius: 10, material: {mirror: 1}}\n" BOARD,
     ":5:", "mirror: a sample's reflectance is finite"},
    {"not YAML", "goniocam_scene: 1\ncamera: {size: [90\nseed: 3\n", ":", ""},
    {"not a scene", "goniocam: 1\n", ":1:", "goniocam_scene: 1"},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_errors_name_file_line_and_key(void **state)
{
    const struct row *r = *state;
    struct scene scene = {.shots = 77};
    struct error err;
    assert_int_equal(read_text(&scene, r->text, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, path));
    assert_non_null(strstr(err.text, r->line));
    assert_non_null(strstr(err.text, r->story));
    assert_int_equal(scene.shots, 77);  // untouched
}

static void test_no_file(void **state)
{
    (void)state;
    struct scene scene;
    struct error err = {0};
    assert_int_equal(sam_scene_read(&scene, "/nowhere/scene.yaml", &err), STATUS_IO);
    assert_non_null(strstr(err.text, "/nowhere/scene.yaml: No such file"));
}

static void test_what_is_read(void **state)
{
    (void)state;
    struct scene s;
    struct error err;
    const char *text =
        "goniocam_scene: 1\nname: ball\nseed: 12\n"
        "camera: {size: [900, 600], focal_length: 50, sensor_width: 25}\n"
        "exposures: [0.5, 0.25]\n"
        "lights: [{azimuth_deg: 90, elevation_deg: 0, distance: 100},"
        " {name: sun, distant: true, direction: [0, 3, 4], intensity: 2}]\n"
        "sample: {radius: 10, center: [1, 2, 30], nominal_center: [0, 0, 30],"
        " material: {model: ggx, albedo: [0.1, 0.2, 0.3], alpha: 0.4, ior: 1.5}}\n" BOARD
        "patch: {center: [20, 10], size: [8, 4], turn_deg: 90}\n"
        "shots: [{spiral: {count: 3, distance: 500, elevation_deg: [0, 60]}}]\n";
    assert_int_equal(read_text(&s, text, &err), STATUS_OK);
    assert_near(s.camera.focal[0], 50.0 * 900 / 25, 1e-12);
    assert_near(s.camera.center[0], 449.5, 0);      // the middle of pixels 0..899
    assert_near(s.lamp[0].position.y, 100, 1e-12);  // around the nominal centre
    assert_near(s.lamp[0].position.z, 30, 1e-12);
    assert_string_equal(s.lamp[0].name, "lamp0");
    assert_string_equal(s.lamp[1].name, "sun");
    assert_int_equal(s.lamp[1].kind, LAMP_DISTANT);
    assert_near(s.lamp[1].direction.z, 0.8, 1e-15);
    assert_near(s.sample.place.center.x, 1, 0);
    assert_near(s.sample.material.part[0].parameter[4], 1.5, 0);
    assert_int_equal(s.board.tags, 4);
    assert_near(s.board.margin, 2, 1e-12);         // one bit of eight
    assert_near(s.board.tag[0].center.x, -15, 0);  // the first tag is at the top left
    assert_near(s.board.tag[0].center.y, 15, 0);
    // Turned by a quarter, the bottom left corner comes to the bottom right.
    assert_near(s.patch[0].patch.corner[0].x, 22, 1e-12);
    assert_near(s.patch[0].patch.corner[0].y, 6, 1e-12);
    assert_near(s.patch[0].patch.corner[0].z, 2, 0);
    assert_int_equal(s.shots, 3);
    vec3 last = vec3_sub(cal_eye(s.shot[2].view_from_world), s.sample.nominal.center);
    assert_near(last.z, 500 * sin(60 * CAP_PI / 180), 1e-9);
    sam_scene_free(&s);
}

static void test_a_hand_strays_as_told_and_as_seeded(void **state)
{
    (void)state;
    struct error err;
    struct scene a, b;
    const char *text =
        HEAD LAMP BALL BOARD "handheld: {place: 5}\n"
                             "shots: [{arc: {count: 400, distance: 300, elevation_deg: 45}}]\n";
    assert_int_equal(read_text(&a, text, &err), STATUS_OK);
    assert_int_equal(read_text(&b, text, &err), STATUS_OK);
    double square = 0;
    vec3 meant = {300 * cos(CAP_PI / 4), 0, 20 + 300 * sin(CAP_PI / 4)};
    for (int i = 0; i < a.shots; i++) {
        vec3 off = vec3_sub(cal_eye(a.shot[i].view_from_world), meant);
        square += vec3_dot(off, off) / (3.0 * a.shots);
        assert_memory_equal(&a.shot[i], &b.shot[i], sizeof a.shot[i]);
    }
    assert_near(square, 25, 5 * 25 * sqrt(2.0 / (3 * a.shots)));
    sam_scene_free(&a);
    sam_scene_free(&b);
}

static int make_file(void **state)
{
    (void)state;
    int fd = mkstemp(path);
    return fd < 0 ? -1 : close(fd);
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 3];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_errors_name_file_line_and_key, NULL, NULL,
                                       &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_no_file);
    tests[ROWS + 1] = (struct CMUnitTest)cmocka_unit_test(test_what_is_read);
    tests[ROWS + 2] = (struct CMUnitTest)cmocka_unit_test(test_a_hand_strays_as_told_and_as_seeded);
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
