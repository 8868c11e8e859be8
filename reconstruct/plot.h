/* plot.h -- plots of a BRDF: lobes, slices, coverage, albedo, lit spheres, comparisons. Each is
 * drawn once, with whatever pen: for a paper, or for the report.
 */
#ifndef GONIOCAM_PLOT_H
#define GONIOCAM_PLOT_H

#include "axes.h"
#include "reconstruct.h"
#include "sphere.h"

/** A BRDF to draw, and what is known of its errors. Owns all; {0} is empty;
 *  rec_plot_source_free(). */
struct plot_source {
    char *name;
    struct brdf brdf;  // the table, or a model
    struct bins bins;  // what was measured; none of a table without bins.h5
    int *bin_at;       // [MERL_BINS] index into bins.bin, or -1; NULL without bins
    uint8_t *status;   // [MERL_BINS] enum bin_status; NULL without bins
    struct fits fits;  // best first; none where there is no fits.yaml
};
/** From OUT (its brdf.binary, bins.h5, fits.yaml), a MERL table, or a fits.yaml. On success the
 *  caller owns *source. STATUS_IO, STATUS_FORMAT, STATUS_MEMORY. */
enum status rec_plot_source_read(struct plot_source *source, const char *path, struct error *err);
void rec_plot_source_free(struct plot_source *source);
/** Fit k as a BRDF; it borrows nothing and owns nothing. */
struct brdf rec_plot_fit(const struct plot_source *source, int k);

enum { PLOT_THETAS = 8, PLOT_FITS = 5 };
struct plot_options {
    double theta_deg[PLOT_THETAS];  // of the light
    int thetas;
    bool channel[3];   // to draw
    int fits;          // the best ones, drawn over the table; at most PLOT_FITS
    double phi_d_deg;  // of slices
    int threads;
};

// ---- in the plane of incidence

/** A steps of half a degree: theta_o from -90 to 90, ends left out. Beyond 0 is the mirror's side.
 */
enum { CUT_POINTS = 359 };
struct cut {
    double theta_i_deg, theta_o_deg[CUT_POINTS];
    double f[3][CUT_POINTS];
    double sigma[3][CUT_POINTS];  // of the table; NAN: not measured there
    uint8_t status[CUT_POINTS];   // enum bin_status; BIN_MEASURED where nothing is known
};
/** of may be the source's own BRDF or a fit. */
void rec_cut(struct cut *lobe, const struct plot_source *source, const struct brdf *of,
             double theta_i_deg);
/** Round numbers about f for theta_deg[k], to 80 degrees. */
void rec_cut_range(double *low, double *high, const struct plot_source *source,
                   const struct plot_options *options, int k);

/** A half disc of radius log f, for theta_deg[k]; in its box of width x height points. Bands are
 *  2 sigma. Groups: "ch chN" of a channel, "fit fitN" of a fit. */
void rec_plot_polar(struct pen *pen, const struct plot_source *source,
                    const struct plot_options *options, int k, point2 at, double width,
                    double height);
/** The same over theta_o, log f; below it what the fits and 2 sigma are, over the table. */
void rec_plot_cartesian(struct pen *pen, const struct plot_source *source,
                        const struct plot_options *options, int k, point2 at, double width,
                        double height);

// ---- pictures

/** theta_h (by its square root, to the right) x theta_d (up) at phi_d, of bins' centers, [90][90].
 *  channel 0..2: log f from low (dark) to high; -1: its colour, as bright as log f. Transparent
 *  where there is nothing. */
struct picture rec_slice_picture(const struct brdf *brdf, int channel, double phi_d_deg, double low,
                                 double high);
/** Round numbers about f, without the highest and lowest thousandth. */
void rec_slice_range(double *low, double *high, const struct brdf *brdf, double phi_d_deg);
/** a over b in such a slice: blue below 1, white at 1, red above; by `full` (1.25) and more: full
 *  colour. */
struct picture rec_ratio_picture(const struct brdf *a, const struct brdf *b, int channel,
                                 double phi_d_deg, double full);
/** Colour of share [0, 1] of the way from dark to bright, 0xRRGGBB; the same for ratios, -1 to 1.
 */
uint32_t rec_heat(double share);
uint32_t rec_ratio_color(double share);

/** What part of the bins was measured: [90][90], over all phi_d of a (theta_h, theta_d), and
 *  [45][45], over all azimuths of (theta_i, theta_o). */
struct picture rec_coverage_half(const uint8_t *status);
struct picture rec_coverage_in_out(const uint8_t *status);

void rec_plot_slice(struct pen *pen, const struct plot_source *source,
                    const struct plot_options *options, point2 at, double side);
void rec_plot_coverage(struct pen *pen, const struct plot_source *source, point2 at, double side);
/** What leaves for light from theta_i, of the table and the best fit; sigma ([n], NULL) at given
 *  angles. */
void rec_plot_albedo(struct pen *pen, const struct plot_source *source,
                     const struct plot_options *options, point2 at, double width, double height);
/** Slices of two BRDFs side by side, and their ratio, a row a channel. */
void rec_plot_comparison(struct pen *pen, const struct plot_source *a, const struct plot_source *b,
                         const struct plot_options *options, point2 at, double side);

/** A sphere under a distant lamp (unit, towards it; the viewer is at z) with irradiance pi, times
 *  exposure, in sRGB; transparent off the sphere, which touches the edges but for `margin` pixels.
 */
struct picture rec_sphere_picture(const struct brdf *brdf, vec3 lamp, double exposure, int size,
                                  int margin, int threads);

// ---- files

enum plot_kind { PLOT_LOBES, PLOT_SLICE, PLOT_COVERAGE, PLOT_ALBEDO, PLOT_SPHERE, PLOT_COMPARISON };
/** Draw to FILE.png, .svg or .pdf, complete or not at all. STATUS_FORMAT: another ending, or
 *  nothing to draw: no coverage without bins, no comparison but of two; STATUS_IO. */
enum status rec_plot(enum plot_kind kind, const struct plot_source *source, int sources,
                     const struct plot_options *options, const char *path, struct error *err);

#endif
