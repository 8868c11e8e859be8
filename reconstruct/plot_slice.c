/* plot_slice.c -- the slice of a table that shows most of it: theta_h x theta_d at one phi_d. */
#include "plot.h"

#include "quantile.h"

#include <stdlib.h>

// Dark to bright and even for the eye, also without colour: matplotlib's viridis (CC0), nine knots.
static const uint32_t heat[] = {0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e,
                                0x1f9e89, 0x35b779, 0x6ece58, 0xfde725};
// Blue, white, red: M. Harrower, C. Brewer, "ColorBrewer.org", The Cartographic Journal 40, 2003.
static const uint32_t ratio[] = {0x2166ac, 0x67a9cf, 0xd1e5f0, 0xf7f7f7,
                                 0xfddbc7, 0xef8a62, 0xb2182b};

static uint32_t mix(const uint32_t *knot, int knots, double share)
{
    double at = fmin(fmax(share, 0), 1) * (knots - 1);
    int k = (int)fmin(at, knots - 2);
    uint32_t out = 0;
    for (int shift = 0; shift <= 16; shift += 8) {
        double a = knot[k] >> shift & 255, b = knot[k + 1] >> shift & 255;
        out |= (uint32_t)lround(a + (b - a) * (at - k)) << shift;
    }
    return out;
}

uint32_t rec_heat(double share)
{
    return mix(heat, sizeof heat / sizeof *heat, share);
}

uint32_t rec_ratio_color(double share)
{
    return mix(ratio, sizeof ratio / sizeof *ratio, 0.5 + 0.5 * share);
}

// f at the centre of a bin of the slice. false: below the horizon, or nothing there.
static bool value_at(const struct brdf *brdf, int theta_h, int theta_d, double phi_d_deg,
                     double f[3])
{
    int phi = (int)fmin(phi_d_deg / 180 * MERL_PHI_D, MERL_PHI_D - 1);
    int bin = phi + MERL_PHI_D * (theta_d + MERL_THETA_D * theta_h);
    vec3 wi, wo;
    if (!rec_merl_above(bin))
        return false;
    rec_directions(rec_merl_center(bin), &wi, &wo);
    rec_brdf_eval(brdf, wi, wo, f);
    return true;
}

// The colour of f, as bright as the logarithm of its brightness.
static uint32_t tint(const double f[3], double low, double high)
{
    double most = fmax(f[0], fmax(f[1], f[2])), middle = (f[0] + f[1] + f[2]) / 3;
    double share = 0.2 + 0.8 * fmin(fmax(log(middle / low) / log(high / low), 0), 1);
    uint32_t out = 0;
    for (int c = 0; c < 3; c++)
        out = out << 8 | (uint32_t)lround(255 * share * pow(fmax(f[c], 0) / most, 1 / 2.2));
    return out;
}

struct picture rec_slice_picture(const struct brdf *brdf, int channel, double phi_d_deg, double low,
                                 double high)
{
    struct picture p = rec_picture_make(MERL_THETA_H, MERL_THETA_D);
    double f[3];
    for (int d = 0; p.argb && d < MERL_THETA_D; d++)
        for (int h = 0; h < MERL_THETA_H; h++) {
            uint32_t *to = p.argb + (MERL_THETA_D - 1 - d) * MERL_THETA_H + h;
            if (!value_at(brdf, h, d, phi_d_deg, f) || f[0] + f[1] + f[2] <= 0)
                continue;
            *to = rec_argb(channel < 0
                               ? tint(f, low, high)
                               : rec_heat(log(fmax(f[channel], 1e-30) / low) / log(high / low)));
        }
    return p;
}

struct picture rec_ratio_picture(const struct brdf *a, const struct brdf *b, int channel,
                                 double phi_d_deg, double full)
{
    struct picture p = rec_picture_make(MERL_THETA_H, MERL_THETA_D);
    double fa[3], fb[3];
    for (int d = 0; p.argb && d < MERL_THETA_D; d++)
        for (int h = 0; h < MERL_THETA_H; h++)
            if (value_at(a, h, d, phi_d_deg, fa) && value_at(b, h, d, phi_d_deg, fb)
                && fa[channel] > 0 && fb[channel] > 0)
                p.argb[(MERL_THETA_D - 1 - d) * MERL_THETA_H + h] =
                    rec_argb(rec_ratio_color(log(fa[channel] / fb[channel]) / log(full)));
    return p;
}

void rec_slice_range(double *low, double *high, const struct brdf *brdf, double phi_d_deg)
{
    enum { ALL = 3 * MERL_THETA_H * MERL_THETA_D };
    double *value = malloc(ALL * sizeof *value), f[3];
    int n = 0;
    for (int h = 0; value && h < MERL_THETA_H; h++)
        for (int d = 0; d < MERL_THETA_D; d++)
            for (int c = 0; value_at(brdf, h, d, phi_d_deg, f) && c < 3; c++)
                if (f[c] > 0)
                    value[n++] = f[c];
    *low = rec_quantile(value, n, 0.001);
    *high = rec_quantile(value, n, 0.999);
    free(value);
    rec_decades(low, high, 6);
}

