/* cues.h -- what each kind of evidence alone says of the lamps. Internal to calib/. */
#ifndef GONIOCAM_CUES_H
#define GONIOCAM_CUES_H

#include "lamp.h"

/** Fill a lamp's CUE_HIGHLIGHT. It lies as far from the sample as CUE_JOINT. STATUS_MEMORY. */
enum status cal_highlight_cue(struct calibration *c, int lamp,
                              const struct seen_highlight *highlight, struct error *err);

/** Fill the cues of all lamps of a finished calibration. highlight is [1 + balls][views].
 * STATUS_MEMORY. */
enum status cal_cues(struct calibration *c, const struct capture *capture,
                     const struct facets *board, const struct facets *sample,
                     const struct seen_highlight *highlight, struct run *run, struct error *err);
/** Warn of cues that disagree with the joint answer beyond four sigmas of both. */
void cal_cues_compare(const struct lamp *lamp, struct run *run);
#endif
