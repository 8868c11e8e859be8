/* start.h -- first values of cameras and poses, for the bundle. */
#ifndef GONIOCAM_START_H
#define GONIOCAM_START_H

#include "bundle.h"

/** Corners of one view, as OpenCV wants them: in the world, and freed of the lens. */
struct start_corners {
    double (*point)[3], (*normalised)[2];
    int count;
};
/** Room for those of a view. start_corners_free() accepts {0}. STATUS_MEMORY. */
enum status start_corners_make(struct start_corners *c, const struct bundle *bundle,
                               struct error *err);
void start_corners_free(struct start_corners *c);
/** Those of the tags that have a place, among place [capture->tags]. */
void start_corners_of(struct start_corners *c, const struct bundle *bundle,
                      const struct tag_place *place, int view, const struct camera *camera);

/** A camera of that focal length, its centre in the middle, without distortion. */
void start_pinhole(struct camera *camera, double focal_px);
/** Give one camera a focal length, unless a prior tells it, and its views poses. Views that see no
 *  tag with a place keep their pose. */
enum status start_camera(const struct bundle *bundle, const struct tag_place *place, int camera,
                         struct error *err);
/** Give every camera of the bundle a focal length (centre: the middle; no distortion) and every
 *  view a pose. Requires at least one sighting in each view. STATUS_SOLVER, STATUS_MEMORY. */
enum status start_cameras(const struct bundle *bundle, struct error *err);
/** Solve the pose of each view again with the cameras as they are now, and keep it where it
 *  explains the view's tags better: cures views that began in the wrong one of two mirrored poses.
 */
enum status start_poses_again(const struct bundle *bundle, struct error *err);

#endif
