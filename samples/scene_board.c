/* scene_board.c -- the flat things of SCENE.yaml: sheet, tags, patches. */
#include "scene_board.h"

#include "tags.h"

#include <math.h>
#include <stdlib.h>

static const double DEG = CAP_PI / 180;

// ---- tags

static bool add_tag(struct scene_board *board, const struct tag_place *tag)
{
    struct tag_place *grown = realloc(board->tag, (size_t)(board->tags + 1) * sizeof *grown);
    if (!grown)
        return false;
    board->tag = grown;
    board->tag[board->tags++] = *tag;
    return true;
}

/** Tags in rows and columns about the origin, numbered row by row from the top left; a ring leaves
 *  out all but the outermost. */
static bool read_tag_grid(struct scene_board *board, struct doc *doc, doc_node node, bool ring)
{
    double size = sam_doc_number(doc, node, "size", NAN, 1e-3, 1e6);
    int columns = sam_doc_int(doc, node, "columns", 2, 1, 1000);
    int rows = sam_doc_int(doc, node, "rows", 2, 1, 1000);
    int id = sam_doc_int(doc, node, "first_id", 0, 0, 100000);
    double pitch[2] = {1.5 * size, 1.5 * size};
    sam_doc_numbers(doc, node, "pitch", pitch, 2, true, size, 1e6);
    for (int r = 0; r < rows; r++)
        for (int c = 0; c < columns; c++) {
            if (ring && r > 0 && r < rows - 1 && c > 0 && c < columns - 1)
                continue;
            struct tag_place tag = {
                .id = id++, .size = size, .x_axis = {1, 0, 0}, .y_axis = {0, 1, 0}};
            tag.center.x = (c - 0.5 * (columns - 1)) * pitch[0];
            tag.center.y = (0.5 * (rows - 1) - r) * pitch[1];
            if (!add_tag(board, &tag))
                return false;
        }
    return true;
}

static bool read_tag_list(struct scene_board *board, struct doc *doc, doc_node list)
{
    for (int i = 0; i < sam_doc_count(doc, list); i++) {
        doc_node node = sam_doc_item(doc, list, i);
        struct tag_place tag = {.id = sam_doc_int(doc, node, "id", 0, 0, 100000)};
        sam_doc_need(doc, node, "id");
        tag.size = sam_doc_number(doc, node, "size", NAN, 1e-3, 1e6);
        sam_doc_need(doc, node, "center");
        tag.center = sam_doc_vec3(doc, node, "center", (vec3){0, 0, 0});
        tag.x_axis = sam_doc_vec3(doc, node, "x_axis", (vec3){1, 0, 0});
        tag.y_axis = sam_doc_vec3(doc, node, "y_axis", (vec3){0, 1, 0});
        if (fabs(vec3_length(tag.x_axis) - 1) + fabs(vec3_length(tag.y_axis) - 1)
                + fabs(vec3_dot(tag.x_axis, tag.y_axis))
            > 1e-6)
            sam_doc_wrong(doc, node, "x_axis, y_axis: unit vectors at a right angle are wanted");
        if (!add_tag(board, &tag))
            return false;
    }
    return true;
}

static bool read_tags(struct scene_board *board, struct doc *doc, doc_node node)
{
    if (sam_doc_is_list(doc, node))
        return read_tag_list(board, doc, node);
    doc_node grid;
    if ((grid = sam_doc_get(doc, node, "ring")))
        return read_tag_grid(board, doc, grid, true);
    if ((grid = sam_doc_get(doc, node, "grid")))
        return read_tag_grid(board, doc, grid, false);
    sam_doc_wrong(doc, node, "tags: a list, {ring: ...} or {grid: ...} is wanted");
    return true;
}

/** Does a family have dark bits beyond its square? */
static bool dark_beyond(const struct tag_family *family)
{
    const double square = 0.5 * family->border;
    bool dark = false;
    for (int i = 0; i < family->total * family->total && !dark; i++) {
        const double x = i % family->total + 0.5 - 0.5 * family->total;
        const double y = i / family->total + 0.5 - 0.5 * family->total;
        dark = fmax(fabs(x), fabs(y)) > square && !sam_tag_white(family, 0, x, y);
    }
    return dark;
}

