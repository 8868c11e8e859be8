/* board_draw.h -- a board drawn by cairo. Internal to calib/. */
#ifndef GONIOCAM_BOARD_DRAW_H
#define GONIOCAM_BOARD_DRAW_H

#include "board_plan.h"

#include <cairo.h>

/** Draw a plan; one unit of cr is a millimetre, its origin the paper's top left corner, y down.
 *  STATUS_DATA: the family lacks a tag of the plan. */
enum status board_draw(cairo_t *cr, const struct board_plan *plan, const struct tag_family *family,
                       struct error *err);
/** The plan as a PDF page of its size; the file is complete or absent. */
enum status board_write_pdf(const char *path, const struct board_plan *plan,
                            const struct tag_family *family, struct error *err);
#endif
