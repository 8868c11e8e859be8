/* painted.h -- photographs of a scene that a function paints, in a folder of their own. */
#ifndef GONIOCAM_PAINTED_H
#define GONIOCAM_PAINTED_H

#include "near.h"
#include "ring.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/** Who took them: ring.h's views. */
struct shooting {
    char folder[64], name[VIEWS][8];
    struct calibration c;
    struct camera camera;
    struct view view[VIEWS];
    struct run run;
};

/** What a ray sees, gray. */
typedef double painting(const void *scene, vec3 eye, vec3 ray);

/** clear_up() removes them. */
static inline void shoot(struct shooting *s, painting *paint, const void *scene)
{
    enum { WIDTH = 400, HEIGHT = 300 };
    strcpy(s->folder, "/tmp/goniocam-painted-XXXXXX");
    make_views(&s->c, &s->camera, s->view);
    s->run = (struct run){.threads = 2, .quiet = true};
    assert_non_null(mkdtemp(s->folder));
    char path[128];
    snprintf(path, sizeof path, "%.60s/radiance", s->folder);
    assert_int_equal(mkdir(path, 0777), 0);
    struct radiance map = {.width = WIDTH, .height = HEIGHT, .channels = 3};
    map.value = calloc(3 * WIDTH * HEIGHT, sizeof *map.value);
    map.variance = calloc(3 * WIDTH * HEIGHT, sizeof *map.variance);
    for (int v = 0; v < VIEWS; v++) {
        vec3 eye = cal_eye(s->view[v].view_from_world);
        mat3 r = cal_rotation(s->view[v].view_from_world.rotation);
        snprintf(s->name[v], sizeof s->name[v], "view%d", v);
        s->view[v].name = s->name[v];
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            double sum = 0;
            for (int k = 0; k < 4; k++) {                              // four points of a photosite
                double pixel[2] = {i % WIDTH + (k % 2) / 2.0 - 0.25,   // NOLINT: whole columns
                                   i / WIDTH + (k / 2) / 2.0 - 0.25};  // NOLINT: and rows
                sum += paint(scene, eye, mat3_mul_t(&r, cal_ray(&s->camera, pixel))) / 4;
            }
            for (int k = 0; k < 3; k++) {
                map.value[3 * i + k] = (float)sum;
                map.variance[3 * i + k] = 1e-6F;
            }
        }
        snprintf(path, sizeof path, "%.60s/radiance/view%d.exr", s->folder, v);
        assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
    }
    cap_radiance_free(&map);
}

static inline void clear_up(struct shooting *s)
{
    char path[128];
    for (int v = 0; v < VIEWS; v++) {
        snprintf(path, sizeof path, "%.60s/radiance/view%d.exr", s->folder, v);
        remove(path);
    }
    snprintf(path, sizeof path, "%.60s/radiance", s->folder);
    remove(path);
    remove(s->folder);
    cap_run_end(&s->run);
}

#endif
