/* board_plan.h -- a printable board: where tags, patch, sample and ruler go on the paper. Internal
 * to calib/. */
#ifndef GONIOCAM_BOARD_PLAN_H
#define GONIOCAM_BOARD_PLAN_H

#include "pattern.h"

enum { PLAN_TAGS_MAX = 512 };
/** A board on paper. Lengths are millimetres on the page as it is meant; the origin is the paper's
 *  middle, x to the right, y up. */
struct board_plan {
    double paper[2];  // width, height
    struct tag_place tag[PLAN_TAGS_MAX];
    int tags;
    double sample_radius;         // of the circle at the origin that the sample stands on
    double patch[2], patch_side;  // middle and side of the place for the white patch
    double ruler, ruler_y;        // length, centred on x = 0; a multiple of 50
};

/** Paper by name (a4, a3, letter, ..., long side across) or as WIDTHxHEIGHT. false: neither. */
bool board_plan_paper(double paper[2], const char *name);
/** Lay out tags of `size` (0: a ninth of the short side) in a ring about the sample.
 *  STATUS_DATA: the paper is too small for it, or the family has too few tags. */
enum status board_plan_make(struct board_plan *plan, const double paper[2], double size,
                            const struct tag_family *family, struct error *err);
/** The plan as printed, where the ruler turned out `measured` long. Requires measured > 0. */
void board_plan_scale(struct board_plan *plan, double measured);
#endif
