/* bundle.h -- bundle adjustment: cameras, poses and tag places from tags seen in many views. */
#ifndef GONIOCAM_BUNDLE_H
#define GONIOCAM_BUNDLE_H

#include "calib.h"
#include "lens.h"

/** A tag seen in a view. */
struct sighting {
    int view;             // index into calibration->view
    int place;            // index into capture->tag
    double corner[4][2];  // as fitted through `lens`; see bundle_corner
    double lens[LENS_PARAMETERS], by_lens[8][LENS_PARAMETERS];  // d corner / d lens; 0: as detected
    double covariance[8][8];  // of corner, px^2; only its shape counts: see bundle_adjust
    double log_noise;         // ln of its view's variance over the common one, see bundle_noise.h
    double blur;              // of a refined one: variance of the point spread, as in corners.h
    double covered;           // share of a refined one's photosites that are not its pattern's
    bool refined;             // by corners.h; else as detected
    bool rejected;            // disagrees with all others: not used
};

/** What is known of a camera beforehand, in the order of lens.h. */
struct lens_prior {
    double value[LENS_PARAMETERS];
    double sigma[LENS_PARAMETERS];  // INFINITY: not known; 0: held
    double sigma_square;            // of ln(fy / fx), which is 0 on average; 0: not known
};

/** Everything is borrowed from the caller. */
struct bundle {
    struct calibration *calibration;  // camera and view are read as a start, and written
    const struct capture *capture;    // for the places of the tags
    struct sighting *sighting;        // [sightings]
    int sightings;
    // Places of tags that are not held are read as a start and written to capture->tag. A tag with
    // `unplaced` is free; the others are held, or, where `place_sigma` > 0, free about `given`.
    const struct tag_place *given;  // [capture->tags], NULL: all places are held
    double place_sigma;             // of the centres of given places, mm
    double (*sigma_place)[6];       // [capture->tags] turn (rad), centre (mm), written; may be NULL
    const struct lens_prior *prior;  // [calibration->cameras], NULL: nothing is known
    // Deviation of the errors that all corners share, px. Averages do not get better than it where
    // the photographs leave a camera open. 0: corners are independent.
    double shared_px;
};

/** What stays as it is: a beginning holds more than an end. */
enum bundle_stage {
    BUNDLE_FOCAL,   // focal length and k1 are free, and the poses
    BUNDLE_LENS,    // and the centre, k2, p1, p2
    BUNDLE_CHOOSE,  // everything, less the distortion terms that the sightings cannot tell from 0
};

/** Minimise the reprojection error of all sightings that are not rejected, robustly, a tag in a
 *  view being the independent unit of noise. In the last stage sightings far outside the
 *  common noise are marked rejected on the way, and sigmas and rms_px are filled in, scaled by the
 *  scatter that the tags show about the fit. Of what is held, sigmas are 0; of what has a prior,
 *  that of the prior is in them.
 *  STATUS_SOLVER, STATUS_DATA (the sightings do not determine a camera). */
enum status bundle_adjust(struct bundle *bundle, enum bundle_stage stage, struct error *err);

/** The corners of a sighting, seen through the camera as it is now: the fit of a tag's pattern
 *  follows the lens that bends its edges. */
void bundle_corner(const struct camera *camera, const struct sighting *s, double corner[4][2]);
/** Root mean square distance of the corners of one view (view < 0: of all views of a camera) from
 *  their projections, in pixels, rejected ones left out; 0 where there are none. */
double bundle_rms(const struct bundle *bundle, int view, int camera);
/** Residuals of one sighting, px: measured minus projected. false: behind the camera, or of a tag
 *  that has no place yet. */
bool bundle_residual(const struct bundle *bundle, const struct sighting *s, double r[4][2]);
/** *share of the variance of the tags' noise that other places of the tags would take away, beyond
 *  what six more unknowns a tag always do: near 0 where the board is as it is said to be, near 1
 *  where its places are what is wrong. Statuses are those of bundle_adjust. */
enum status bundle_places_share(struct bundle *bundle, double *share, struct error *err);

/** A tag of the board has a place (it may have to be found first). */
bool bundle_placed(const struct tag_place *tag);

#endif
