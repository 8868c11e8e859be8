/* rays.c -- the rays of a strip's photosites, to the sample and on to the lamp. */
#include "rays.h"

// Rays of an offset (du, dv) from the photosites' centres, by the lens's slopes there.
WIDE static void aim(vec3_lanes *ray, const struct lens_row *lens, const mat3 *view_from_world,
                     double du, double dv, lane_span span)
{
    const mat3 m = *view_from_world;
    FOR_LANES (i, span) {
        double x = lens->at[0][i] + du * lens->by_u[0][i] + dv * lens->by_v[0][i];
        double y = lens->at[1][i] + du * lens->by_u[1][i] + dv * lens->by_v[1][i];
        double s = 1 / sqrt(x * x + y * y + 1);
        ray->x[i] = s * (m.m[0][0] * x + m.m[1][0] * y + m.m[2][0]);
        ray->y[i] = s * (m.m[0][1] * x + m.m[1][1] * y + m.m[2][1]);
        ray->z[i] = s * (m.m[0][2] * x + m.m[1][2] * y + m.m[2][2]);
    }
}

WIDE static void light(struct ray_ends *e, vec3 lamp, lane_span span)
{
    const struct meetings *m = &e->m;
    FOR_LANES (i, span) {
        double x = lamp.x - m->point.x[i], y = lamp.y - m->point.y[i], z = lamp.z - m->point.z[i];
        double r = sqrt(x * x + y * y + z * z), s = 1 / r;
        e->wi.x[i] = x * s;
        e->wi.y[i] = y * s;
        e->wi.z[i] = z * s;
        e->distance[i] = r;
        e->cos_i[i] = s * (m->normal.x[i] * x + m->normal.y[i] * y + m->normal.z[i] * z);
        e->irradiance[i] = e->cos_i[i] * s * s;
    }
}

static void fall_off(struct ray_ends *e, const struct beam *beam, lane_span span)
{
    FOR_LANES (i, span) {
        vec3 away = {-e->wi.x[i], -e->wi.y[i], -e->wi.z[i]};
        e->irradiance[i] *= cal_beam_share(beam, away);
    }
}

WIDE static void light_from_afar(struct ray_ends *e, vec3 direction, lane_span span)
{
    const vec3_lanes *n = &e->m.normal;
    FOR_LANES (i, span) {
        e->wi.x[i] = direction.x;
        e->wi.y[i] = direction.y;
        e->wi.z[i] = direction.z;
        e->distance[i] = INFINITY;
        e->cos_i[i] = n->x[i] * direction.x + n->y[i] * direction.y + n->z[i] * direction.z;
        e->irradiance[i] = e->cos_i[i];
    }
}

void rec_trace(struct ray_ends *e, const struct pencil *p, double du, double dv, lane_span span)
{
    const struct viewing *v = p->v;
    aim(&e->ray, &p->lens, &v->view_from_world, du, dv, span);
    if (v->raster)
        rec_patches_meet(&e->m, &p->mesh, du, dv, span);
    else
        rec_meet_all(&e->m, v->sample, v->eye, &e->ray, span);
    if (v->lamp->at_infinity)
        light_from_afar(e, v->lamp->direction, span);
    else
        light(e, v->lamp_position, span);
    if (v->beam.exponent > 0)
        fall_off(e, &v->beam, span);
}
