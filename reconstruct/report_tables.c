/* report_tables.c -- the tables that the page shades with, packed for tables.js.
 *
 * Method.   A value becomes a whole number by its logarithm, in steps of 0.2 %: it is off by 0.1 %
 *           at most, a quarter of a step of 8 bits. Differences between neighbours along phi_d are
 *           small: zigzag, low bytes apart from high bytes, deflate, base 64. A table of 35 MB
 *           becomes 2 to 5.
 *           Fits are tabulated too, so that the page needs to know no model: on a coarser grid in
 *           phi_d, and up to pi/2 only, since models are the same on both sides of the plane of
 *           incidence.
 */
#include "report.h"

#include <stdlib.h>
#include <zlib.h>

static const double step = 0.002;

struct packing {
    struct grid stored;  // phi_d: what is stored
    bool mirrored;
    double low;      // of code 2
    uint16_t *code;  // [3][bins]
};

static size_t cells_of(const struct packing *p)
{
    return 3 * (size_t)rec_grid_bins(p->stored);
}

// Codes of [3][bins] values: 0 is no value, 1 is zero.
static bool make_codes(struct packing *p, const float *value)
{
    size_t n = cells_of(p);
    double low = INFINITY;
    for (size_t i = 0; i < n; i++)
        low = value[i] > 0 ? fmin(low, value[i]) : low;
    p->low = fmax(isfinite(low) ? low : 1, 1e-9);
    p->code = malloc(n * sizeof *p->code);
    for (size_t i = 0; p->code && i < n; i++)
        p->code[i] = value[i] < 0 ? 0
                     : value[i] < p->low
                         ? 1
                         : (uint16_t)fmin(2 + round(log(value[i] / p->low) / step), 65535);
    return p->code != NULL;
}

// Differences to bytes to a deflated stream. The caller frees it; NULL: no memory.
static unsigned char *deflated(const struct packing *p, unsigned long *size)
{
    size_t n = cells_of(p);
    unsigned long room = compressBound(2 * n);
    unsigned char *plain = malloc(2 * n), *packed = malloc(room);
    uint16_t last = 0;
    for (size_t i = 0; plain && i < n; i++) {
        int16_t d = (int16_t)(uint16_t)(p->code[i] - last);
        uint16_t zigzag = (uint16_t)((unsigned)d << 1) ^ (uint16_t)(d < 0 ? 0xffff : 0);
        plain[i] = (unsigned char)(zigzag & 255);
        plain[n + i] = (unsigned char)(zigzag >> 8);
        last = p->code[i];
    }
    if (!plain || !packed || compress2(packed, &room, plain, 2 * n, 6) != Z_OK) {
        free(packed);
        packed = NULL;
    }
    free(plain);
    *size = room;
    return packed;
}

struct packed {
    struct packing packing;
    unsigned char *data;
    unsigned long size;
};

static void write_packed(const struct report *r, const char *name, struct packed *p)
{
    const struct grid g = p->packing.stored;
    if (p->data) {
        fputs("<script type=\"text/plain\" data-name=\"", r->to);
        rec_escaped(r->to, name);
        fprintf(r->to,
                "\" data-size=\"%d,%d,%d\" data-mirrored=\"%s\" data-low=\"%.9g\" "
                "data-step=\"%g\">",
                g.theta_h, g.theta_d, g.phi_d, p->packing.mirrored ? "true" : "false",
                p->packing.low, step);
        rec_base64(r->to, p->data, p->size);
        fputs("</script>\n", r->to);
    }
    free(p->data);
    free(p->packing.code);
}

// Directions for a fit's node; those below the horizon are lifted to just above it.
static void lifted(half_diff angles, vec3 *wi, vec3 *wo)
{
    const double least = 2e-3;
    rec_directions(angles, wi, wo);
    wi->z = fmax(wi->z, least);
    wo->z = fmax(wo->z, least);
    *wi = vec3_normalize(*wi);
    *wo = vec3_normalize(*wo);
}

static void pack_fit(struct packed *p, const struct brdf *fit)
{
    p->packing = (struct packing){.stored = {90, 90, 20}, .mirrored = true};
    const struct grid g = p->packing.stored;
    const int n = rec_grid_bins(g);
    float *value = malloc(3 * (size_t)n * sizeof *value);
    for (int bin = 0; value && bin < n; bin++) {
        half_diff low, high, middle;
        vec3 wi, wo;
        double f[3];
        rec_grid_ranges(g, bin, &low, &high);
        double h = (sqrt(low.theta_h) + sqrt(high.theta_h)) / 2;
        middle = (half_diff){h * h, (low.theta_d + high.theta_d) / 2,
                             (low.phi_d + high.phi_d) / 4};  // phi_d to pi/2
        lifted(middle, &wi, &wo);
        rec_brdf_eval(fit, wi, wo, f);
        for (int c = 0; c < 3; c++)
            value[(size_t)c * (size_t)n + (size_t)bin] = (float)f[c];
    }
    if (value && make_codes(&p->packing, value))
        p->data = deflated(&p->packing, &p->size);
    free(value);
}

static void pack_table(struct packed *p, const struct merl *table)
{
    const size_t n = 3 * (size_t)MERL_BINS;
    p->packing = (struct packing){.stored = rec_merl_grid};
    float *value = malloc(n * sizeof *value);
    for (size_t i = 0; value && i < n; i++)
        value[i] = (float)table->value[i];
    if (value && make_codes(&p->packing, value))
        p->data = deflated(&p->packing, &p->size);
    free(value);
}

void rec_report_tables(const struct report *r)
{
    enum { MOST = 32 };
    struct packed packed[MOST];
    const int fits = r->source.fits.count < MOST - 1 ? r->source.fits.count : MOST - 1;
    for (int k = 0; k <= fits; k++)
        packed[k] = (struct packed){0};
#pragma omp parallel for schedule(dynamic, 1) num_threads(r->options.threads)
    for (int k = 0; k <= fits; k++) {
        struct brdf fit = k > 0 ? rec_plot_fit(&r->source, k - 1) : (struct brdf){0};
        if (k > 0)
            pack_fit(packed + k, &fit);
        else
            pack_table(packed, &r->source.brdf.table);
    }
    for (int k = 0; k <= fits; k++) {
        char name[80];
        snprintf(name, sizeof name, "%s%s", k > 0 ? "fit: " : "measured table",
                 k > 0 ? r->source.fits.fit[k - 1].model->name : "");
        write_packed(r, name, packed + k);
    }
}