// ---- with axes

static void draw_frame(struct pen *pen, point2 at, double side, bool numbers)
{
    struct axes a = {.x = {SCALE_ROOT, 0, 90, 0, "θh in degrees"},
                     .y = {SCALE_LINEAR, 0, 90, 30, numbers ? "θd in degrees" : NULL},
                     .left = at.x,
                     .top = at.y,
                     .width = side,
                     .height = side};
    rec_axes_draw(pen, &a, false);
}

// From low to high, upwards, with the powers of ten, or the ratio's ends and middle.
static void draw_scale(struct pen *pen, point2 at, double height, const char *low_text,
                       const char *high_text, const char *label, uint32_t (*color)(double),
                       double from)
{
    struct picture bar = rec_picture_make(1, 64);
    for (int i = 0; bar.argb && i < 64; i++)
        bar.argb[63 - i] = rec_argb(color(from + (1 - from) * (i + 0.5) / 64));
    if (bar.argb)
        pen->picture(pen, &bar, at, 12, height);
    rec_box(pen, at, 12, height, INK_NONE, INK_FAINT);
    rec_write(pen, (point2){at.x + 17, at.y + 9}, ALIGN_LEFT, 10, INK_FAINT, "%s", high_text);
    rec_write(pen, (point2){at.x + 17, at.y + height}, ALIGN_LEFT, 10, INK_FAINT, "%s", low_text);
    pen->text(pen, (point2){at.x + 27, at.y + height / 2},
              (text_style){ALIGN_MIDDLE, 10, INK_FAINT, .upward = true}, label);
    rec_picture_free(&bar);
}

static void draw_f_scale(struct pen *pen, point2 at, double height, double low, double high)
{
    char low_text[24], high_text[24];
    rec_number(low_text, low);
    rec_number(high_text, high);
    draw_scale(pen, at, height, low_text, high_text, "f in 1/sr", rec_heat, 0);
}

static const char *const channel_name[] = {"colour", "red", "green", "blue"};

void rec_plot_slice(struct pen *pen, const struct plot_source *s, const struct plot_options *o,
                    point2 at, double side)
{
    double low, high, x = at.x + 52;
    rec_slice_range(&low, &high, &s->brdf, o->phi_d_deg);
    for (int c = -1; c < 3; c++) {
        if (c >= 0 && !o->channel[c])
            continue;
        point2 corner = {x, at.y + 20};
        struct picture p = rec_slice_picture(&s->brdf, c, o->phi_d_deg, low, high);
        if (p.argb)
            pen->picture(pen, &p, corner, side, side);
        rec_picture_free(&p);
        draw_frame(pen, corner, side, c < 0);
        rec_write(pen, (point2){x + side / 2, at.y + 12}, ALIGN_MIDDLE, 11, INK_TEXT, "%s",
                  channel_name[c + 1]);
        x += side + 18;
    }
    draw_f_scale(pen, (point2){x, at.y + 20}, side, low, high);
}

void rec_plot_comparison(struct pen *pen, const struct plot_source *a, const struct plot_source *b,
                         const struct plot_options *o, point2 at, double side)
{
    const double full = 1.25;
    double low, high;
    rec_slice_range(&low, &high, &a->brdf, o->phi_d_deg);
    point2 corner = {at.x + 52, at.y + 20};
    for (int c = 0; c < 3; c++) {
        if (!o->channel[c])
            continue;
        struct picture p[] = {rec_slice_picture(&a->brdf, c, o->phi_d_deg, low, high),
                              rec_slice_picture(&b->brdf, c, o->phi_d_deg, low, high),
                              rec_ratio_picture(&a->brdf, &b->brdf, c, o->phi_d_deg, full)};
        for (int i = 0; i < 3; i++) {
            point2 here = {corner.x + i * (side + 18) + (i == 2 ? 44 : 0), corner.y};
            if (p[i].argb)
                pen->picture(pen, &p[i], here, side, side);
            rec_picture_free(&p[i]);
            draw_frame(pen, here, side, i == 0);
            rec_write(pen, (point2){here.x + side / 2, here.y - 7}, ALIGN_MIDDLE, 11, INK_TEXT,
                      "%s%s%s, %s", i == 1 ? "" : a->name, i == 2 ? " / " : "",
                      i == 0 ? "" : b->name, channel_name[c + 1]);
        }
        point2 bar = {corner.x + 2 * (side + 18), corner.y};
        draw_f_scale(pen, bar, side, low, high);
        bar.x += 44 + side + 18;
        draw_scale(pen, bar, side, "0.8", "1.25", "ratio", rec_ratio_color, -1);
        corner.y += side + 64;
    }
}
