/* tags.c -- the bit patterns of the AprilTag library's families, as the library prints them. */
#include "tags.h"

#include <assert.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

static const struct known_family {
    const char *name;
    apriltag_family_t *(*create)(void);
    void (*destroy)(apriltag_family_t *);
} known[] = {
    {"tag36h11", tag36h11_create, tag36h11_destroy},
    {"tag36h10", tag36h10_create, tag36h10_destroy},
    {"tag25h9", tag25h9_create, tag25h9_destroy},
    {"tag16h5", tag16h5_create, tag16h5_destroy},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    {"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy},
    {"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy},
    {"tagCircle49h12", tagCircle49h12_create, tagCircle49h12_destroy},
    {"tagCustom48h12", tagCustom48h12_create, tagCustom48h12_destroy},
};

/** All patterns of a family, by the library's own drawing of each. */
static bool draw(struct tag_family *out, apriltag_family_t *family)
{
    size_t side = (size_t)family->total_width, cells = side * side;
    bool *bit = malloc(family->ncodes * cells * sizeof *bit);
    if (!bit)
        return false;
    for (uint32_t id = 0; id < family->ncodes; id++) {
        image_u8_t *image = apriltag_to_image(family, id);
        for (size_t i = 0; i < cells; i++)
            bit[id * cells + i] = image->buf[i / side * (size_t)image->stride + i % side] > 127;
        image_u8_destroy(image);
    }
    *out = (struct tag_family){.tags = (int)family->ncodes,
                               .border = family->width_at_border,
                               .total = family->total_width,
                               .bit = bit};
    return true;
}

bool sam_tag_family(struct tag_family *family, const char *name)
{
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strcmp(known[i].name, name) == 0) {
            apriltag_family_t *library = known[i].create();
            bool done = library && draw(family, library);
            if (library)
                known[i].destroy(library);
            return done;
        }
    return false;
}

void sam_tag_family_free(struct tag_family *family)
{
    free(family->bit);
    *family = (struct tag_family){0};
}

bool sam_tag_white(const struct tag_family *family, int id, double x, double y)
{
    assert(id >= 0 && id < family->tags);
    double half = 0.5 * family->total;
    int column = (int)floor(x + half), row = (int)floor(half - y);
    if (column < 0 || row < 0 || column >= family->total || row >= family->total)
        return true;
    return family->bit[(id * family->total + row) * family->total + column];
}
