/* board_scene.h -- synthetic sightings of a board by a camera, of known truth and noise. */
#ifndef GONIOCAM_BOARD_SCENE_H
#define GONIOCAM_BOARD_SCENE_H

#include "bundle.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>

enum { TAGS = 14, VIEWS = 10 };

// A ring of tags on the board, and two on a step 20 mm above it: no single plane is assumed.
static struct tag_place places[TAGS];
static const struct camera true_camera = {.name = "a",
                                          .width = 1200,
                                          .height = 800,
                                          .focal = {1500, 1510},
                                          .center = {590, 410},
                                          .distortion = {-0.15, 0.05, 5e-4, -3e-4, 0}};
static pose true_pose[VIEWS];

struct scene {
    struct capture capture;
    struct calibration calibration;
    struct camera camera;
    struct view view[VIEWS];
    struct sighting sighting[TAGS * VIEWS];
    struct bundle bundle;
};

static uint64_t seed;
static double uniform(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) / 9007199254740992.0;
}

// Normal numbers, Box and Muller's way.
static double normal(void)
{
    return sqrt(-2 * log(1 - uniform())) * cos(2 * CAP_PI * uniform());
}

// A camera 500 mm away, tilted by 35 degrees towards the board, from all sides.
static pose look_at(int view)
{
    double around = 2 * CAP_PI * view / VIEWS, tilt = (25 + 3 * (view % 4)) * CAP_PI / 180;
    vec3 z = {-sin(tilt) * cos(around), -sin(tilt) * sin(around), -cos(tilt)};
    vec3 x = vec3_normalize(vec3_cross(z, (vec3){0.3, -0.2, 1})), y = vec3_cross(z, x);
    // The rotation vector of rows x, y, z: its axis is that of the antisymmetric part.
    double cosine = 0.5 * (x.x + y.y + z.z - 1), angle = acos(cosine);
    vec3 axis = {z.y - y.z, x.z - z.x, y.x - x.y};
    pose p = {.rotation = vec3_scale(axis, -angle / vec3_length(axis)),
              .translation = {5, -3, 500}};
    mat3 r = cal_rotation(p.rotation);
    if (vec3_dot(mat3_mul_t(&r, (vec3){0, 0, 1}), z) < 0.999)
        p.rotation = vec3_scale(p.rotation, -1);
    return p;
}

static void make_scene(struct scene *s, double sigma_px, uint64_t first_seed)
{
    seed = first_seed * 0x9E3779B97F4A7C15u;  // neighbours far apart
    memset(s, 0, sizeof *s);
    for (int i = 0; i < TAGS; i++) {
        double a = 2 * CAP_PI * i / TAGS;
        places[i] = (struct tag_place){.id = i,
                                       .size = 24,
                                       .center = {120 * cos(a), 80 * sin(a), i < 2 ? 20 : 0},
                                       .x_axis = {1, 0, 0},
                                       .y_axis = {0, 1, 0}};
    }
    s->capture = (struct capture){.tag = places, .tags = TAGS};
    s->camera = (struct camera){.name = "a", .width = 1200, .height = 800};
    s->calibration =
        (struct calibration){.camera = &s->camera, .cameras = 1, .view = s->view, .views = VIEWS};
    for (int v = 0; v < VIEWS; v++) {
        true_pose[v] = look_at(v);
        s->view[v].name = "view";
        for (int i = 0; i < TAGS; i++) {
            struct sighting *seen = &s->sighting[s->bundle.sightings++];
            *seen = (struct sighting){.view = v, .place = i};
            for (int k = 0; k < 4; k++) {
                cal_project(&true_camera, cal_to_view(true_pose[v], cap_tag_corner(places + i, k)),
                            seen->corner[k]);
                for (int j = 0; j < 2; j++) {
                    seen->corner[k][j] += sigma_px * normal();
                    seen->covariance[2 * k + j][2 * k + j] = 1;  // only its shape counts
                }
            }
        }
    }
    s->bundle.calibration = &s->calibration;
    s->bundle.capture = &s->capture;
    s->bundle.sighting = s->sighting;
}

#endif
