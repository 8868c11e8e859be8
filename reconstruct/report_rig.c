/* report_rig.c -- the calibration: a sketch in space (drawn by rig.js), residuals of shots and
 * tags, lamps and what each kind of evidence says of them. */
#include "report.h"

#include <stdlib.h>
#include <string.h>

static json_t *vector(vec3 v)
{
    return json_pack("[f, f, f]", v.x, v.y, v.z);
}

static json_t *board_list(const struct report *r, const char *name)
{
    json_t *list = json_object_get(json_object_get(r->story, "board"), name);
    return list ? json_incref(list) : json_array();
}

// ---- the sketch

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

// The rectangle about all tags; empty without tags.
static json_t *board_rectangle(const struct report *r)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    json_t *tags = json_object_get(json_object_get(r->story, "board"), "tags"), *tag, *corner;
    size_t i, k;
    json_array_foreach(tags, i, tag) json_array_foreach(json_object_get(tag, "corners"), k,
                                                        corner) for (size_t a = 0; a < 2; a++)
    {
        double x = json_number_value(json_array_get(corner, a));
        low[a] = fmin(low[a], x - 6);
        high[a] = fmax(high[a], x + 6);
    }
    return json_array_size(tags) > 0 ? json_pack("[f, f, f, f]", low[0], low[1], high[0], high[1])
                                     : json_pack("[i, i, i, i]", 0, 0, 0, 0);
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
                     reach, "board", board_rectangle(r), "tags", board_list(r, "tags"), "patches",
                     board_list(r, "patches"), "sample", sample(&c->sample), "shots", shots(c),
                     "lamps", lamps(c, reach));
}

// ---- residuals

static void bar_cell(const struct report *r, double value, double full, double limit)
{
    fprintf(r->to,
            "<td class=\"barcell\" aria-hidden=\"true\"><span class=\"bar%s\" "
            "style=\"width:%.0f%%\"></span></td>",
            value > limit ? " over" : "", full > 0 ? fmin(100, 100 * value / full) : 0);
}

static void write_shots(const struct report *r)
{
    const struct calibration *c = &r->calibration;
    double full = 0, sum = 0;
    for (int v = 0; v < c->views; v++) {
        full = fmax(full, c->view[v].rms_px);
        sum += c->view[v].rms_px / c->views;
    }
    fputs(
        "<details open><summary>Residuals of the shots</summary><div class=\"scroll\" "
        "tabindex=\"0\" role=\"group\" aria-label=\"Residuals of the shots\"><table><thead><tr>"
        "<th scope=\"col\" class=\"n\">no.</th><th scope=\"col\">shot</th><th scope=\"col\" "
        "class=\"n\">tags</th><th scope=\"col\" class=\"n\">rms, px</th><td></td><th scope=\"col\">"
        "lamp</th><th scope=\"col\" class=\"n\">lamp&rsquo;s power</th></tr></thead><tbody>\n",
        r->to);
    for (int v = 0; v < c->views; v++) {
        const struct view *view = &c->view[v];
        fprintf(r->to, "<tr><td class=\"n\">%d</td><th scope=\"row\">", v + 1);
        rec_escaped(r->to, view->name);
        fprintf(r->to, "</th><td class=\"n\">%d</td><td class=\"n\">%.3f</td>", view->tags,
                view->rms_px);
        bar_cell(r, view->rms_px, full, fmax(3 * sum, 0.1));
        fputs("<td>", r->to);
        rec_escaped(r->to, view->light >= 0 ? c->lamp[view->light].name : "");
        fprintf(r->to, "</td><td class=\"n\">%.4f", view->power);
        if (view->sigma_power > 0)
            fprintf(r->to, " <span class=\"pm\">&plusmn; %.1g</span>", view->sigma_power);
        fputs("</td></tr>\n", r->to);
    }
    fputs("</tbody></table></div></details>\n", r->to);
}

// What a tag's corners are off by, over all shots.
struct tag_residual {
    int id, seen;
    double sum2, mean[2];
};

