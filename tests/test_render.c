/* A whole capture: the same bytes at any number of threads, and papers that others can read. */
#include "near.h"
#include "render.h"
#include "truth.h"

#include <glob.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char base[] = "/tmp/test_render_XXXXXX";

/** tiny.yaml with two shots, in `folder` below base. */
static void render(const char *folder, int threads, enum status expected, struct error *err)
{
    struct scene scene;
    struct run run;
    char path[100];
    snprintf(path, sizeof path, "%s/%s", base, folder);
    assert_int_equal(sam_scene_read(&scene, SCENES "/tiny.yaml", err), STATUS_OK);
    scene.shots = 2;
    scene.flat = scene.radiance = true;
    cap_run_begin(&run, threads, true);
    assert_int_equal(sam_render(&scene, path, &run, err), expected);
    cap_run_end(&run);
    sam_scene_free(&scene);
}

static char *read_file(const char *path, long *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = ftell(file);
    rewind(file);
    char *bytes = malloc((size_t)*size + 1);
    assert_int_equal(fread(bytes, 1, (size_t)*size, file), *size);
    bytes[*size] = '\0';
    fclose(file);
    return bytes;
}

static void assert_same_file(const char *name)
{
    char a[200], b[200];
    long size_a, size_b;
    snprintf(a, sizeof a, "%s/one/%s", base, name);
    snprintf(b, sizeof b, "%s/three/%s", base, name);
    char *bytes_a = read_file(a, &size_a), *bytes_b = read_file(b, &size_b);
    assert_int_equal(size_a, size_b);
    assert_memory_equal(bytes_a, bytes_b, (size_t)size_a);
    free(bytes_a);
    free(bytes_b);
}

static void test_threads_make_no_difference(void **state)
{
    (void)state;
    static const char *const names[] = {
        "shot00_exp0.tif",     "shot00_exp1.tif",     "shot00_exp2.tif", "shot01_exp0.tif",
        "shot01_exp1.tif",     "shot01_exp2.tif",     "flat.tif",        "truth.json",
        "radiance/shot00.exr", "radiance/shot01.exr", "capture.yaml"};
    struct error err = {0};
    render("one", 1, STATUS_OK, &err);
    render("three", 3, STATUS_OK, &err);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        assert_same_file(names[i]);
}

static void test_nothing_else_is_left(void **state)
{
    (void)state;
    char pattern[100];
    glob_t found;
    snprintf(pattern, sizeof pattern, "%s/one/*", base);
    assert_int_equal(glob(pattern, 0, NULL, &found), 0);
    assert_int_equal(found.gl_pathc, 10);  // 6 photographs, flat, two papers, one folder
    globfree(&found);
}

// The truth is the scene: the corner order of tags, R as a rotation, the eye where it looks from.
static void test_truth_is_consistent(void **state)
{
    (void)state;
    char path[100];
    snprintf(path, sizeof path, "%s/one/truth.json", base);
    json_t *truth = json_load_file(path, 0, NULL);
    assert_non_null(truth);
    json_t *shot = json_array_get(json_object_get(truth, "shots"), 1);
    for (int i = 0; i < 3; i++) {  // R eye + t = 0
        json_t *row = json_array_get(json_object_get(shot, "R"), (size_t)i);
        double sum = json_real_value(json_array_get(json_object_get(shot, "t"), (size_t)i));
        for (size_t k = 0; k < 3; k++)
            sum += json_real_value(json_array_get(row, k))
                   * json_real_value(json_array_get(json_object_get(shot, "eye"), k));
        assert_near(sum, 0, 1e-9);
    }
    json_t *material = json_object_get(json_object_get(truth, "sample"), "material");
    assert_string_equal(json_string_value(json_object_get(material, "type")), "plastic");
    json_t *tag = json_array_get(json_object_get(truth, "tags"), 0);
    json_t *corner = json_array_get(json_object_get(tag, "corners"), 0);
    assert_near(json_real_value(json_array_get(corner, 0)), -2 * 46 - 15, 1e-12);
    assert_near(json_real_value(json_array_get(corner, 1)), 1.5 * 46 - 15, 1e-12);
    json_decref(truth);
}

static void test_capture_reads_as_written(void **state)
{
    (void)state;
    char path[100];
    struct capture capture = {0};
    struct error err = {0};
    struct run run;
    snprintf(path, sizeof path, "%s/one", base);
    cap_run_begin(&run, 1, true);
    enum status status = cap_capture_read(&capture, path, &run, &err);
    assert_string_equal(err.text, "");
    assert_int_equal(status, STATUS_OK);
    assert_int_equal(capture.shots, 2);
    assert_int_equal(capture.shot[1].photos, 3);
    assert_int_equal(capture.tags, 14);
    assert_int_equal(capture.lights, 1);
    assert_string_equal(capture.flat, "flat.tif");
    assert_near(capture.photo[capture.shot[0].photo[0]].exposure_time, 1.0 / 256, 1e-9);
    assert_near(capture.sample.radius, 25, 0);
    assert_near(capture.patch[0].corner[0].x, 40, 1e-9);
    assert_int_equal(run.warnings, 0);
    cap_run_end(&run);
    cap_capture_free(&capture);
}

static void test_other_photographs_are_not_mixed_in(void **state)
{
    (void)state;
    char path[100];
    struct error err = {0};
    snprintf(path, sizeof path, "%s/one/shot02_exp0.tif", base);
    fclose(fopen(path, "w"));
    render("one", 1, STATUS_IO, &err);
    assert_non_null(strstr(err.text, "shot02_exp0.tif"));
    remove(path);
}

static int make_base(void **state)
{
    (void)state;
    return mkdtemp(base) ? 0 : -1;
}

static int remove_base(void **state)
{
    (void)state;
    char command[100];
    snprintf(command, sizeof command, "rm -r %s", base);
    return system(command);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads_make_no_difference),
        cmocka_unit_test(test_nothing_else_is_left),
        cmocka_unit_test(test_truth_is_consistent),
        cmocka_unit_test(test_capture_reads_as_written),
        cmocka_unit_test(test_other_photographs_are_not_mixed_in),
    };
    return cmocka_run_group_tests(tests, make_base, remove_base);
}
