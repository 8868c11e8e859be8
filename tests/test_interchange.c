/* test_interchange.c -- calibrations as other programs read them. */
#include "interchange.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/** The quaternion turns vectors as the rotation matrix does: v + 2 w (u x v) + 2 u x (u x v). */
static void quaternions_turn_alike(void **state)
{
    (void)state;
    static const vec3 rotations[] = {
        {0, 0, 0}, {1e-9, 0, 0}, {0.3, -0.2, 0.9}, {2.2, 0.3, -0.1}, {0, 4, 0}};
    const vec3 v = {1, -2, 3};
    for (int i = 0; i < 5; i++) {
        double q[4];
        cal_quaternion(rotations[i], q);
        vec3 u = {q[1], q[2], q[3]}, uv = vec3_cross(u, v);
        vec3 by_q = vec3_add(v, vec3_scale(vec3_add(vec3_scale(uv, q[0]), vec3_cross(u, uv)), 2));
        mat3 r = cal_rotation(rotations[i]);
        assert_near(vec3_length(vec3_sub(by_q, mat3_mul(&r, v))), 0, 1e-14);
        assert_near(q[0] * q[0] + vec3_dot(u, u), 1, 1e-15);
        assert_true(q[0] >= 0);
    }
}

static void files_hold_the_numbers(void **state)
{
    (void)state;
    struct camera camera = {.name = "a",
                            .width = 640,
                            .height = 480,
                            .focal = {1000.5, 1001.5},
                            .center = {319.5, 239.5},
                            .distortion = {-0.1, 0.05, 1e-3, -2e-3, 0.01}};
    struct view view = {.name = "shot00", .view_from_world = {{0, 0, 0}, {1, 2, 3}}};
    const struct calibration c = {.camera = &camera, .cameras = 1, .view = &view, .views = 1};
    char folder[] = "/tmp/goniocam_interchange_XXXXXX", path[100], text[400] = "";
    assert_non_null(mkdtemp(folder));
    assert_int_equal(cal_write_colmap(&c, folder, NULL), STATUS_OK);
    snprintf(path, sizeof path, "%s/cameras.txt", folder);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    double v[12];
    int id, width, height;
    assert_non_null(fgets(text, sizeof text, file));
    assert_int_equal(fscanf(file, "%d FULL_OPENCV %d %d", &id, &width, &height), 3);
    for (int i = 0; i < 12; i++)
        assert_int_equal(fscanf(file, "%lf", v + i), 1);
    fclose(file);
    assert_near(v[0], 1000.5, 0);
    assert_near(v[2], 320, 0);  // COLMAP's first pixel has its centre at 0.5
    assert_near(v[3], 240, 0);
    assert_near(v[8], 0.01, 0);
    unlink(path);
    snprintf(path, sizeof path, "%s/images.txt", folder);
    file = fopen(path, "r");
    assert_non_null(file);
    assert_non_null(fgets(text, sizeof text, file));
    assert_non_null(fgets(text, sizeof text, file));
    assert_string_equal(text, "1 1 0 0 0 1 2 3 1 shot00\n");
    fclose(file);
    unlink(path);
    snprintf(path, sizeof path, "%s/points3D.txt", folder);
    assert_int_equal(unlink(path), 0);
    rmdir(folder);
}

// ---- what other programs write

