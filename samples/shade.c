/* shade.c -- how much light leaves a spot: L = sum of f E cos(theta_i) over the parts of the lamp.
 */
#include "shade.h"

struct shot_view sam_shot_view(const struct world *world, const struct scene_shot *shot)
{
    struct shot_view view = {.world = world,
                             .light = sam_lighting(world->scene, shot),
                             .rotation = cal_rotation(shot->view_from_world.rotation),
                             .eye = cal_eye(shot->view_from_world)};
    const struct lighting *light = &view.light;
    bool point = light->kind == LAMP_POINT;
    view.eye_vantage = sam_vantage(world, view.eye, 0);
    view.lamp_vantage = point && light->radius == 0 ? sam_vantage(world, light->position, 0)
                                                    : sam_vantage_nowhere();
    view.lamp_around =
        point ? sam_vantage(world, light->position, light->radius) : sam_vantage_nowhere();
    return view;
}

/** How many parts of the lamp a spot is shaded by. What is matt and sees all of a ball sees it as
 *  a point: its irradiance is that of its middle. */
static int parts(const struct shot_view *view, const struct spot *spot, enum lit lit)
{
    if (view->light.radius == 0 || (!sam_spot_material(view->world, spot) && lit == LIT_FULLY))
        return 1;
    return lit == LIT_PARTLY ? LIGHT_SAMPLES_PENUMBRA : LIGHT_SAMPLES;
}

/** Paper and sheet have a back, which stays dark; solids show no back. */
static bool sees(const struct shot_view *view, const struct spot *spot, const struct incidence *in)
{
    return vec3_dot(in->wi, spot->normal) > 0
           && !sam_blocked(view->world, &view->lamp_vantage, (struct ray){spot->point, in->wi},
                           in->distance);
}

/** A ball's verdict by its parts. */
static enum lit lit_by_parts(const struct shot_view *view, const struct spot *spot)
{
    int seen = 0;
    for (int i = 0; i < LIGHT_SAMPLES; i++) {
        struct incidence in = sam_light_part(&view->light, spot->point, i, LIGHT_SAMPLES);
        seen += sees(view, spot, &in);
    }
    return seen == LIGHT_SAMPLES ? LIT_FULLY : seen > 0 ? LIT_PARTLY : LIT_NOT;
}

/** Only where a solid is near the way to a ball's middle, or the horizon cuts the ball, its parts
 *  need to be asked one by one. The edges of paper are too low to throw a penumbra. */
enum lit sam_lit(const struct shot_view *view, const struct spot *spot, vec3 wo)
{
    if (spot->matter == MATTER_NONE || vec3_dot(wo, spot->normal) <= 0)
        return LIT_NOT;
    struct incidence middle = sam_light_part(&view->light, spot->point, 0, 1);
    double sine = view->light.radius / middle.distance;
    double above = vec3_dot(middle.wi, spot->normal);
    if (sine > 0 && above > -sine
        && (above < sine
            || sam_near_solid(view->world, &view->lamp_around, middle.wi, spot->matter)))
        return lit_by_parts(view, spot);
    return sees(view, spot, &middle) ? LIT_FULLY : LIT_NOT;
}

void sam_reflectance(const struct world *world, const struct spot *spot, vec3 wi, vec3 wo,
                     double f[3])
{
    f[0] = f[1] = f[2] = spot->albedo / CAP_PI;
    const struct material *material = sam_spot_material(world, spot);
    if (!material)
        return;
    vec3 x, y, z = spot->normal;  // any tangent will do
    sam_frame(z, &x, &y);
    sam_material_eval(material, (vec3){vec3_dot(wi, x), vec3_dot(wi, y), vec3_dot(wi, z)},
                      (vec3){vec3_dot(wo, x), vec3_dot(wo, y), vec3_dot(wo, z)}, f);
    const struct scene_sample *sample = &world->scene->sample;
    double flawed = spot->matter == MATTER_SAMPLE
                        ? sam_flawed(&sample->flaws, &sample->place, spot->point, z, wi, wo)
                        : 1;
    for (int c = 0; c < 3; c++)
        f[c] *= flawed;
}

void sam_shade(const struct shot_view *view, const struct spot *spot, enum lit lit, vec3 wo,
               double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = 0;
    if (lit == LIT_NOT)
        return;
    int n = parts(view, spot, lit);
    for (int i = 0; i < n; i++) {
        struct incidence in = sam_light_part(&view->light, spot->point, i, n);
        if (lit == LIT_PARTLY && !sees(view, spot, &in))
            continue;
        double f[3], cos_i = vec3_dot(in.wi, spot->normal);
        sam_reflectance(view->world, spot, in.wi, wo, f);
        for (int c = 0; c < 3; c++)
            rgb[c] += f[c] * in.irradiance[c] * cos_i;
    }
}

// ---- ambient light

void sam_ambient_albedo(const struct material *material, struct ambient_albedo *albedo)
{
    enum { N = 128 };  // midpoints in cos^2 and azimuth: equal parts of the projected hemisphere
    for (int a = 0; a < AMBIENT_ANGLES; a++) {
        double cos_o = fmax((double)a / (AMBIENT_ANGLES - 1), 1e-3), sum[3] = {0, 0, 0};
        vec3 wo = {sqrt(1 - cos_o * cos_o), 0, cos_o};
        for (int part = 0; part < N * N; part++) {
            int i = part / N, j = part % N;
            double cos2 = (i + 0.5) / N, phi = 2 * CAP_PI * (j + 0.5) / N, f[3];
            vec3 wi = {sqrt(1 - cos2) * cos(phi), sqrt(1 - cos2) * sin(phi), sqrt(cos2)};
            sam_material_eval(material, wi, wo, f);
            for (int c = 0; c < 3; c++)
                sum[c] += f[c] * CAP_PI / (N * N);
        }
        for (int c = 0; c < 3; c++)
            albedo->at[a][c] = sum[c];
    }
}

void sam_ambient_add(const struct shot_view *view, const struct spot *spot, vec3 wo, double rgb[3])
{
    const double *ambient = view->world->scene->ambient;
    double cos_o = vec3_dot(wo, spot->normal), at = fmin(fmax(cos_o, 0), 1) * (AMBIENT_ANGLES - 1);
    int low = (int)fmin(floor(at), AMBIENT_ANGLES - 2);
    const struct ambient_albedo *known = spot->matter == MATTER_SAMPLE ? view->ambient
                                         : spot->matter == MATTER_THING
                                             ? view->ambient + 1 + spot->index
                                             : NULL;
    for (int c = 0; c < 3; c++) {
        double albedo = spot->albedo;
        if (known)
            albedo = known->at[low][c] * (low + 1 - at) + known->at[low + 1][c] * (at - low);
        rgb[c] += (spot->matter == MATTER_NONE ? 1 : albedo) * ambient[c];
    }
}
