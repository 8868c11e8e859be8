/* init.c -- what photographs tell without anybody's help: their shots, and where the tags are.
 *
 * Method.   Shots are merged as ever, but only some of them: two dozen place a board as well as
 *           hundreds. Tags are laid out from the size of one (layout.c, by way of cal_geometry).
 */
#include "init.h"

#include "detect.h"

#include <stdlib.h>
#include <string.h>

enum { SHOTS_ENOUGH = 24 };

void init_free(struct init_finding *finding)
{
    cap_capture_free(&finding->capture);
    cal_calibration_free(&finding->found);
    *finding = (struct init_finding){0};
}

/* ---- the family ------------------------------------------------------------------------------ */

// Tags of few bits are also seen where there are none: true ones are decoded by such a margin.
static const double TRUE_MARGIN = 30;

static enum status count_tags(int *count, const char *family, struct capture *capture,
                              const struct radiance *map, struct error *err)
{
    struct detector d = {0};
    struct detection *found = NULL;
    int all = 0;
    enum status status = detector_begin(&d, family, err);
    if (!status)
        status = detector_find(&d, capture, map, &found, &all, err);
    *count = 0;
    for (int i = 0; i < all && !status; i++)
        *count += found[i].margin > TRUE_MARGIN;
    free(found);
    detector_end(&d);
    return status;
}

// The first family of which a map shows tags enough, or else the one of which it shows most. The
// last ones are rare, and AprilTag's tables for them take seconds.
static enum status find_family(char family[32], struct capture *capture, const struct radiance *map,
                               struct error *err)
{
    static const char *const families[] = {"tag36h11",       "tag25h9",         "tagStandard41h12",
                                           "tagCircle21h7",  "tag16h5",         "tagCircle49h12",
                                           "tagCustom48h12", "tagStandard52h13"};
    const int enough = 4;
    int most = 0;
    enum status status = STATUS_OK;
    for (size_t k = 0; k < sizeof families / sizeof *families && !status && most < enough; k++) {
        int count;
        status = count_tags(&count, families[k], capture, map, err);
        if (!status && count > most) {
            most = count;
            snprintf(family, 32, "%s", families[k]);
        }
    }
    return status;
}

static enum status find_family_in(char family[32], struct capture *capture, const bool *usable,
                                  const char *scratch, struct error *err)
{
    enum status status = STATUS_OK;
    *family = '\0';
    for (int k = 0; k < capture->shots && !*family && !status; k++) {
        char name[512];
        struct radiance map = {0};
        if (!usable[k])
            continue;
        snprintf(name, sizeof name, "%s/radiance/%s.exr", scratch, capture->shot[k].name);
        status = cap_radiance_read(&map, name, err);
        if (!status)
            status = find_family(family, capture, &map, err);
        cap_radiance_free(&map);
    }
    if (!status && !*family)
        status = cap_fail(err, STATUS_DATA,
                          "%s: no tags are found in the photographs: print a board (`goniocam "
                          "board`), and let it fill a good part of each picture",
                          capture->folder);
    return status;
}

/* ---- the board's frame ----------------------------------------------------------------------- */

/** p_board = (x, y, z) . (p - origin). */
struct frame {
    vec3 origin, x, y, z;
};

static struct frame frame_of(const struct calibration *c)
{
    struct frame f = {0};
    const struct board_tag *first = c->tag;
    for (int i = 0; i < c->tags; i++) {
        const struct tag_place *p = &c->tag[i].place;
        f.origin = vec3_add(f.origin, vec3_scale(p->center, 1.0 / c->tags));
        f.z = vec3_add(f.z, vec3_cross(p->x_axis, p->y_axis));
        first = c->tag[i].place.id < first->place.id ? &c->tag[i] : first;
    }
    vec3 normal = vec3_cross(first->place.x_axis, first->place.y_axis);
    f.z = vec3_length(f.z) > 1e-3 ? vec3_normalize(f.z) : normal;
    // Where the first tag stands upright on the others' plane, its right may be their normal.
    vec3 right = first->place.x_axis, up = first->place.y_axis;
    right = fabs(vec3_dot(right, f.z)) < 0.9 ? right : up;
    f.x = vec3_normalize(vec3_sub(right, vec3_scale(f.z, vec3_dot(right, f.z))));
    f.y = vec3_cross(f.z, f.x);
    return f;
}

static vec3 turned(const struct frame *f, vec3 v)
{
    return (vec3){vec3_dot(f->x, v), vec3_dot(f->y, v), vec3_dot(f->z, v)};
}

// Only the tags: nobody looks at the poses after this.
static void move_tags(struct calibration *c)
{
    struct frame f = frame_of(c);
    for (int i = 0; i < c->tags; i++) {
        struct tag_place *p = &c->tag[i].place;
        p->center = turned(&f, vec3_sub(p->center, f.origin));
        p->x_axis = turned(&f, p->x_axis);
        p->y_axis = turned(&f, p->y_axis);
    }
}

/* ---- all of it ------------------------------------------------------------------------------- */

static enum status find_board(struct init_finding *to, struct capture *some, const char *family,
                              double size, const char *scratch, struct run *run, struct error *err)
{
    bool *usable = calloc((size_t)some->shots + 1, sizeof *usable);
    enum status status =
        usable ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for %d shots", some->shots);
    some->tag_size = size;
    if (!status)
        status = cap_merge(some, scratch, NULL, usable, run, err);
    if (!status && family)
        snprintf(to->family, sizeof to->family, "%s", family);
    else if (!status)
        status = find_family_in(to->family, some, usable, scratch, err);
    if (!status && !(some->family = strdup(to->family)))
        status = cap_fail(err, STATUS_MEMORY, "no memory for a name");
    if (!status)
        status = cal_geometry(&to->found, some, scratch, usable, run, err);
    if (!status)
        move_tags(&to->found);
    free(usable);
    return status;
}

enum status init_find(struct init_finding *finding, const char *photos, const char *family,
                      double size, const char *scratch, struct run *run, struct error *err)
{
    struct init_finding made = {0};
    struct capture some = {0};
    enum status status = cap_capture_of_photos(&made.capture, photos, run, err);
    if (!status)
        status = cap_capture_of_photos(&some, photos, run, err);
    if (!status) {
        cap_capture_thin(&some, SHOTS_ENOUGH);
        status = find_board(&made, &some, family, size, scratch, run, err);
    }
    cap_capture_free(&some);
    if (status) {
        init_free(&made);
        return status;
    }
    *finding = made;
    return STATUS_OK;
}
