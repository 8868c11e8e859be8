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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(quaternions_turn_alike),
                                       cmocka_unit_test(files_hold_the_numbers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
