/* pattern.c -- the printed patterns of AprilTag's families, from the library's own code tables. */
#include "pattern.h"

#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

#include <string.h>

#define FAMILY_LIST(X)                                                                             \
    X(tag36h11)                                                                                    \
    X(tag25h9)                                                                                     \
    X(tag16h5)                                                                                     \
    X(tag36h10)                                                                                    \
    X(tagStandard41h12)                                                                            \
    X(tagStandard52h13)                                                                            \
    X(tagCircle21h7)                                                                               \
    X(tagCircle49h12)                                                                              \
    X(tagCustom48h12)

#define FAMILY_ROW(name) {#name, name##_create, name##_destroy},
static const struct {
    const char *name;
    apriltag_family_t *(*create)(void);
    void (*destroy)(apriltag_family_t *);
} families[] = {FAMILY_LIST(FAMILY_ROW)};
enum { FAMILIES = sizeof families / sizeof *families };

#define FAMILY_NAME(name) " " #name

enum status pattern_open(struct tag_family *family, const char *name, struct error *err)
{
    for (int i = 0; i < FAMILIES; i++)
        if (strcmp(name, families[i].name) == 0) {
            apriltag_family_t *tags = families[i].create();
            if (!tags)
                return cap_fail(err, STATUS_MEMORY, "%s: tag family", name);
            *family = (struct tag_family){tags, families[i].destroy};
            return STATUS_OK;
        }
    return cap_fail(err, STATUS_DATA,
                    "no tag family is called '%s'; known are" FAMILY_LIST(FAMILY_NAME), name);
}

void pattern_close(struct tag_family *family)
{
    if (family->tags)
        family->destroy(family->tags);
    *family = (struct tag_family){0};
}

// The cells on the border of the square from `low` to `high`.
static void ring(struct tag_pattern *pattern, int low, int high, enum cell cell)
{
    for (int y = 0; y < pattern->width; y++)
        for (int x = 0; x < pattern->width; x++) {
            bool inside = y >= low && y <= high && x >= low && x <= high;
            if (inside && (y == low || y == high || x == low || x == high))
                pattern->cell[y][x] = (unsigned char)cell;
        }
}

enum status pattern_of(struct tag_pattern *pattern, const struct tag_family *family, int id,
                       struct error *err)
{
    const apriltag_family_t *f = family->tags;
    if (id < 0 || (uint32_t)id >= f->ncodes)
        return cap_fail(err, STATUS_DATA, "there is no tag %d: %s ends with %u", id, f->name,
                        f->ncodes - 1);
    struct tag_pattern p = {.width = f->total_width,
                            .begin = (f->total_width - f->width_at_border) / 2,
                            .side = f->width_at_border};
    if (p.width > PATTERN_MAX || p.begin < 1 || p.side < 1 || p.begin + p.side >= p.width)
        return cap_fail(err, STATUS_DATA, "%s: a pattern of %d cells is not supported", f->name,
                        p.width);
    memset(p.cell, CELL_UNKNOWN, sizeof p.cell);
    int end = p.begin + p.side;
    ring(&p, p.begin, end - 1, f->reversed_border ? CELL_WHITE : CELL_BLACK);
    ring(&p, p.begin - 1, end, f->reversed_border ? CELL_BLACK : CELL_WHITE);
    for (uint32_t i = 0; i < f->nbits; i++) {  // the first bit is the highest
        bool white = f->codes[id] >> (f->nbits - 1 - i) & 1;
        int row = (int)f->bit_y[i] + p.begin, column = (int)f->bit_x[i] + p.begin;
        p.cell[row][column] = white ? CELL_WHITE : CELL_BLACK;
    }
    *pattern = p;
    return STATUS_OK;
}
