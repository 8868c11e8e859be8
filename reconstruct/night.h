/* night.h -- light on the side of the sample that the lamp does not reach: there should be none.
 *
 * A photosite's darkness is the irradiance that would make a diffuse surface that reflects all look
 * as it does, over what the lamp gives a surface that faces it. Over the sample's albedo it is the
 * part of the lamp's light that seems to fall there. */
#ifndef GONIOCAM_NIGHT_H
#define GONIOCAM_NIGHT_H

#include "residuals.h"
#include "strip.h"

/** By how far the lamp is below the horizon: 5 to 20 degrees, and 40 to 90. */
enum night_zone { ZONE_DUSK, ZONE_NIGHT, NIGHT_ZONES };

/** One shot, under way, for one thread: photosites on a grid over the sample. {0} is empty. */
struct shot_night {
    double *dark[NIGHT_ZONES], *bounced[NIGHT_ZONES];
    int count[NIGHT_ZONES];
};

/** All shots: of each zone the shots' means, and the board's light that was taken out of them. */
struct night {
    struct cell dark[NIGHT_ZONES];
    struct cell bounced[NIGHT_ZONES];
};

/** box: where the sample can be. STATUS_MEMORY. */
enum status rec_night_add(struct shot_night *shot, const struct strip *strip,
                          const struct viewing *viewing, const struct radiance *map, pixel_box box,
                          struct error *err);
/** The shot is over: its means enter the zones that it shows well; what it holds is freed. */
void rec_night_end_shot(struct night *to, struct shot_night *shot);
void rec_night_merge(struct night *to, const struct night *from);

/** A zone's mean over shots. sigma is the shots' scatter and what the board's light leaves open;
 *  NAN: fewer than three shots show it. */
typedef struct {
    double mean, sigma;
    int shots;
} darkness;
/** bounce_sigma: of the board's light, relative. */
darkness rec_darkness(const struct night *night, enum night_zone zone, double bounce_sigma);

#endif
