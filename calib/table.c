/* table.c -- a calibration as a table for people: what was found and how well, and what to
 * photograph again to know it better. */
#include "table.h"

#include <stdlib.h>
#include <string.h>

static const double degrees = 180 / CAP_PI;

// ---- cameras

// The image in cells: what part of it the tags reached, for the lens is only known there.
enum { ACROSS = 8, DOWN = 6 };

static void cells_of(bool cell[DOWN][ACROSS], const struct calibration *c, int camera)
{
    const struct camera *m = c->camera + camera;
    memset(cell, 0, sizeof(bool[DOWN][ACROSS]));
    for (int v = 0; v < c->views; v++)
        for (int i = 0; c->view[v].camera == camera && i < c->view[v].tags; i++)
            for (int k = 0; k < 4; k++) {
                const double *p = c->view[v].tag[i].corner[k];
                int x = (int)(p[0] / m->width * ACROSS), y = (int)(p[1] / m->height * DOWN);
                if (x >= 0 && x < ACROSS && y >= 0 && y < DOWN)
                    cell[y][x] = true;
            }
}

static double covered(bool cell[DOWN][ACROSS])
{
    int n = 0;
    for (int y = 0; y < DOWN; y++)
        for (int x = 0; x < ACROSS; x++)
            n += cell[y][x];
    return (double)n / (ACROSS * DOWN);
}

// Quarters of the image's rim that no tag came near: "left, bottom". true: there are some.
static bool empty_sides(char text[40], bool cell[DOWN][ACROSS])
{
    bool left = false, right = false, top = false, bottom = false;
    for (int y = 0; y < DOWN; y++) {
        left = left || cell[y][0];
        right = right || cell[y][ACROSS - 1];
    }
    for (int x = 0; x < ACROSS; x++) {
        top = top || cell[0][x];
        bottom = bottom || cell[DOWN - 1][x];
    }
    snprintf(text, 40, "%s%s%s%s", left ? "" : ", left", right ? "" : ", right", top ? "" : ", top",
             bottom ? "" : ", bottom");
    return *text != '\0';
}

// The greatest angle between the lines of sight of a camera's views, seen from the board's tags.
static double slant_of(const struct calibration *c, int camera)
{
    double widest = 0;
    for (int a = 0; a < c->views; a++)
        for (int b = 0; b < a; b++) {
            if (c->view[a].camera != camera || c->view[b].camera != camera)
                continue;
            mat3 r = cal_rotation(c->view[a].view_from_world.rotation),
                 s = cal_rotation(c->view[b].view_from_world.rotation);
            double cosine =
                vec3_dot(mat3_mul_t(&r, (vec3){0, 0, 1}), mat3_mul_t(&s, (vec3){0, 0, 1}));
            widest = fmax(widest, acos(fmin(fmax(cosine, -1), 1)));
        }
    return widest * degrees;
}

static void print_lens(const struct camera *m, FILE *to)
{
    static const char *const names[] = {"k1", "k2", "p1", "p2", "k3"};
    bool dropped = false;
    fprintf(to, "  distortion:");
    for (int k = 0; k < 5; k++)
        if (m->distortion[k] != 0 || m->sigma_distortion[k] > 0)
            fprintf(to, " %s %.5f (+- %.2g)", names[k], m->distortion[k], m->sigma_distortion[k]);
        else
            dropped = true;
    if (dropped) {
        fprintf(to, "; not told by the photographs, left 0:");
        for (int k = 0; k < 5; k++)
            if (m->distortion[k] == 0 && m->sigma_distortion[k] == 0)
                fprintf(to, " %s", names[k]);
    }
    fprintf(to, "\n");
}

