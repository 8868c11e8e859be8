/* report_pictures.c -- the pictures in OUT, made small enough to travel inside of the page: WebP
 * instead of PNG. */
#include "report.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <webp/encode.h>

// Width of all pictures of a kind where there are many: 30 take what they need, 300 no more.
static int width_for(int pictures, int width)
{
    return pictures > 40 ? (int)fmax(160, width * sqrt(40.0 / pictures)) : width;
}

// Mean of the n x n pixels behind each of the smaller picture's; the caller frees.
static uint8_t *reduced(cairo_surface_t *s, int n, int *width, int *height)
{
    const unsigned char *data = cairo_image_surface_get_data(s);
    const int stride = cairo_image_surface_get_stride(s);
    *width = cairo_image_surface_get_width(s) / n;
    *height = cairo_image_surface_get_height(s) / n;
    uint8_t *rgb = malloc(3 * (size_t)*width * (size_t)*height + 1);
    for (int y = 0; rgb && y < *height; y++)
        for (int x = 0; x < *width; x++) {
            unsigned sum[3] = {0};
            for (int k = 0; k < n * n; k++) {
                uint32_t pixel;
                memcpy(&pixel, data + (ptrdiff_t)(y * n + k / n) * stride + 4 * (x * n + k % n),
                       sizeof pixel);
                for (int c = 0; c < 3; c++)
                    sum[c] += pixel >> (16 - 8 * c) & 255;
            }
            for (int c = 0; c < 3; c++)
                rgb[3 * (y * *width + x) + c] =
                    (uint8_t)((sum[c] + (unsigned)(n * n) / 2) / (unsigned)(n * n));
        }
    return rgb;
}

// A PNG file as WebP: its bytes (WebPFree) and size; 0: it cannot be read.
static size_t webp_of(const char *path, int most, uint8_t **webp, int *width, int *height)
{
    size_t size = 0;
    cairo_surface_t *s = cairo_image_surface_create_from_png(path);
    cairo_format_t format = cairo_surface_status(s) == CAIRO_STATUS_SUCCESS
                                ? cairo_image_surface_get_format(s)
                                : CAIRO_FORMAT_INVALID;
    if (format == CAIRO_FORMAT_RGB24 || format == CAIRO_FORMAT_ARGB32) {
        int n = (cairo_image_surface_get_width(s) + most - 1) / most;
        uint8_t *rgb = reduced(s, n < 1 ? 1 : n, width, height);
        size = rgb ? WebPEncodeRGB(rgb, *width, *height, 3 * *width, 80, webp) : 0;
        free(rgb);
    }
    cairo_surface_destroy(s);
    return size;
}

bool rec_report_picture(const struct report *r, const char *folder, const char *name, int width,
                        const char *alt)
{
    char file[600];
    snprintf(file, sizeof file, "%s/%s.png", folder, name);
    char *path = cap_path(r->out, file);
    uint8_t *webp = NULL;
    int w = 0, h = 0;
    size_t size = path && access(path, R_OK) == 0 ? webp_of(path, width, &webp, &w, &h) : 0;
    free(path);
    if (size == 0)
        return false;
    fprintf(
        r->to,
        "<button type=\"button\" class=\"zoom\"><img width=\"%d\" height=\"%d\" decoding=\"async\" "
        "alt=\"",
        w, h);
    rec_escaped(r->to, alt);
    fputs("\" src=\"data:image/webp;base64,", r->to);
    rec_base64(r->to, webp, size);
    fputs("\"></button>", r->to);
    WebPFree(webp);
    return true;
}

void rec_report_photographs(const struct report *r)
{
    const struct calibration *c = &r->calibration;
    int shown = 0, width = width_for(c->views, 640);
    fputs("<p class=\"note\">Green: tags as found. Red: the way from where a corner should be to "
          "where it is, 200 times longer. Blue: the sample&rsquo;s outline as placed, and its "
          "highlight as predicted.</p>\n<div class=\"thumbs\">\n",
          r->to);
    for (int v = 0; v < c->views; v++) {
        const struct view *view = &c->view[v];
        char alt[300];
        snprintf(alt, sizeof alt, "Shot %d, %s, with %d tags, outline and highlight drawn over it",
                 v + 1, view->name, view->tags);
        fputs("<figure>", r->to);
        if (!rec_report_picture(r, "overlay", view->name, width, alt)) {
            fputs("</figure>\n", r->to);
            continue;
        }
        fprintf(r->to, "<figcaption>%d. ", v + 1);
        rec_escaped(r->to, view->name);
        fprintf(r->to, ", %.3f px</figcaption></figure>\n", view->rms_px);
        shown++;
    }
    fputs("</div>\n", r->to);
    if (shown == 0)
        fputs("<p>There are no overlays: this calibration was given, not made from a board.</p>\n",
              r->to);
}

void rec_report_predictions(const struct report *r)
{
    const struct calibration *c = &r->calibration;
    int shown = 0, width = width_for(c->views, 960);
    fputs("<p class=\"note\">Left: the sample as photographed. Middle: as the table, the lamp and "
          "the pose predict it, equally bright. Right: photograph over prediction in green, 0.91 "
          "<span class=\"scale\"></span> 1.1; black where nothing is seen, or less than 3 % of the "
          "brightest is predicted.</p>\n<div class=\"panels\">\n",
          r->to);
    for (int v = 0; v < c->views; v++) {
        const struct view *view = &c->view[v];
        char alt[300];
        snprintf(alt, sizeof alt, "Shot %d, %s: photograph, prediction, and the ratio of the two",
                 v + 1, view->name);
        fputs("<figure>", r->to);
        if (rec_report_picture(r, "predicted", view->name, width, alt)) {
            fprintf(r->to, "<figcaption>%d. ", v + 1);
            rec_escaped(r->to, view->name);
            fputs("</figcaption>", r->to);
            shown++;
        }
        fputs("</figure>\n", r->to);
    }
    fputs("</div>\n", r->to);
    if (shown == 0)
        fputs(
            "<p>There are no predictions in OUT/predicted: goniocam reconstruct makes them.</p>\n",
            r->to);
}
