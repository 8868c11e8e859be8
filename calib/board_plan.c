/* board_plan.c -- the layout of a printable board.
 *
 * Method.   Tags stand in a ring along the edge of the paper, with at least GAP of their size
 *           between the white surrounds, for they fix a camera best far from each
 *           other, and the middle is for the sample and, on its right, the white patch. Another
 *           such ring follows inside wherever the middle still has room.
 */
#include "board_plan.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double PRINTER_MARGIN = 8;  // no printer wants more
static const double RULER_STRIP = 11;    // for the ruler and its numbers, below the tags
static const double GAP = 0.15;          // of a tag's size, between surrounds
static const double PATCH = 40, PATCH_MIN = 20;
static const double SIZE_PART = 9;  // tags in the short side, where none is asked for

bool board_plan_paper(double paper[2], const char *name)
{
    static const struct {
        const char *name;
        double width, height;
    } known[] = {{"a5", 210, 148},         {"a4", 297, 210},        {"a3", 420, 297},
                 {"a2", 594, 420},         {"a1", 841, 594},        {"a0", 1189, 841},
                 {"letter", 279.4, 215.9}, {"legal", 355.6, 215.9}, {"tabloid", 431.8, 279.4}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strcasecmp(name, known[i].name) == 0) {
            paper[0] = known[i].width;
            paper[1] = known[i].height;
            return true;
        }
    char *end;
    double width = strtod(name, &end);
    if (end == name || (*end != 'x' && *end != 'X'))
        return false;
    const char *second = end + 1;
    double height = strtod(second, &end);
    if (end == second || *end || !(width > 0 && width < 1e4 && height > 0 && height < 1e4))
        return false;
    paper[0] = width;
    paper[1] = height;
    return true;
}

/** One ring of tags whose centres lie on the border of [-half, half] about `middle_y`. */
static bool add_ring(struct board_plan *plan, const double half[2], double middle_y, double size,
                     double pitch, int ids)
{
    int n[2];
    for (int a = 0; a < 2; a++)
        n[a] = (int)floor(2 * half[a] / pitch + 1e-9) + 1;
    for (int j = 0; j < n[1]; j++)
        for (int i = 0; i < n[0]; i++) {
            bool rim = i == 0 || j == 0 || i == n[0] - 1 || j == n[1] - 1;
            if (!rim)
                continue;
            if (plan->tags == PLAN_TAGS_MAX || plan->tags == ids)
                return false;
            double x = n[0] > 1 ? half[0] * (2.0 * i / (n[0] - 1) - 1) : 0;
            double y = n[1] > 1 ? half[1] * (1 - 2.0 * j / (n[1] - 1)) : 0;
            plan->tag[plan->tags] = (struct tag_place){.id = plan->tags,
                                                       .size = size,
                                                       .center = {x, middle_y + y, 0},
                                                       .x_axis = {1, 0, 0},
                                                       .y_axis = {0, 1, 0}};
            plan->tags++;
        }
    return true;
}

enum status board_plan_make(struct board_plan *plan, const double paper[2], double size,
                            const struct tag_family *family, struct error *err)
{
    struct board_plan p = {.paper = {paper[0], paper[1]}};
    double tag = size > 0 ? size : floor(fmin(paper[0], paper[1]) / SIZE_PART);
    const apriltag_family_t *f = family->tags;
    double rim = 0.5 * tag * f->total_width / f->width_at_border;  // of the whole pattern
    double half[2] = {0.5 * paper[0] - PRINTER_MARGIN - rim,
                      0.5 * (paper[1] - RULER_STRIP) - PRINTER_MARGIN - rim};
    double middle_y = 0.5 * RULER_STRIP;
    double inner[2] = {half[0] - rim, half[1] - rim - middle_y};  // free about the origin
    // The patch keeps its distance from a sample as wide as itself: neither shades the other much.
    double side = fmin(PATCH, fmin(inner[0] / 2.5, 1.2 * inner[1]));
    if (tag < 1 || half[0] < rim || half[1] < rim || side < PATCH_MIN)
        return cap_fail(err, STATUS_DATA,
                        "tags of %.3g mm, a sample and a white patch of %.3g mm do not fit on "
                        "paper of %.4g x %.4g mm: take larger paper or smaller tags",
                        tag, PATCH_MIN, paper[0], paper[1]);
    p.sample_radius = fmin(0.75 * side, 0.9 * inner[1]);
    p.patch_side = side;
    p.patch[0] = inner[0] - 0.75 * side;
    if (!add_ring(&p, half, middle_y, tag, 2 * rim + GAP * tag, (int)f->ncodes))
        return cap_fail(err, STATUS_DATA,
                        "tags of %.3g mm: more than family %s has, or a board can use; take larger "
                        "ones",
                        tag, f->name);
    p.ruler = 50 * floor((paper[0] - 2 * PRINTER_MARGIN) / 50);
    p.ruler = fmin(p.ruler, 150);
    p.ruler_y = -0.5 * paper[1] + PRINTER_MARGIN;
    *plan = p;
    return STATUS_OK;
}

void board_plan_scale(struct board_plan *plan, double measured)
{
    double scale = measured / plan->ruler;
    for (int i = 0; i < plan->tags; i++) {
        plan->tag[i].size *= scale;
        plan->tag[i].center = vec3_scale(plan->tag[i].center, scale);
    }
    for (int a = 0; a < 2; a++) {
        plan->paper[a] *= scale;
        plan->patch[a] *= scale;
    }
    plan->sample_radius *= scale;
    plan->patch_side *= scale;
    plan->ruler *= scale;
    plan->ruler_y *= scale;
}
