/* plot_coverage.c -- what was measured and what was filled; how much light leaves. */
#include "albedo.h"
#include "plot.h"

#include <stdlib.h>

enum { CELLS = 45 };  // of two degrees, of theta_i and theta_o

// How many bins of each status a cell holds.
struct tally {
    int of[4];
};

static uint32_t between(enum ink a, enum ink b, double share)
{
    uint32_t out = 0;
    for (int shift = 0; shift <= 16; shift += 8) {
        double from = rec_ink_rgb(a) >> shift & 255, to = rec_ink_rgb(b) >> shift & 255;
        out |= (uint32_t)lround(from + share * (to - from)) << shift;
    }
    return out;
}

// Measured: the fuller the more of its bins are. Else what most of the others are. The same colours
// on light and on dark ground.
static uint32_t color_of(const struct tally *t)
{
    int measured = t->of[BIN_MEASURED], mirrored = t->of[BIN_INTERPOLATED];
    int all = measured + mirrored + t->of[BIN_EXTRAPOLATED];
    if (all == 0)
        return 0;
    if (measured > 0)
        return rec_argb(between(INK_SPARSE, INK_MEASURED, (double)measured / all));
    return rec_argb(rec_ink_rgb(2 * mirrored >= all ? INK_MIRRORED : INK_FILLED));
}

struct picture rec_coverage_half(const uint8_t *status)
{
    struct picture p = rec_picture_make(MERL_THETA_H, MERL_THETA_D);
    for (int h = 0; p.argb && h < MERL_THETA_H; h++)
        for (int d = 0; d < MERL_THETA_D; d++) {
            struct tally t = {{0}};
            for (int k = 0; k < MERL_PHI_D; k++)
                t.of[status[k + MERL_PHI_D * (d + MERL_THETA_D * h)]]++;
            p.argb[(MERL_THETA_D - 1 - d) * MERL_THETA_H + h] = color_of(&t);
        }
    return p;
}

static int cell_of(double cosine)
{
    int cell = (int)(acos(fmin(cosine, 1)) / (CAP_PI / 2) * CELLS);
    return cell < CELLS ? cell : CELLS - 1;
}

struct picture rec_coverage_in_out(const uint8_t *status)
{
    struct picture p = rec_picture_make(CELLS, CELLS);
    struct tally *tally = calloc((size_t)CELLS * CELLS, sizeof *tally);
    for (int bin = 0; tally && bin < MERL_BINS; bin++) {
        vec3 wi, wo;
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (wi.z <= 0 || wo.z <= 0)
            continue;
        int i = cell_of(wi.z), o = cell_of(wo.z);
        tally[o * CELLS + i].of[status[bin]]++;
        if (i != o)  // reciprocity
            tally[i * CELLS + o].of[status[bin]]++;
    }
    for (int o = 0; tally && p.argb && o < CELLS; o++)
        for (int i = 0; i < CELLS; i++)
            p.argb[(CELLS - 1 - o) * CELLS + i] = color_of(&tally[o * CELLS + i]);
    free(tally);
    return p;
}

static void draw_legend(struct pen *pen, point2 at)
{
    static const struct {
        enum ink ink;
        double step;
        const char *text;
    } entry[] = {{INK_MEASURED, 112, "measured, all bins"},
                 {INK_SPARSE, 120, "measured, a few bins"},
                 {INK_MIRRORED, 122, "mirrored, interpolated"},
                 {INK_FILLED, 0, "extrapolated by the fit"}};
    for (int i = 0; i < 4; i++) {
        point2 p[] = {at, {at.x + 12, at.y}, {at.x + 12, at.y + 10}, {at.x, at.y + 10}};
        pen->path(pen, p, 4, true, (pen_style){INK_FAINT, entry[i].ink, 0.5, 1, LINE_SOLID});
        rec_write(pen, (point2){at.x + 17, at.y + 9}, ALIGN_LEFT, 10, INK_TEXT, "%s",
                  entry[i].text);
        at.x += 17 + entry[i].step;
    }
}

void rec_plot_coverage(struct pen *pen, const struct plot_source *s, point2 at, double side)
{
    struct picture half = rec_coverage_half(s->status), in_out = rec_coverage_in_out(s->status);
    struct axes a = {.x = {SCALE_LINEAR, 0, 90, 30, "θi in degrees"},
                     .y = {SCALE_LINEAR, 0, 90, 30, "θo in degrees"},
                     .left = at.x + 52,
                     .top = at.y + 20,
                     .width = side,
                     .height = side};
    struct axes b = a;
    b.x = (struct axis){SCALE_ROOT, 0, 90, 0, "θh in degrees"};
    b.y.label = "θd in degrees";
    b.left += side + 70;
    if (in_out.argb)
        pen->picture(pen, &in_out, (point2){a.left, a.top}, side, side);
    if (half.argb)
        pen->picture(pen, &half, (point2){b.left, b.top}, side, side);
    rec_axes_draw(pen, &a, false);
    rec_axes_draw(pen, &b, false);
    rec_write(pen, (point2){a.left + side / 2, at.y + 12}, ALIGN_MIDDLE, 11, INK_TEXT,
              "light and camera, all azimuths");
    rec_write(pen, (point2){b.left + side / 2, at.y + 12}, ALIGN_MIDDLE, 11, INK_TEXT,
              "half and difference angle, all azimuths");
    draw_legend(pen, (point2){a.left - 20, a.top + side + 46});
    rec_picture_free(&half);
    rec_picture_free(&in_out);
}

// ---- albedo

enum { ANGLES = 18 };

static void draw_albedo(struct pen *pen, const struct axes *axes, const struct brdf *brdf,
                        const bool channel[3], bool dashed)
{
    double theta[ANGLES], value[3][ANGLES];
    for (int i = 0; i < ANGLES; i++) {
        double albedo[3];
        theta[i] = 85.0 * i / (ANGLES - 1);
        rec_brdf_albedo(albedo, brdf, theta[i] * CAP_PI / 180);
        for (int c = 0; c < 3; c++)
            value[c][i] = albedo[c];
    }
    for (int c = 0; c < 3; c++)
        if (channel[c])
            rec_axes_curve(pen, axes, theta, value[c], ANGLES,
                           (pen_style){.stroke = INK_RED + c,
                                       .width = dashed ? 1.3 : 1.6,
                                       .line = dashed ? LINE_DASHED : LINE_SOLID});
}

void rec_plot_albedo(struct pen *pen, const struct plot_source *s, const struct plot_options *o,
                     point2 at, double width, double height)
{
    struct axes a = {.x = {SCALE_LINEAR, 0, 90, 15, "θi in degrees"},
                     .y = {SCALE_LINEAR, 0, 1, 0.2, "part of the light that leaves"},
                     .left = at.x + 50,
                     .top = at.y + 8,
                     .width = width - 60,
                     .height = height - 50};
    rec_axes_draw(pen, &a, true);
    draw_albedo(pen, &a, &s->brdf, o->channel, false);
    if (o->fits > 0 && s->fits.count > 0) {
        struct brdf fit = rec_plot_fit(s, 0);
        draw_albedo(pen, &a, &fit, o->channel, true);
    }
}
