/* test_mesh.c -- meshes against the sphere that they approach, and files of them. */
#include "calib.h"
#include "near.h"
#include "shapes.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { AROUND = 64, UP = 32, POINTS = AROUND * (UP + 1), TRIANGLES = 2 * AROUND * UP };
static const double RADIUS = 25;
static const vec3 CENTER = {3, -2, 50};

/** A sphere as a net of meridians; the triangles at the poles have no area and are not met. */
static struct mesh *sphere(void)
{
    static vec3 point[POINTS], normal[POINTS];
    static unsigned triangle[TRIANGLES][3];
    for (int j = 0; j <= UP; j++)
        for (int i = 0; i < AROUND; i++) {
            double theta = CAP_PI * j / UP, phi = 2 * CAP_PI * i / AROUND;
            vec3 n = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            normal[j * AROUND + i] = n;
            point[j * AROUND + i] = vec3_add(CENTER, vec3_scale(n, RADIUS));
        }
    for (int t = 0; t < TRIANGLES / 2; t++) {
        unsigned j = (unsigned)(t / AROUND), i = (unsigned)(t % AROUND), next = (i + 1) % AROUND;
        unsigned a = j * AROUND + i, b = a + AROUND, c = j * AROUND + next, d = c + AROUND;
        memcpy(triangle[2 * t], (unsigned[]){a, b, d}, sizeof triangle[0]);
        memcpy(triangle[2 * t + 1], (unsigned[]){a, d, c}, sizeof triangle[0]);
    }
    struct mesh *mesh = NULL;
    assert_int_equal(cal_mesh_make(&mesh, point, normal, POINTS, (const unsigned(*)[3])triangle,
                                   TRIANGLES, NULL),
                     STATUS_OK);
    return mesh;
}

static vec3 scattered(int i)
{
    double z = 1 - 2 * (i + 0.5) / 500, r = sqrt(1 - z * z), turn = i * 2.39996322972865332;
    return (vec3){r * cos(turn), r * sin(turn), z};
}

// Facets of 5.6 degrees lie within R (1 - cos(4 deg)) = 0.06 mm of the sphere; smooth normals are
// within a degree of its own, except where the outline is grazed.
static void test_a_fine_mesh_is_nearly_its_sphere(void **state)
{
    const struct mesh *mesh = *state;
    for (int i = 0; i < 500; i++) {
        vec3 aim = vec3_add(CENTER, vec3_scale(scattered(i), 15));
        vec3 eye = vec3_add(CENTER, vec3_scale(scattered((i * 7) % 500), 700));
        struct ray ray = {eye, vec3_normalize(vec3_sub(aim, eye))};
        mesh_hit a = cal_mesh_meet(mesh, ray.origin, ray.direction);
        struct crossing b = sam_cross_sphere(ray, CENTER, RADIUS, 0);
        assert_near(a.s, b.s, 0.1);
        assert_true(vec3_dot(a.normal, b.normal) > cos(CAP_PI / 180));
        // Double precision: on the plane through three corners of the sphere, and back again from
        // the point itself, the surface is not met a second time.
        vec3 p = sam_at(ray, a.s);
        mesh_hit again = cal_mesh_meet(mesh, p, a.normal);
        assert_true(again.s == INFINITY);
        mesh_hit through = cal_mesh_meet(mesh, p, vec3_scale(a.normal, -1));
        assert_near(through.s, 2 * RADIUS, 0.5);
    }
}

// Rays side by side meet what each meets alone; some of them miss, or start on the surface.
static void test_rays_side_by_side(void **state)
{
    const struct mesh *mesh = *state;
    int met = 0;
    for (int k = 0; k < 400; k++) {
        const int count = 1 + k % MESH_RAYS;
        vec3 origin[MESH_RAYS], direction[MESH_RAYS];
        mesh_hit hit[MESH_RAYS];
        for (int i = 0; i < count; i++) {
            vec3 aim = vec3_add(CENTER, vec3_scale(scattered((k + i) % 500), 1.2 * RADIUS));
            vec3 eye = vec3_add(CENTER, vec3_scale(scattered((k * 7) % 500), 700));
            direction[i] = vec3_normalize(vec3_sub(aim, eye));
            origin[i] = eye;
            mesh_hit first = cal_mesh_meet(mesh, eye, direction[i]);
            if (i % 2 && first.s < INFINITY)
                origin[i] = vec3_add(eye, vec3_scale(direction[i], first.s));
        }
        cal_mesh_meet_all(hit, mesh, origin, direction, count);
        for (int i = 0; i < count; i++) {
            mesh_hit alone = cal_mesh_meet(mesh, origin[i], direction[i]);
            assert_int_equal(hit[i].s < INFINITY, alone.s < INFINITY);
            if (!(alone.s < INFINITY))
                continue;
            assert_near(hit[i].s, alone.s, 1e-6 * RADIUS);
            assert_near(vec3_length(vec3_sub(hit[i].normal, alone.normal)), 0, 1e-6);
            met++;
        }
    }
    assert_true(met > 1000);
}

