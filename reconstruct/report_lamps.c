/* report_lamps.c -- the lamps, and what each kind of evidence says of them. */
#include "report.h"

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
static const double label_drop[CUES] = {0, 14, -6, -6, 26, -18};
static const enum ink cue_ink[CUES] = {INK_TEXT, INK_BLUE, INK_RED, INK_LAMP, INK_GREEN, INK_FIT2};

// Half the side of the plot, degrees: every cue's dot lies in it, and the surest one's circle.
static double widest_shown(const struct lamp *lamp, vec3 joint)
{
    double farthest = 0, surest = INFINITY;
    for (int k = CUE_BOARD; k < CUES; k++) {
        double off[2];
        if (!(lamp->cue[k].sigma > 0))
            continue;
        offsets(joint, lamp->cue[k].direction, off);
        farthest = fmax(farthest, fmax(fabs(off[0]), fabs(off[1])));
        surest = fmin(surest, lamp->cue[k].sigma * 180 / CAP_PI);
    }
    return fmax(1.1 * farthest, farthest < surest ? 1.2 * surest : 0);
}

static void draw_cues(const struct report *r, const struct lamp *lamp, vec3 joint)
{
    enum { SIZE = 260 };
    double widest = widest_shown(lamp, joint);
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

// One sigma of a lamp's place along the line to the sample, and across it in any one direction.
static void along_and_across(const struct lamp *lamp, vec3 towards, double *along, double *across)
{
    const double u[3] = {towards.x, towards.y, towards.z};
    const double *s = lamp->at_infinity ? lamp->sigma_direction : lamp->sigma_position;
    double all = 0, line = 0;
    for (int i = 0; i < 3; i++) {
        all += s[i] * s[i];
        for (int j = 0; j < 3; j++)
            line += u[i] * u[j] * lamp->covariance[i][j];
    }
    line = line > 0 ? fmin(line, all) : all / 3;
    *along = sqrt(line);
    *across = sqrt((all - line) / 2);
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

void rec_report_lamp(const struct report *r, const struct lamp *lamp)
{
    const struct calibration *c = &r->calibration;
    vec3 joint = joint_direction(c, lamp);
    const double none[2] = {0, 0}, *s = lamp->sigma_position;
    double distance =
        lamp->at_infinity ? 0 : vec3_length(vec3_sub(lamp->position, c->sample.center));
    double sigma = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]), along, across;
    along_and_across(lamp, joint, &along, &across);
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
              lamp->at_infinity ? across
              : distance > 0    ? across / distance
                                : 0,
              lamp->on_camera ? 0 : distance, along);
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
