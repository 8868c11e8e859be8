/* residuals.h -- what photosites differ from what other shots saw under the same angles, against
 * where they are on the sample and how its surface lies: an even material without grain shows
 * nothing. */
#ifndef GONIOCAM_RESIDUALS_H
#define GONIOCAM_RESIDUALS_H

#include "samples.h"

enum { BANDS = 8, SECTORS = 12, PLACE_CELLS = BANDS * SECTORS, GRAIN_CELLS = 18 };

/** Means of shots in a cell; sums in units of 2^-30, so that no order changes them. */
struct cell {
    int64_t shots, sum, squares;
};
void rec_cells_merge(struct cell *to, const struct cell *from, int count);

/** All shots. place: bands of equal area about the sample's axis (the board's normal where it has
 *  none), cut into sectors. grain: azimuth of h about the normal, from the axis, modulo pi. */
struct residuals {
    struct cell place[PLACE_CELLS], grain[GRAIN_CELLS];
};
/** One shot, under way: weighted sums, weights and counts of the same cells. */
struct shot_residuals {
    double sum[PLACE_CELLS + GRAIN_CELLS], weight[PLACE_CELLS + GRAIN_CELLS];
    int count[PLACE_CELLS + GRAIN_CELLS];
    vec3 frame[3];  // of the sample: its axis last; zeros before the first photosite
};

/** A photosite's residual; one that has none (NAN) is passed over. */
void rec_residual_add(struct shot_residuals *shot, const reflectance_sample *s,
                      const struct sample *sample);
/** The shot is over: its means enter the cells that it filled well. */
void rec_residuals_end_shot(struct residuals *to, const struct shot_residuals *shot);
void rec_residuals_merge(struct residuals *to, const struct residuals *from);

/** How much the means of cells differ beyond what their scatter from shot to shot explains. */
typedef struct {
    double rms;    // of the cells' true means, relative; 0: none is seen
    double sigma;  // what of such an rms would be seen where there is none, 1 sigma
    double chi2;   // mean of (cell / its standard error)^2: 1 where all cells are alike
    int cells;     // that at least three shots filled
} unevenness;
unevenness rec_unevenness(const struct cell *cell, int count);

#endif
