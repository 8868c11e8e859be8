/* lamp.h -- lamps found by how they light the scene. Internal to calib/. */
#ifndef GONIOCAM_LAMP_H
#define GONIOCAM_LAMP_H

#include "board_light.h"
#include "photometry.h"

#ifdef __cplusplus
extern "C" {
#endif

/** From the world into the frame that a lamp is fixed in: the world itself, or a view's camera. */
vec3 cal_lamp_frame(const struct lamp *lamp, pose view_from_world, vec3 point);
vec3 cal_lamp_frame_direction(const struct lamp *lamp, pose view_from_world, vec3 direction);

/** A first place for lamp `l`, good to some centimetres, from the board facets of its views: the
 *  best of a grid over all directions and distances. STATUS_DATA: no such facets. */
enum status cal_lamp_start(struct calibration *calibration, int l, const struct facets *board,
                           struct error *err);

enum { SAMPLE_SHIFTS = 4 };
/** How far light finds a sphere's centre, and its radius, from what its outline says. */
struct sample_shift {
    double by[SAMPLE_SHIFTS], sigma[SAMPLE_SHIFTS];  // sigma: by outline and light together
    double misfit;  // of ln radiance: how far the sample is off what the fit says
};

/** A highlight seen in a view; sigma 0: there is none. */
struct seen_highlight {
    vec3 wi, point, to_eye;  // world; point on the sample, a sphere
    double sigma;            // of wi, rad
    bool saturated, small;   // too small for facets to show its middle
};
/** What tells of the lamps. NULL: nothing of that kind. */
struct lamp_evidence {
    const struct facets *board, *sample;
    const struct seen_highlight *highlight;  // [1 + balls][views]: on the sample, then on balls
    // 1: none. More makes the sample's sigmas larger: then its facets hardly move the lamps, but
    // its lobe is found all the same.
    double doubt;
};
/** Place and intensity of all lamps, the power of all views and (without a flat frame) the
 *  vignetting, jointly. may_be_far: a lamp whose distance the facets do not determine is put at
 *  infinity. A sphere's centre and radius may move within their sigmas: *shift (may be NULL) tells
 *  where to; the sample itself stays, so that fits can follow each other. */
enum status cal_lamp_fit(struct calibration *calibration, const struct capture *capture,
                         const struct lamp_evidence *evidence, bool may_be_far,
                         struct sample_shift *shift, struct error *err);
/** The same of board, sample and highlights with the light that goes between board and sample
 *  taken out: by turns that light is measured (cal_board_light) and the lamps are fitted, until
 *  they stay. Writes the facets' log_value, sigma and echo. */
enum status cal_lamp_fit_bounced(struct calibration *calibration, const struct capture *capture,
                                 struct facets *board, struct facets *sample,
                                 const struct seen_highlight *highlight, double doubt,
                                 const struct board_survey *survey, struct sample_shift *shift,
                                 struct run *run, struct error *err);

/** What is known of the lamps on the way. Begin, end, free. */
struct lamp_search {
    const struct capture *capture;
    const char *out;
    struct facets board;
    struct board_survey survey;  // where there is a sample
};
/** Lamps by the board alone, on a merged capture whose sample stands in its place to a millimetre:
 *  names lamps, fills them, powers and vignetting. Reads OUT/radiance/SHOT.exr. */
enum status cal_lamps_begin(struct lamp_search *search, struct calibration *calibration,
                            const struct capture *capture, const char *out, struct run *run,
                            struct error *err);
/** By all that lights up, with the sample in its place. */
enum status cal_lamps_end(struct lamp_search *search, struct calibration *calibration,
                          struct run *run, struct error *err);
void cal_lamp_search_free(struct lamp_search *search);
/** All of it where there is no sample. */
enum status cal_lamps_by_board(struct calibration *calibration, const struct capture *capture,
                               const char *out, struct run *run, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
