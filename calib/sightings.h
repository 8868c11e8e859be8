/* sightings.h -- the tags of a board in all photographs. */
#ifndef GONIOCAM_SIGHTINGS_H
#define GONIOCAM_SIGHTINGS_H

#include "bundle.h"

/** A growing list of sightings; {0} is empty; free(list.sighting). */
struct sightings {
    struct sighting *sighting;
    int count;
};

/** Detect the tags of all shots that have a map (usable NULL: all). In the result, `view` of a
 *  sighting is the shot's index. In order of shots, then ids. With board->tag_size, tags that two
 *  shots or more show and the board does not name are added to board->tag (grown by realloc),
 *  unplaced. STATUS_IO, STATUS_MEMORY, STATUS_DATA (no such family or tag). On success the caller
 *  owns list->sighting. */
enum status sightings_detect(struct sightings *list, struct capture *board, const char *out,
                             const bool *usable, struct run *run, struct error *err);

/** Fit every tag of the board in every view, from where it was detected (*list, of indices of
 *  views) or else from where the calibration expects it; replaces *list. A view in which the fit
 *  trusts fewer than `enough` tags keeps its detections. Same statuses. */
enum status sightings_refine(struct sightings *list, int enough,
                             const struct calibration *calibration, const struct capture *capture,
                             const char *out, struct run *run, struct error *err);
#endif
