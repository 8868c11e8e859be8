/* bundle.h -- bundle adjustment: cameras and poses from tags seen in many views. */
#ifndef GONIOCAM_BUNDLE_H
#define GONIOCAM_BUNDLE_H

#include "calib.h"

/** A tag seen in a view. */
struct sighting {
    int view;   // index into calibration->view
    int place;  // index into capture->tag
    double corner[4][2];
    double covariance[8][8];  // of corner, px^2; only its shape counts: see bundle_adjust
    bool refined;             // by corners.h; else as detected
    bool rejected;            // disagrees with all others: not used
};

/** Everything is borrowed from the caller. */
struct bundle {
    struct calibration *calibration;  // camera and view are read as a start, and written
    const struct capture *capture;    // for the places of the tags
    struct sighting *sighting;        // [sightings]
    int sightings;
};

/** What stays as it is: a beginning holds more than an end. */
enum bundle_stage {
    BUNDLE_FOCAL,   // focal length and k1 are free, and the poses
    BUNDLE_LENS,    // and the centre, k2, p1, p2
    BUNDLE_CHOOSE,  // everything, less the distortion terms that the sightings cannot tell from 0
};

/** Minimise the reprojection error of all sightings that are not rejected, robustly, a tag in a
 *  view being the independent unit of noise. In the last stage sightings far outside the common
 *  noise are marked rejected on the way, and sigmas and rms_px are filled in, scaled by the
 *  scatter that the tags show about the fit.
 *  STATUS_SOLVER, STATUS_DATA (the sightings do not determine a camera). */
enum status bundle_adjust(struct bundle *bundle, enum bundle_stage stage, struct error *err);

/** Root mean square distance of the corners of one view (view < 0: of all views of a camera) from
 *  their projections, in pixels, rejected ones left out; 0 where there are none. */
double bundle_rms(const struct bundle *bundle, int view, int camera);
/** Residuals of one sighting, px: measured minus projected. false: behind the camera. */
bool bundle_residual(const struct bundle *bundle, const struct sighting *s, double r[4][2]);

#endif
