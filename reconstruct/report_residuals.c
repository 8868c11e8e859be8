/* report_residuals.c -- cameras and sample as placed, and how well: residuals of shots and tags. */
#include "report.h"

#include <stdlib.h>

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
    int seen;
    double sum2, mean[2];
};

static void add_corners(struct tag_residual *t, const struct camera *camera,
                        const struct view *view, const struct seen_tag *seen,
                        const struct tag_place *place)
{
    for (int k = 0; k < 4; k++) {
        double pixel[2];
        vec3 p = cal_to_view(view->view_from_world, cap_tag_corner(place, k));
        if (!(p.z > 0))
            continue;
        cal_project(camera, p, pixel);
        for (int i = 0; i < 2; i++) {
            double off = seen->corner[k][i] - pixel[i];
            t->sum2 += off * off / 4;
            t->mean[i] += off / 4;
        }
    }
    t->seen++;
}

static struct tag_residual residual_of(const struct calibration *c, const struct tag_place *place)
{
    struct tag_residual t = {0};
    for (int v = 0; v < c->views; v++)
        for (int i = 0; i < c->view[v].tags; i++)
            if (c->view[v].tag[i].id == place->id)
                add_corners(&t, &c->camera[c->view[v].camera], &c->view[v], &c->view[v].tag[i],
                            place);
    return t;
}

static double rms_of(const struct tag_residual *t)
{
    return t->seen > 0 ? sqrt(t->sum2 / t->seen) : 0;
}

static void write_tag(const struct report *r, const struct tag_place *place,
                      const struct tag_residual *t, double full, double limit)
{
    const double seen = t->seen > 0 ? t->seen : 1;
    fprintf(r->to,
            "<tr><th scope=\"row\" class=\"n\">%d</th><td class=\"n\">%d</td><td class=\"n\">"
            "%.3f</td>",
            place->id, t->seen, rms_of(t));
    bar_cell(r, rms_of(t), full, limit);
    fprintf(r->to, "<td class=\"n\">%+.3f</td><td class=\"n\">%+.3f</td></tr>\n", t->mean[0] / seen,
            t->mean[1] / seen);
}

static void write_tags(const struct report *r)
{
    const struct calibration *c = &r->calibration;
    struct tag_residual *t = calloc((size_t)c->tags + 1, sizeof *t);
    double full = 0, mean = 0;
    for (int i = 0; t && i < c->tags; i++) {
        t[i] = residual_of(c, &c->tag[i].place);
        full = fmax(full, rms_of(&t[i]));
        mean += rms_of(&t[i]) / c->tags;
    }
    if (t && c->tags > 0) {
        fputs(
            "<details><summary>Residuals of the tags</summary><div class=\"scroll\" "
            "tabindex=\"0\" role=\"group\" aria-label=\"Residuals of the tags\"><table><thead><tr>"
            "<th scope=\"col\" class=\"n\">tag</th><th scope=\"col\" class=\"n\">shots</th><th "
            "scope=\"col\" class=\"n\">rms, px</th><td></td><th scope=\"col\" class=\"n\">mean to "
            "the right</th><th scope=\"col\" class=\"n\">and down, px</th></tr></thead><tbody>\n",
            r->to);
        for (int i = 0; i < c->tags; i++)
            write_tag(r, &c->tag[i].place, &t[i], full, fmax(3 * mean, 0.1));
        fputs("</tbody></table></div></details>\n", r->to);
    }
    free(t);
}

void rec_report_rig(const struct report *r)
{
    if (r->calibration.views == 0) {
        fputs("<p>There is no calibration.yaml beside the table.</p>\n", r->to);
        return;
    }
    write_cameras(r);
    for (int i = 0; i < r->calibration.lamps; i++)
        rec_report_lamp(r, &r->calibration.lamp[i]);
    fputs("<h3>Residuals</h3>\n", r->to);
    write_shots(r);
    write_tags(r);
}