bool sam_read_board(struct scene_board *board, struct doc *doc, doc_node node)
{
    sam_doc_numbers(doc, node, "size", board->size, 2, false, 0, 1e6);
    board->albedo = sam_doc_number(doc, node, "albedo", 0.2, 0, 1);
    board->white = sam_doc_number(doc, node, "white", 0.8, 0, 1);
    board->black = sam_doc_number(doc, node, "black", 0.04, 0, 1);
    board->thickness = sam_doc_number(doc, node, "paper_thickness", 0.1, 1e-3, 100);
    snprintf(board->family, SCENE_NAME, "%s", sam_doc_text(doc, node, "family", "tag36h11"));
    bool memory = read_tags(board, doc, sam_doc_need(doc, node, "tags"));
    struct tag_family family;
    if (!sam_doc_fine(doc) || !memory)
        return memory;
    if (!sam_tag_family(&family, board->family)) {
        sam_doc_wrong(doc, node, "family: the AprilTag library has no '%s'", board->family);
        return true;
    }
    for (int i = 0; i < board->tags; i++)
        if (board->tag[i].id >= family.tags)
            sam_doc_wrong(doc, node, "tags: %s has no id %d, its last is %d", board->family,
                          board->tag[i].id, family.tags - 1);
    // As the library prints them: families with bits beyond the border need room for these.
    double bits = family.total > family.border ? 0.5 * (family.total - family.border) : 1;
    double bit = board->tags ? board->tag[0].size / family.border : 1;
    board->margin = sam_doc_number(doc, node, "margin", bits * bit, 0, 1e6);
    if (board->margin < bits * bit && dark_beyond(&family))
        sam_doc_wrong(doc, node, "margin: bits of %s reach %g mm beyond its square", board->family,
                      bits * bit);
    sam_tag_family_free(&family);
    return true;
}

// ---- patches

/** Corners of the patch's top, turned about z on the board. */
static void read_patch(struct scene_patch *patch, struct doc *doc, doc_node node)
{
    double size[2] = {40, 40};
    sam_doc_numbers(doc, node, "size", size, 2, true, 1e-3, 1e6);
    patch->thickness = sam_doc_number(doc, node, "thickness", 2, 1e-3, 1e3);
    patch->patch.albedo = sam_doc_number(doc, node, "albedo", 0.99, 0, 1);
    double turn = sam_doc_number(doc, node, "turn_deg", 0, -360, 360) * DEG;
    sam_doc_need(doc, node, "center");
    double center[2] = {0, 0};
    sam_doc_numbers(doc, node, "center", center, 2, false, -1e6, 1e6);
    for (int k = 0; k < 4; k++) {
        double x = (k == 1 || k == 2 ? 0.5 : -0.5) * size[0], y = (k >= 2 ? 0.5 : -0.5) * size[1];
        patch->patch.corner[k] =
            (vec3){center[0] + x * cos(turn) - y * sin(turn),
                   center[1] + x * sin(turn) + y * cos(turn), patch->thickness};
    }
}

bool sam_read_patches(struct scene *scene, struct doc *doc, doc_node node)
{
    int count = sam_doc_is_list(doc, node) ? sam_doc_count(doc, node) : node ? 1 : 0;
    if (count > PATCHES_MAX) {
        sam_doc_wrong(doc, node, "patch: at most %d", PATCHES_MAX);
        count = 0;
    }
    scene->patch = calloc((size_t)count + 1, sizeof *scene->patch);
    if (!scene->patch)
        return false;
    scene->patches = count;
    for (int i = 0; i < count; i++)
        read_patch(&scene->patch[i], doc,
                   sam_doc_is_list(doc, node) ? sam_doc_item(doc, node, i) : node);
    return true;
}
