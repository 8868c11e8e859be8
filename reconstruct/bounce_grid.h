/* bounce_grid.h -- light on a grid: computed where it is asked for, finer where it bends. */
#ifndef GONIOCAM_BOUNCE_GRID_H
#define GONIOCAM_BOUNCE_GRID_H

#include "bounce_sum.h"

/** The light at a place (u, v) of a grid, whose nodes are the whole numbers; false: none is asked
 *  for there. */
typedef bool bounce_source(const void *of, double u, double v, struct bounced_light *light);

struct bounce_node;
struct bounce_cell;

/** One grid, filled as it is asked. For one thread. Owns node and cell; {0} is empty;
 *  rec_grid_free(). */
struct bounce_grid {
    int columns, rows;  // of nodes
    bool around;        // the columns close upon themselves
    int cuts_max;       // into how many parts a side a cell may be cut
    double faint;       // radiance, sum of channels, beside which errors do not count
    bounce_source *source;
    const void *of;            // borrowed
    struct bounce_node *node;  // [rows][columns]
    struct bounce_cell *cell;  // [rows][columns]
};

/** Room for the nodes of a grid whose other members are set. false: no memory. */
bool rec_grid_begin(struct bounce_grid *grid);
void rec_grid_free(struct bounce_grid *grid);

/** The light at a place of the grid, between its nodes (method: bounce_grid.c). false: the source
 *  has none at a node about it. Requires 0 <= v <= rows - 1, and of u likewise but where the grid
 *  goes around. */
bool rec_grid_at(struct bounce_grid *grid, double u, double v, struct bounced_light *light);

#endif