static const struct foreign {
    const char *file, *text;
    const char *complaint;  // part of it, NULL: it is read
    double focal[2], center[2], distortion[5];
} foreign[] = {
    {"opencv.yml",
     "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n"
     "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 900., 0., 320., 0., 901., 240., 0., 0., 1. ]\n"
     "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n"
     "   data: [ -0.1, 0.02, 1e-3, -2e-3, 0.3 ]\navg_reprojection_error: 0.2\n",
     NULL,
     {900, 901},
     {320, 240},
     {-0.1, 0.02, 1e-3, -2e-3, 0.3}},
    {"ros.yaml",
     "image_width: 640\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: "
     "3\n"
     "  data: [900, 0, 320, 0, 901, 240, 0, 0, 1]\ndistortion_model: plumb_bob\n"
     "distortion_coefficients: {rows: 1, cols: 5, data: [-0.1, 0.02, 0.001, -0.002, 0]}\n",
     NULL,
     {900, 901},
     {320, 240},
     {-0.1, 0.02, 1e-3, -2e-3, 0}},
    {"kalibr.yaml",
     "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [-0.1, 0.02, 0.001, -0.002]\n"
     "  distortion_model: radtan\n  intrinsics: [900, 901, 320, 240]\n  resolution: [640, 480]\n",
     NULL,
     {900, 901},
     {320, 240},
     {-0.1, 0.02, 1e-3, -2e-3, 0}},
    {"kalibr_fisheye.yaml",
     "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [-0.1, 0.02, 0.001, -0.002]\n"
     "  distortion_model: equidistant\n  intrinsics: [900, 901, 320, 240]\n"
     "  resolution: [640, 480]\n",
     "cam0: pinhole with equidistant",
     {0},
     {0},
     {0}},
    {"simple.txt",
     "# a comment\n1 SIMPLE_RADIAL 640 480 900 320.5 240.5 -0.1\n",
     NULL,
     {900, 900},
     {320, 240},
     {-0.1, 0, 0, 0, 0}},
    {"opencv.txt",
     "1 OPENCV 640 480 900 901 320.5 240.5 -0.1 0.02 0.001 -0.002\n",
     NULL,
     {900, 901},
     {320, 240},
     {-0.1, 0.02, 1e-3, -2e-3, 0}},
    {"fisheye.txt",
     "# one\n1 OPENCV_FISHEYE 640 480 900 901 320 240 0 0 0 0\n",
     "line 2: lens model OPENCV_FISHEYE",
     {0},
     {0},
     {0}},
    {"rational.txt",
     "1 FULL_OPENCV 640 480 900 901 320 240 0 0 0 0 0 0.1 0 0\n",
     "k4 k5 k6 must be 0",
     {0},
     {0},
     {0}},
    {"short.txt", "1 PINHOLE 640 480 900\n", "PINHOLE has 4 numbers, not 1", {0}, {0}, {0}},
    {"flat.yml",
     "image_width: 640\nimage_height: 480\nfocal: 3\n",
     "wants camera_matrix",
     {0},
     {0},
     {0}},
    {"broken.yml", "image_width: [640\n", "broken.yml: line", {0}, {0}, {0}},
    {"empty.yml", "", "is empty", {0}, {0}, {0}},
    {"negative.txt", "1 PINHOLE 640 480 -900 901 320 240\n", "must be above 0", {0}, {0}, {0}},
};
enum { FOREIGN = sizeof foreign / sizeof *foreign };

static void foreign_files_are_read(void **state)
{
    (void)state;
    char folder[] = "/tmp/goniocam_foreign_XXXXXX", path[100];
    assert_non_null(mkdtemp(folder));
    for (int i = 0; i < FOREIGN; i++) {
        const struct foreign *f = foreign + i;
        struct calibration c = {0};
        struct error err = {0};
        snprintf(path, sizeof path, "%s/%s", folder, f->file);
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        fputs(f->text, file);
        fclose(file);
        enum status status = cal_calibration_import(&c, path, &err);
        if (f->complaint && !strstr(err.text, f->complaint))
            fail_msg("%s: \"%s\" does not say \"%s\"", f->file, err.text, f->complaint);
        assert_int_equal(status, f->complaint ? STATUS_FORMAT : STATUS_OK);
        for (int k = 0; !status && k < 2; k++) {
            assert_near(c.camera->focal[k], f->focal[k], 0);
            assert_near(c.camera->center[k], f->center[k], 0);
        }
        for (int k = 0; !status && k < 5; k++)
            assert_near(c.camera->distortion[k], f->distortion[k], 0);
        cal_calibration_free(&c);
        unlink(path);
    }
    rmdir(folder);
}

// COLMAP's lines of points, which may be empty, are no images.
static void a_model_is_read_back(void **state)
{
    (void)state;
    struct camera camera = {
        .name = "a", .width = 640, .height = 480, .focal = {1000, 1001}, .center = {319.5, 239.5}};
    struct view views[] = {{.name = "a.b", .view_from_world = {{0.3, -0.2, 2.9}, {1, 2, 3}}},
                           {.name = "c d", .view_from_world = {{0, 0, 0}, {-1, 0, 4}}}};
    const struct calibration c = {.camera = &camera, .cameras = 1, .view = views, .views = 2};
    struct calibration back = {0};
    char folder[] = "/tmp/goniocam_model_XXXXXX", path[100];
    assert_non_null(mkdtemp(folder));
    assert_int_equal(cal_write_colmap(&c, folder, NULL), STATUS_OK);
    assert_int_equal(cal_calibration_import(&back, folder, NULL), STATUS_OK);
    assert_int_equal(back.views, 2);
    assert_string_equal(back.view[0].name, "a");  // what follows a dot is an image's ending
    assert_string_equal(back.view[1].name, "c d");
    for (int v = 0; v < 2; v++) {
        pose was = views[v].view_from_world, is = back.view[v].view_from_world;
        assert_near(vec3_length(vec3_sub(is.rotation, was.rotation)), 0, 1e-14);
        assert_near(vec3_length(vec3_sub(is.translation, was.translation)), 0, 0);
        assert_int_equal(back.view[v].light, -1);
    }
    cal_calibration_free(&back);
    static const char *const parts[] = {"cameras.txt", "images.txt", "points3D.txt"};
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, parts[i]);
        unlink(path);
    }
    assert_int_equal(cal_calibration_import(&back, folder, NULL), STATUS_IO);
    rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quaternions_turn_alike), cmocka_unit_test(files_hold_the_numbers),
        cmocka_unit_test(foreign_files_are_read), cmocka_unit_test(a_model_is_read_back)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