static void test_rays_that_miss(void **state)
{
    const struct mesh *mesh = *state;
    vec3 center, beside = vec3_add(CENTER, (vec3){RADIUS + 0.01, 0, 0});
    double radius;
    cal_mesh_reach(mesh, &center, &radius);
    assert_near(vec3_length(vec3_sub(center, CENTER)), 0, 1e-12);
    assert_near(radius, RADIUS, 1e-9);
    vec3 from = vec3_add(beside, (vec3){0, -500, 0});
    assert_true(cal_mesh_meet(mesh, from, (vec3){0, 1, 0}).s == INFINITY);
    vec3 behind = vec3_add(CENTER, (vec3){0, 500, 0});
    assert_true(cal_mesh_meet(mesh, behind, (vec3){0, 1, 0}).s == INFINITY);
}

// A hit's place has double precision: on a facet that lies in the plane x = const, s is exact.
static void test_points_are_exact(void **state)
{
    (void)state;
    const vec3 point[] = {{0.1, 0, 0}, {0.1, 10, 0}, {0.1, 0, 10}};
    const vec3 normal[] = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
    const unsigned triangle[][3] = {{0, 1, 2}};
    struct mesh *mesh = NULL;
    assert_int_equal(cal_mesh_make(&mesh, point, normal, 3, triangle, 1, NULL), STATUS_OK);
    vec3 eye = {700.3, 2.2, 3.3};
    mesh_hit c = cal_mesh_meet(mesh, eye, (vec3){-1, 0, 0});
    assert_near(c.s, 700.2, 1e-12 * 700);
    assert_near(c.normal.x, 1, 1e-15);
    cal_mesh_free(mesh);
}

// ---- files

static char path[] = "/tmp/test_mesh_XXXXXX.obj";

static void write_text(const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

// A square of two triangles, scaled by 3, turned about x by a quarter, moved: it comes to lie in
// the plane y = 2, facing -y, about (1, 2, 3).
static void test_a_file_is_placed(void **state)
{
    (void)state;
    struct mesh *mesh = NULL;
    struct error err = {0};
    write_text("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n");
    const pose world_from_file = {{CAP_PI / 2, 0, 0}, {-2, 2, 0}};
    assert_int_equal(cal_mesh_read(&mesh, path, 3, world_from_file, &err), STATUS_OK);
    assert_int_equal(cal_mesh_triangles(mesh), 2);
    mesh_hit c = cal_mesh_meet(mesh, (vec3){3.9, -500, 5.9}, (vec3){0, 1, 0});
    assert_near(c.s, 502, 1e-6);  // Assimp's points are in single precision
    assert_near(c.normal.y, -1, 1e-6);
    assert_true(cal_mesh_meet(mesh, (vec3){4.1, -500, 3}, (vec3){0, 1, 0}).s == INFINITY);
    cal_mesh_free(mesh);
}

static void test_bad_files(void **state)
{
    (void)state;
    struct mesh *mesh = NULL;
    struct error err = {0};
    const pose as_it_is = {{0, 0, 0}, {0, 0, 0}};
    assert_int_equal(cal_mesh_read(&mesh, "/nowhere/x.ply", 1, as_it_is, &err), STATUS_IO);
    assert_non_null(strstr(err.text, "/nowhere/x.ply"));
    write_text("v 0 0 0\nv 1 0 0\nl 1 2\n");
    assert_int_not_equal(cal_mesh_read(&mesh, path, 1, as_it_is, &err), STATUS_OK);
    assert_non_null(strstr(err.text, path));
    assert_null(mesh);
}

static int set_up(void **state)
{
    int file = mkstemps(path, 4);
    *state = sphere();
    return file < 0 ? -1 : close(file);
}

static int clear(void **state)
{
    cal_mesh_free(*state);
    return unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_fine_mesh_is_nearly_its_sphere),
        cmocka_unit_test(test_rays_side_by_side),
        cmocka_unit_test(test_rays_that_miss),
        cmocka_unit_test(test_points_are_exact),
        cmocka_unit_test(test_a_file_is_placed),
        cmocka_unit_test(test_bad_files),
    };
    return cmocka_run_group_tests(tests, set_up, clear);
}