static void print_camera(const struct calibration *c, int i, FILE *to)
{
    const struct camera *m = c->camera + i;
    bool cell[DOWN][ACROSS];
    char sides[40];
    bool held = m->sigma_focal[0] == 0;
    if (held)
        fprintf(to,
                "camera %s: focal length %.2f, %.2f px and centre %.2f, %.2f px as given, tags off "
                "by %.3f px rms\n",
                m->name, m->focal[0], m->focal[1], m->center[0], m->center[1], m->rms_px);
    else
        fprintf(
            to,
            "camera %s: focal length %.2f, %.2f px (+- %.4f %%), centre %.2f, %.2f px (+- %.2f), "
            "tags off by %.3f px rms\n",
            m->name, m->focal[0], m->focal[1], 100 * m->sigma_focal[0] / m->focal[0], m->center[0],
            m->center[1], hypot(m->sigma_center[0], m->sigma_center[1]), m->rms_px);
    if (!held)
        print_lens(m, to);
    cells_of(cell, c, i);
    fprintf(to, "  tags reached %.0f %% of the image, lines of sight span %.0f degrees\n",
            100 * covered(cell), slant_of(c, i));
    if (!held && covered(cell) < 0.5 && empty_sides(sides, cell))
        fprintf(to, "  ! no tag near these sides of the image: %s; the lens is a guess there\n",
                sides + 2);
    if (!held && slant_of(c, i) < 25)
        fprintf(to,
                "  ! photograph the board at a slant of 30 to 60 degrees, from several sides\n");
}

// ---- shots

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median_rms(const struct calibration *c)
{
    double *rms = malloc((size_t)(c->views + 1) * sizeof *rms);
    if (!rms)
        return INFINITY;
    for (int v = 0; v < c->views; v++)
        rms[v] = c->view[v].rms_px;
    qsort(rms, (size_t)c->views, sizeof *rms, compare_doubles);
    double median = c->views ? rms[c->views / 2] : 0;
    free(rms);
    return median;
}

// Length of three deviations.
static double length_of(const double sigma[3])
{
    return sqrt(sigma[0] * sigma[0] + sigma[1] * sigma[1] + sigma[2] * sigma[2]);
}

// Few tags leave a pose loose; one that fits much worse than the others was shaken or bumped.
static const char *remark(const struct view *v, double median)
{
    static const double worse = 3, least_px = 0.05;
    return v->tags < 4 ? "! few tags: show more of the board, or come closer"
           : v->rms_px > fmax(worse * median, least_px)
               ? "! fits worse than the others: out of focus, shaken, or the board is bent?"
               : "";
}

static int by_name(const void *a, const void *b)
{
    return strverscmp((*(const struct view *const *)a)->name,
                      (*(const struct view *const *)b)->name);
}

static void print_shots(const struct calibration *c, FILE *to)
{
    const struct view **order = calloc((size_t)c->views + 1, sizeof(*order));
    double median = median_rms(c);
    int width = 4;
    if (!order)
        return;
    for (int v = 0; v < c->views; v++) {
        order[v] = c->view + v;
        width = (int)fmax(width, (double)strlen(c->view[v].name));
    }
    qsort(order, (size_t)c->views, sizeof *order, by_name);
    fprintf(to, "%-*s  tags  off, px  distance  +- mm   +- deg\n", width, "shot");
    for (int v = 0; v < c->views; v++) {
        const struct view *view = order[v];
        fprintf(to, "%-*s  %4d  %7.3f  %8.1f  %5.3f  %7.4f  %s\n", width, view->name, view->tags,
                view->rms_px, vec3_length(view->view_from_world.translation),
                length_of(view->sigma_translation), length_of(view->sigma_rotation) * degrees,
                remark(view, median));
    }
    free(order);
}

// ---- the board

// Tags whose places were found, and tags that fit worse than the others.
static void print_board(const struct calibration *c, FILE *to)
{
    int found = 0;
    double squares = 0, worst = 0;
    for (int i = 0; i < c->tags; i++) {
        const double sigma = length_of(c->tag[i].sigma_center);
        found += sigma > 0;
        worst = fmax(worst, sigma);
        squares += c->tag[i].rms_px * c->tag[i].rms_px;
    }
    fprintf(to, "board: %d tags of family %s", c->tags, c->family ? c->family : "?");
    if (found)
        fprintf(to, "; %d placed by the photographs, to %.3f mm at worst", found, worst);
    fprintf(to, "\n");
    double usual = c->tags ? sqrt(squares / c->tags) : 0;
    for (int i = 0; i < c->tags; i++)
        if (c->tags > 3 && c->tag[i].rms_px > fmax(2 * usual, 0.05))
            fprintf(to,
                    "  ! tag %d is off by %.3f px, others by %.3f: is it flat, clean and whole?\n",
                    c->tag[i].place.id, c->tag[i].rms_px, usual);
}

