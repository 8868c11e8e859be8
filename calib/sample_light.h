/* sample_light.h -- the lit sample as a lamp of the board. Internal to calib/. */
#ifndef GONIOCAM_SAMPLE_LIGHT_H
#define GONIOCAM_SAMPLE_LIGHT_H

#include "calib.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Kinds of light that the sample sends to the board, or the board by way of the sample to the
 *  camera, by how well the sample's reflectance is known there: by the matte part; by the gloss, at
 * angles to the mirror's normal as photographs show them; by the gloss at grazing angles, which
 * they hardly show; and for highlights that are saturated or too small to be measured, what a
 * mirror would send, in each channel as of a reflectance that it has face on, and as of one that
 * rises to 1 at the rim:  F = F0 (1 - s) + F90 s  with s of cal_rise(). */
enum echo { ECHO_MATTE, ECHO_GLOSS, ECHO_GRAZING, ECHO_MIRROR, ECHO_RIM = ECHO_MIRROR + 3, ECHOES };

/** By which share of the way from F0 to 1 a reflectance has risen at a cosine from the normal:
 *  Fresnel's for an index of 1.5, near which those of varnish, plastic and glass are. Metals rise
 *  later and by little. */
double cal_rise(double cosine);

/** The board's light at the sample: what has been reflected twice when it comes back. Owns its
 *  arrays; {0}: none; cal_returns_free(). */
struct returns {
    double (*matte)[3];  // [lamps SOLID_POINTS][3] radiance of the sample's matte part, for power 1
    struct glow *coarse;  // [lamps][cells] the board, some cells of surroundings put together
    int cells;
};
/** STATUS_MEMORY. */
enum status cal_returns(struct returns *returns, const struct calibration *calibration,
                        struct run *run, struct error *err);
void cal_returns_free(struct returns *returns);

/** What mirrors in the sample's place, a sphere, would send, as cal_sample_light: of F0 = 1 and F90
 *  = 0, and the other way round. */
void cal_mirror_light(const struct calibration *calibration, const struct returns *returns,
                      int view, vec3 point, vec3 normal, double face_on[3], double rim[3]);
/** Radiance that the sample, lit by a view's lamp and by the board (returns; NULL: not), adds to a
 *  matte surface of reflectance 1 at a point with a normal: [ECHOES][3], to be multiplied by the
 *  surface's albedo. */
void cal_sample_light(const struct calibration *calibration, const struct returns *returns,
                      int view, vec3 point, vec3 normal, double radiance[ECHOES][3]);

#ifdef __cplusplus
}
#endif
#endif