static void add_corners(struct tag_residual *t, const struct camera *camera,
                        const struct view *view, const struct seen_tag *tag, json_t *corners)
{
    for (size_t k = 0; k < 4; k++) {
        json_t *corner = json_array_get(corners, k);
        double pixel[2], at[3];
        for (size_t i = 0; i < 3; i++)
            at[i] = json_number_value(json_array_get(corner, i));
        vec3 p = cal_to_view(view->view_from_world, (vec3){at[0], at[1], at[2]});
        if (!(p.z > 0))
            continue;
        cal_project(camera, p, pixel);
        for (int i = 0; i < 2; i++) {
            double off = tag->corner[k][i] - pixel[i];
            t->sum2 += off * off / 4;
            t->mean[i] += off / 4;
        }
    }
    t->seen++;
}

static struct tag_residual residual_of(const struct report *r, json_t *place)
{
    const struct calibration *c = &r->calibration;
    struct tag_residual t = {.id = (int)json_integer_value(json_object_get(place, "id"))};
    for (int v = 0; v < c->views; v++)
        for (int i = 0; i < c->view[v].tags; i++)
            if (c->view[v].tag[i].id == t.id)
                add_corners(&t, &c->camera[c->view[v].camera], &c->view[v], &c->view[v].tag[i],
                            json_object_get(place, "corners"));
    return t;
}

static void write_tags(const struct report *r)
{
    json_t *tags = json_object_get(json_object_get(r->story, "board"), "tags"), *place;
    size_t i, n = json_array_size(tags);
    struct tag_residual *t = calloc(n + 1, sizeof *t);
    double full = 0, sum = 0;
    json_array_foreach(tags, i, place) if (t)
    {
        t[i] = residual_of(r, place);
        full = fmax(full, t[i].seen ? sqrt(t[i].sum2 / t[i].seen) : 0);
        sum += t[i].seen ? sqrt(t[i].sum2 / t[i].seen) / (double)n : 0;
    }
    if (t && n > 0)
        fputs(
            "<details><summary>Residuals of the tags</summary><div class=\"scroll\" "
            "tabindex=\"0\" role=\"group\" aria-label=\"Residuals of the tags\"><table><thead><tr>"
            "<th scope=\"col\" class=\"n\">tag</th><th scope=\"col\" class=\"n\">shots</th><th "
            "scope=\"col\" class=\"n\">rms, px</th><td></td><th scope=\"col\" class=\"n\">mean to "
            "the right</th><th scope=\"col\" class=\"n\">and down, px</th></tr></thead><tbody>\n",
            r->to);
    for (i = 0; t && i < n; i++) {
        double seen = t[i].seen > 0 ? t[i].seen : 1, rms = sqrt(t[i].sum2 / seen);
        fprintf(r->to,
                "<tr><th scope=\"row\" class=\"n\">%d</th><td class=\"n\">%d</td><td class=\"n\">"
                "%.3f</td>",
                t[i].id, t[i].seen, rms);
        bar_cell(r, rms, full, fmax(3 * sum, 0.1));
        fprintf(r->to, "<td class=\"n\">%+.3f</td><td class=\"n\">%+.3f</td></tr>\n",
                t[i].mean[0] / seen, t[i].mean[1] / seen);
    }
    if (t && n > 0)
        fputs("</tbody></table></div></details>\n", r->to);
    free(t);
}

// ---- lamps

// A direction seen along the lamp's: degrees to the right and up.
static void offsets(vec3 towards, vec3 direction, double degrees[2])
{
    vec3 other = fabs(towards.z) < 0.9 ? (vec3){0, 0, 1} : (vec3){0, 1, 0};
    vec3 right = vec3_normalize(vec3_cross(other, towards)), up = vec3_cross(towards, right);
    degrees[0] = vec3_dot(direction, right) * 180 / CAP_PI;
    degrees[1] = vec3_dot(direction, up) * 180 / CAP_PI;
}

static vec3 joint_direction(const struct calibration *c, const struct lamp *lamp)
{
    if (lamp->at_infinity)
        return lamp->direction;
    if (lamp->on_camera)  // in the camera's frame, seen from the sample in the first shot
        return vec3_normalize(
            vec3_sub(lamp->position, cal_to_view(c->view[0].view_from_world, c->sample.center)));
    return vec3_normalize(vec3_sub(lamp->position, c->sample.center));
}

