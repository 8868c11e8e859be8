/* bounce_map.h -- what the lit board adds to a view's photosites on the sample. */
#ifndef GONIOCAM_BOUNCE_MAP_H
#define GONIOCAM_BOUNCE_MAP_H

#include "bounce_grid.h"

/** Bounced radiance of one view on a grid of pixels, filled where it is asked for. For one thread.
 *  Owns the grids; {0} is empty; rec_bounce_free(). */
struct bounce_map {
    const struct calibration *calibration;
    const struct viewing *viewing;
    struct bounce_through through;  // table NULL: calib's first guess serves
    int view, step;                 // step: of the grid of pixels
    pixel_box box;
    struct bounce_grid pixels, rim;  // rim: near a ball's outline, by turn and ring
};

/** An empty map over the box. Where the calibration knows of no surroundings it gives 0. */
enum status rec_bounce_make(struct bounce_map *map, const struct calibration *calibration, int view,
                            const struct viewing *viewing, pixel_box box, struct error *err);
void rec_bounce_free(struct bounce_map *map);

/** What a photosite sees: a place on the sample, and the direction back to the camera. */
typedef struct {
    vec3 point, normal, wo;
} sight;

/** The bounced light (of the scene: vignetting not applied) in the middle of a photosite. */
struct bounced_light rec_bounce_at(struct bounce_map *map, const sight *a, int x, int y);
/** The same as the photosite sees it: of a ball, the mean over photosite and lens (blur_px). */
struct bounced_light rec_bounce_seen(struct bounce_map *map, const sight *a, int x, int y);

#endif
