/* bounce_ball.h -- what the ball sends to the board. */
#ifndef GONIOCAM_SAMPLES_BOUNCE_BALL_H
#define GONIOCAM_SAMPLES_BOUNCE_BALL_H

#include "shade.h"

/** The board's radiance by cells, [rows][columns][3] from its corner (x0, y0). */
struct board_glow {
    double x0, y0, cell;
    int columns, rows;
    const double *radiance;
};

/** Of sam_board_mirrored's rings. */
static const double SAM_FINEST_SKY = 0.02;

/** Is the post in the way from a point, before `far`? */
bool sam_post_between(const struct world *world, vec3 from, vec3 direction, double far);
/** Add the board's light off a spot of the sample towards wo, by rings about the mirror direction;
 *  alone, or weighed beside a sum over the board's cells (sam_rule_weight). */
void sam_board_mirrored(const struct shot_view *view, const struct board_glow *board,
                        const struct spot *spot, vec3 wo, bool alone, double rgb[3]);
/** Irradiance [3] that the ball adds at a place of the board: the lamp's light off it. */
void sam_ball_throws(const struct shot_view *view, vec3 place, double irradiance[3]);
/** And the board's own light, which the ball sends back. */
void sam_ball_returns(const struct shot_view *view, const struct board_glow *board, vec3 place,
                      double irradiance[3]);
#endif