// ---- sample and lamps

// What each cue alone says, as its way from the joint answer.
static void print_cues(const struct lamp *l, FILE *to)
{
    for (int k = CUE_BOARD; k < CUES; k++) {
        const struct lamp_cue *cue = &l->cue[k], *joint = &l->cue[CUE_JOINT];
        if (cue->sigma <= 0)
            continue;
        vec3 off = vec3_sub(cue->direction, joint->direction);
        fprintf(to, "  by %s alone: %.3f degrees off (+- %.3f)", cal_cue_name((enum cue)k),
                vec3_length(off) * degrees, hypot(cue->sigma, joint->sigma) * degrees);
        if (cue->distance > 0 && joint->distance > 0)
            fprintf(to, ", %.1f mm %s (+- %.1f)", fabs(cue->distance - joint->distance),
                    cue->distance > joint->distance ? "farther" : "nearer", cue->sigma_distance);
        fprintf(to, "\n");
    }
}

static void print_lamp(const struct lamp *l, FILE *to)
{
    vec3 p = l->at_infinity ? l->direction : l->position;
    const double *sigma = l->at_infinity ? l->sigma_direction : l->sigma_position;
    int digits = l->at_infinity ? 5 : 2;
    fprintf(to, "lamp %s: %s %.*f, %.*f, %.*f%s (+- %.2g, %.2g, %.2g)%s\n", l->name,
            l->at_infinity ? "towards" : "at", digits, p.x, digits, p.y, digits, p.z,
            l->at_infinity ? "" : " mm", sigma[0], sigma[1], sigma[2],
            l->on_camera ? ", on the camera" : "");
    if (l->beam.exponent > 0)
        fprintf(to,
                "  its light falls off to the side as cos^%.2f (+- %.2g), %.1f degrees from its "
                "axis at the sample (+- %.2g)\n",
                l->beam.exponent, l->beam.sigma_exponent, acos(fmin(l->beam.cosine, 1)) * degrees,
                l->beam.sigma_axis * degrees);
    if (l->sigma_radius > 0)
        fprintf(to, "  a ball of radius %.1f mm, by its shadow (+- %.1f)\n", l->radius,
                l->sigma_radius);
    print_cues(l, to);
}

static void print_place(const char *name, const struct sample *s, FILE *to)
{
    fprintf(to, "%s: centre %.3f, %.3f, %.3f mm (+- %.3f, %.3f, %.3f)", name, s->center.x,
            s->center.y, s->center.z, s->sigma_center[0], s->sigma_center[1], s->sigma_center[2]);
    if (s->radius > 0)
        fprintf(to, ", radius %.3f mm (+- %.3f)", s->radius, s->sigma_radius);
    fprintf(to, "\n");
}

static void print_sample(const struct sample *s, FILE *to)
{
    if (s->shape == SHAPE_NONE)
        return;
    print_place("sample", s, to);
    // A normal is off by this much of the radius: 0.1 degree costs 1 % of reflectance at 80
    // degrees.
    if (s->radius > 0 && length_of(s->sigma_center) > 0.002 * s->radius)
        fprintf(to,
                "  ! normals are uncertain by %.2f degrees: photograph its outline from more "
                "sides, before a plain ground\n",
                length_of(s->sigma_center) / s->radius * degrees);
}

void cal_print_table(const struct calibration *c, FILE *to)
{
    for (int i = 0; i < c->cameras; i++)
        print_camera(c, i, to);
    print_board(c, to);
    print_shots(c, to);
    double glare, sigma_glare;
    cal_glare_of(c, &glare, &sigma_glare);
    if (glare > 0)
        fprintf(to, "glare: %.2g %% of the light (+- %.1g)\n", 100 * glare, 100 * sigma_glare);
    print_sample(&c->sample, to);
    for (int i = 0; i < c->balls; i++)
        print_place("ball", &c->ball[i], to);
    for (int i = 0; i < c->lamps; i++)
        print_lamp(c->lamp + i, to);
    fprintf(to, "Lines with ! are worth another photograph; overlay/*.png show what was found.\n");
}
