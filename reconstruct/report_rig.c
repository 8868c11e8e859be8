/* report_rig.c -- the calibration: a sketch in space (drawn by rig.js), residuals of shots and
 * tags, lamps and what each kind of evidence says of them. */
#include "report.h"

static json_t *vector(vec3 v)
{
    return json_pack("[f, f, f]", v.x, v.y, v.z);
}

static vec3 lamp_place(const struct calibration *c, const struct lamp *lamp, double reach)
{
    const pose at = c->view[0].view_from_world;
    if (lamp->at_infinity)
        return vec3_add(c->sample.center, vec3_scale(lamp->direction, reach));
    return cal_lamp_position(lamp, at);
}

static double sample_radius(const struct sample *s)
{
    return s->shape == SHAPE_CYLINDER ? hypot(s->radius, s->height / 2) : s->radius;
}

// The middle and half the diagonal of all that stands around.
struct extent {
    vec3 low, high;
};

static void stretch(struct extent *e, vec3 p, double by)
{
    e->low = (vec3){fmin(e->low.x, p.x - by), fmin(e->low.y, p.y - by), fmin(e->low.z, p.z - by)};
    e->high =
        (vec3){fmax(e->high.x, p.x + by), fmax(e->high.y, p.y + by), fmax(e->high.z, p.z + by)};
}

static struct extent extent_of(const struct calibration *c)
{
    struct extent e = {c->sample.center, c->sample.center};
    stretch(&e, c->sample.center, 2 * sample_radius(&c->sample));
    for (int v = 0; v < c->views; v++)
        stretch(&e, cal_eye(c->view[v].view_from_world), 0);
    for (int i = 0; i < c->lamps; i++)
        if (!c->lamp[i].at_infinity && !c->lamp[i].on_camera)
            stretch(&e, c->lamp[i].position, 0);
    return e;
}

static json_t *shots(const struct calibration *c)
{
    json_t *list = json_array();
    for (int v = 0; v < c->views; v++) {
        const struct view *view = &c->view[v];
        const struct camera *camera = &c->camera[view->camera];
        mat3 m = cal_rotation(view->view_from_world.rotation);
        vec3 axis[3] = {mat3_mul_t(&m, (vec3){1, 0, 0}), mat3_mul_t(&m, (vec3){0, 1, 0}),
                        mat3_mul_t(&m, (vec3){0, 0, 1})};
        char title[200];
        snprintf(title, sizeof title, "shot %d, %s: %d tags, %.3f px", v + 1, view->name,
                 view->tags, view->rms_px);
        json_array_append_new(list, json_pack("{s:s, s:o, s:[o, o, o], s:[f, f]}", "name", title,
                                              "eye", vector(cal_eye(view->view_from_world)), "axes",
                                              vector(axis[0]), vector(axis[1]), vector(axis[2]),
                                              "half", camera->width / (2 * camera->focal[0]),
                                              camera->height / (2 * camera->focal[1])));
    }
    return list;
}

static json_t *lamps(const struct calibration *c, double reach)
{
    json_t *list = json_array();
    for (int i = 0; i < c->lamps; i++) {
        const struct lamp *lamp = &c->lamp[i];
        char title[200];
        snprintf(title, sizeof title, "%s, %s", lamp->name,
                 lamp->at_infinity ? "at infinity"
                 : lamp->on_camera ? "on the camera, here of the first shot"
                                   : "a point");
        json_array_append_new(list, json_pack("{s:s, s:s, s:o}", "name", lamp->name, "title", title,
                                              "position", vector(lamp_place(c, lamp, reach))));
    }
    return list;
}

static json_t *sample(const struct sample *s)
{
    static const char *const shape[] = {"none", "sphere", "cylinder", "mesh"};
    return json_pack("{s:s, s:o, s:o, s:f, s:f}", "shape", shape[s->shape], "center",
                     vector(s->center), "axis", vector(s->axis), "radius", s->radius, "height",
                     s->height);
}

static json_t *tags(const struct calibration *c)
{
    json_t *list = json_array();
    for (int i = 0; i < c->tags; i++) {
        json_t *corners = json_array();
        for (int k = 0; k < 4; k++)
            json_array_append_new(corners, vector(cap_tag_corner(&c->tag[i].place, k)));
        json_array_append_new(
            list, json_pack("{s:i, s:o}", "id", c->tag[i].place.id, "corners", corners));
    }
    return list;
}

// The rectangle about the tags that lie in it, with a margin; empty without tags.
static json_t *board_rectangle(const struct calibration *c)
{
    const double margin = 6, flat = 20;
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 4 * c->tags; i++) {
        vec3 p = cap_tag_corner(&c->tag[i / 4].place, i % 4);
        double at[2] = {p.x, p.y};
        for (int k = 0; k < 2 && fabs(p.z) < flat; k++) {
            low[k] = fmin(low[k], at[k] - margin);
            high[k] = fmax(high[k], at[k] + margin);
        }
    }
    return low[0] < high[0] ? json_pack("[f, f, f, f]", low[0], low[1], high[0], high[1])
                            : json_pack("[i, i, i, i]", 0, 0, 0, 0);
}

static json_t *patches(const struct report *r)
{
    json_t *list = json_object_get(r->story, "patches");
    return list ? json_incref(list) : json_array();
}

json_t *rec_report_rig_data(const struct report *r)
{
    const struct calibration *c = &r->calibration;
    if (c->views == 0)
        return json_null();
    const struct extent e = extent_of(c);
    vec3 middle = vec3_scale(vec3_add(e.low, e.high), 0.5);
    double reach = vec3_length(vec3_sub(e.high, middle));
    return json_pack("{s:o, s:f, s:o, s:o, s:o, s:o, s:o, s:o}", "middle", vector(middle), "reach",
                     reach, "board", board_rectangle(c), "tags", tags(c), "patches", patches(r),
                     "sample", sample(&c->sample), "shots", shots(c), "lamps", lamps(c, reach));
}
