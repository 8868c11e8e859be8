/* dusk.c -- where light ends beside an outline.
 *
 * Where the lamp is a little behind the limb, the sample's rim is dark: light ends inside the
 * outline, at a depth of pixels or less, and an edge finder finds that end. From the limb inwards
 * the normal turns from n towards the eye, v, by phi; it faces the lamp, w, from
 *
 *     tan(phi) = -(n.w) / (v.w)    on, a depth of R (1 - cos(phi)).
 */
#include "dusk.h"
#include "limb.h"

static const double NEGLIGIBLE_PX = 0.02;  // a dark rim that is narrower does not matter

bool cal_dusk_at_limb(const struct calibration *c, int view, vec3 point, vec3 normal,
                      double radius_px)
{
    const struct view *v = &c->view[view];
    if (c->lamps == 0)
        return false;
    const struct lamp *lamp = &c->lamp[v->light];
    vec3 to_lamp = lamp->at_infinity ? lamp->direction
                                     : vec3_sub(cal_lamp_position(lamp, v->view_from_world), point);
    vec3 w = vec3_normalize(to_lamp);
    vec3 eye = vec3_normalize(vec3_sub(cal_eye(v->view_from_world), point));
    double facing = vec3_dot(normal, w), ahead = vec3_dot(eye, w);
    if (facing >= 0 || ahead <= 0)
        return false;  // the rim is lit, or all that is seen here is dark
    double depth = radius_px * (1 - ahead / hypot(ahead, facing));
    return depth > NEGLIGIBLE_PX && depth < LIMB_INSIDE_PX + 1;
}
