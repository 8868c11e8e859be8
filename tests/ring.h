/* ring.h -- a ring of views about the origin, for tests. */
#ifndef GONIOCAM_RING_H
#define GONIOCAM_RING_H

#include "calib.h"

enum { VIEWS = 6 };

/** A ring of views that look at the origin from 600 mm. */
static inline void make_views(struct calibration *c, struct camera *camera, struct view *view)
{
    *camera = (struct camera){
        .name = "camera", .width = 400, .height = 300, .focal = {1200, 1200}, .center = {200, 150}};
    for (int v = 0; v < VIEWS; v++) {
        // Rz(a) turns the world, then Rx(tilt) lays it before a camera that looks down its z.
        double a = v * 2 * CAP_PI / VIEWS, tilt = 0.75 * CAP_PI;
        mat3 z = cal_rotation((vec3){0, 0, a}), x = cal_rotation((vec3){tilt, 0, 0}), r;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                r.m[i][j] = x.m[i][0] * z.m[0][j] + x.m[i][1] * z.m[1][j] + x.m[i][2] * z.m[2][j];
        double cosine = (r.m[0][0] + r.m[1][1] + r.m[2][2] - 1) / 2, angle = acos(cosine);
        double s = angle / (2 * sin(angle));
        view[v] = (struct view){.name = "view",
                                .view_from_world = {.rotation = {s * (r.m[2][1] - r.m[1][2]),
                                                                 s * (r.m[0][2] - r.m[2][0]),
                                                                 s * (r.m[1][0] - r.m[0][1])},
                                                    .translation = {0, 0, 600}}};
    }
    *c = (struct calibration){.camera = camera, .cameras = 1, .view = view, .views = VIEWS};
}

#endif