// Where a cue's name stands under its dot: those of good cues would lie on each other.
static const double label_drop[CUES] = {0, 14, -6, -6};
static const enum ink cue_ink[CUES] = {INK_TEXT, INK_BLUE, INK_RED, INK_LAMP};

static void draw_cues(const struct report *r, const struct lamp *lamp, vec3 joint)
{
    enum { SIZE = 260 };
    double widest = 0.02;
    for (int k = CUE_BOARD; k < CUES; k++)
        if (lamp->cue[k].sigma > 0) {
            double off[2];
            offsets(joint, lamp->cue[k].direction, off);
            widest = fmax(widest, fmax(fabs(off[0]), fabs(off[1]))
                                      + 0.3 * lamp->cue[k].sigma * 180 / CAP_PI);
        }
    char alt[200];
    snprintf(alt, sizeof alt, "Directions of lamp %s by each cue, about the joint answer.",
             lamp->name);
    struct pen pen = rec_report_svg(r, SIZE + 70, SIZE + 50, alt, "");
    struct axes a = {.x = {SCALE_LINEAR, -1.2 * widest, 1.2 * widest, 0, "degrees to the right"},
                     .y = {SCALE_LINEAR, -1.2 * widest, 1.2 * widest, 0, "degrees up"},
                     .left = 56,
                     .top = 6,
                     .width = SIZE,
                     .height = SIZE};
    rec_axes_draw(&pen, &a, true);
    fputs("<svg x=\"56\" y=\"6\" width=\"260\" height=\"260\" viewBox=\"56 6 260 260\">\n", r->to);
    for (int k = CUE_BOARD; k < CUES; k++) {
        double off[2], radius = lamp->cue[k].sigma * 180 / CAP_PI / (2.4 * widest) * SIZE;
        if (!(lamp->cue[k].sigma > 0))
            continue;
        offsets(joint, lamp->cue[k].direction, off);
        point2 at = rec_axes_at(&a, off[0], off[1]);
        rec_circle(&pen, at, fmin(radius, 4000),
                   (pen_style){cue_ink[k], INK_NONE, 1.5, 1, LINE_SOLID});
        rec_circle(&pen, at, 3, (pen_style){INK_NONE, cue_ink[k], 0, 1, LINE_SOLID});
        rec_write(&pen, (point2){at.x + 6, at.y + label_drop[k]}, ALIGN_LEFT, 11, cue_ink[k], "%s",
                  cal_cue_name((enum cue)k));
    }
    rec_circle(&pen, rec_axes_at(&a, 0, 0), 3.5, (pen_style){INK_NONE, INK_TEXT, 0, 1, LINE_SOLID});
    fputs("</svg>\n", r->to);
    rec_report_svg_end(r);
}

static void write_cue(const struct report *r, const char *name, const double off[2], double sigma,
                      double distance, double sigma_distance)
{
    fprintf(r->to,
            "<tr><th scope=\"row\">%s</th><td class=\"n\">%.3f</td><td class=\"n\">%.3f</td>", name,
            hypot(off[0], off[1]), sigma * 180 / CAP_PI);
    if (distance > 0)
        fprintf(r->to, "<td class=\"n\">%.1f <span class=\"pm\">&plusmn; %.2g</span></td></tr>\n",
                distance, sigma_distance);
    else
        fputs("<td class=\"n\">&ndash;</td></tr>\n", r->to);
}

