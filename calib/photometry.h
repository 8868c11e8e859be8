/* photometry.h -- what the lit surfaces of a scene say of its lamps. Internal to calib/. */
#ifndef GONIOCAM_PHOTOMETRY_H
#define GONIOCAM_PHOTOMETRY_H

#include "pattern.h"
#include "sample_light.h"
#include "solid.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Patch k of the capture is material MATERIAL_PATCH + k. */
enum { MATERIAL_SAMPLE, MATERIAL_PAPER, MATERIAL_PATCH };

/** A small piece of a lit surface in one view, averaged over many photosites. */
struct facet {
    int view, material;
    int place;                 // on the board: what is uneven there all views share; -1: none
    vec3 point, normal;        // world; on the board the mean place of its photosites
    vec3 spread[2];            // whose covariance is the sum of s s^T; 0: point is their middle
    double pixel[2];           // its middle
    double mean[3], noise[3];  // radiance and its standard deviation
    bool bright;               // enough above noise for a logarithm: else what follows is not set
    double log_seen[3];        // ln radiance, as photographed
    double sigma_seen[3];      // of log_seen: noise, and what averaging over the facet may cost
    double log_value[3];       // ln of the part of it that is the lamp's own light
    double sigma[3];           // of log_value, but for
    double doubt[3];           // that of the light from elsewhere that was taken out
    double echo[ECHOES][3];    // by what log_value falls when the sample's light grows by its own
};
/** A growing list of facets; {0} is empty; free(list.facet). */
struct facets {
    struct facet *facet;
    int count, room;
};

/** Append the white of the tags seen in a view (the paper, in four quarters of each tag) and the
 *  patches. Cells that the sample hides, and partly shadowed ones, are left out. */
enum status cal_board_facets(struct facets *facets, const struct radiance *map,
                             const struct calibration *calibration, int view,
                             const struct capture *capture, const struct tag_family *family,
                             struct error *err);
/** Append about `wanted` facets of the sample in a view, lit or not. */
enum status cal_sample_facets(struct facets *facets, const struct radiance *map,
                              const struct calibration *calibration, int view, int wanted,
                              struct error *err);
#ifdef __cplusplus
}
#endif
#endif