static void write_lamp(const struct report *r, const struct lamp *lamp)
{
    const struct calibration *c = &r->calibration;
    vec3 joint = joint_direction(c, lamp);
    const double none[2] = {0, 0},
                 *s = lamp->at_infinity ? lamp->sigma_direction : lamp->sigma_position;
    double distance =
        lamp->at_infinity ? 0 : vec3_length(vec3_sub(lamp->position, c->sample.center));
    double sigma = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    bool any = false;
    for (int k = CUE_BOARD; k < CUES; k++)
        any = any || lamp->cue[k].sigma > 0;
    fputs("<h3>Lamp: ", r->to);
    rec_escaped(r->to, lamp->name);
    fprintf(r->to, "</h3><div class=\"two\"><div class=\"scroll\" tabindex=\"0\" role=\"group\" "
                   "aria-label=\"Cues of a lamp\"><table><caption>");
    if (lamp->at_infinity)
        fprintf(r->to, "At infinity, towards (%.4f, %.4f, %.4f)", lamp->direction.x,
                lamp->direction.y, lamp->direction.z);
    else
        fprintf(r->to, "At (%.2f, %.2f, %.2f) mm in the %s&rsquo;s frame, &plusmn; %.2g mm",
                lamp->position.x, lamp->position.y, lamp->position.z,
                lamp->on_camera ? "camera" : "world", sigma);
    fputs("</caption><thead><tr><th scope=\"col\">by</th><th scope=\"col\" class=\"n\">off, degrees"
          "</th><th scope=\"col\" class=\"n\">1 sigma, degrees</th><th scope=\"col\" class=\"n\">"
          "distance, mm</th></tr></thead><tbody>\n",
          r->to);
    write_cue(r, "all together", none,
              lamp->at_infinity ? sigma
              : distance > 0    ? sigma / (sqrt(1.5) * distance)
                                : 0,
              lamp->on_camera ? 0 : distance, sigma);
    for (int k = CUE_BOARD; k < CUES; k++) {
        double off[2];
        offsets(joint, lamp->cue[k].direction, off);
        if (lamp->cue[k].sigma > 0)
            write_cue(r, cal_cue_name((enum cue)k), off, lamp->cue[k].sigma, lamp->cue[k].distance,
                      lamp->cue[k].sigma_distance);
    }
    fputs("</tbody></table></div>\n", r->to);
    if (any) {
        fputs("<figure class=\"cues\">", r->to);
        draw_cues(r, lamp, joint);
        fputs(
            "<figcaption>The dot in the middle is the joint answer; circles are one sigma of each "
            "kind of evidence alone.</figcaption></figure>",
            r->to);
    }
    fputs("</div>\n", r->to);
}

static void write_cameras(const struct report *r)
{
    fputs("<h3>Cameras and sample</h3><div class=\"scroll\" tabindex=\"0\" role=\"group\" "
          "aria-label=\"Cameras\"><table><thead><tr><th scope=\"col\">camera</th><th scope=\"col\" "
          "class=\"n\">pixels</th><th scope=\"col\" class=\"n\">focal length, px</th><th "
          "scope=\"col\" class=\"n\">centre, px</th><th scope=\"col\" class=\"n\">rms, px</th></tr>"
          "</thead><tbody>\n",
          r->to);
    for (int i = 0; i < r->calibration.cameras; i++) {
        const struct camera *c = &r->calibration.camera[i];
        fputs("<tr><th scope=\"row\">", r->to);
        rec_escaped(r->to, c->name);
        fprintf(
            r->to,
            "</th><td class=\"n\">%d &times; %d</td><td class=\"n\">%.2f, %.2f <span class=\"pm\">"
            "&plusmn; %.1g</span></td><td class=\"n\">%.2f, %.2f</td><td class=\"n\">%.3f</td>"
            "</tr>\n",
            c->width, c->height, c->focal[0], c->focal[1], c->sigma_focal[0], c->center[0],
            c->center[1], c->rms_px);
    }
    const struct sample *s = &r->calibration.sample;
    fprintf(
        r->to,
        "</tbody></table></div><p>The sample&rsquo;s centre is at (%.3f, %.3f, %.3f) mm, &plusmn; "
        "(%.3f, %.3f, %.3f); its radius %.3f &plusmn; %.3f mm",
        s->center.x, s->center.y, s->center.z, s->sigma_center[0], s->sigma_center[1],
        s->sigma_center[2], s->radius, s->sigma_radius);
    if (s->outline_edges > 0)
        fprintf(r->to, ". %d edges of its outline lie within %.3f px (rms) of it", s->outline_edges,
                s->outline_rms_px);
    fputs(".</p>\n", r->to);
}

void rec_report_rig(const struct report *r)
{
    if (r->calibration.views == 0) {
        fputs("<p>There is no calibration.yaml beside the table.</p>\n", r->to);
        return;
    }
    write_cameras(r);
    for (int i = 0; i < r->calibration.lamps; i++)
        write_lamp(r, &r->calibration.lamp[i]);
    fputs("<h3>Residuals</h3>\n", r->to);
    write_shots(r);
    write_tags(r);
}
