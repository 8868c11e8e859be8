/* detect.c -- tags in a radiance map.
 *
 * Method.   The AprilTag library searches an 8-bit image that is linear in radiance (its corners
 *           are half as far off as on a gamma-encoded one: an edge's 50 % level stays where the
 *           edge is). The search is decimated, the edges are refined at full resolution. Where it
 *           finds less than half of the board, it looks again at full resolution, and again four
 *           times brighter for light that grazes the board. Tags missed by all of these are found
 *           later from the pose (corners.h), so speed comes first here.
 * Accuracy. 0.1 to 0.2 pixels a corner: a start for corners.h.
 */
#include "detect.h"

#include <stdlib.h>
#include <string.h>

enum status detector_begin(struct detector *d, const char *family, struct error *err)
{
    struct detector made = {0};
    enum status status = pattern_open(&made.family, family, err);
    if (status)
        return status;
    made.detector = apriltag_detector_create();
    if (!made.detector) {
        pattern_close(&made.family);
        return cap_fail(err, STATUS_MEMORY, "tag detector");
    }
    made.detector->nthreads = 1;
    made.detector->refine_edges = true;
    // One wrong bit is forgiven; two make false tags likely in the small families.
    apriltag_detector_add_family_bits(made.detector, made.family.tags, 1);
    *d = made;
    return STATUS_OK;
}

void detector_end(struct detector *d)
{
    if (d->detector)
        apriltag_detector_destroy(d->detector);
    pattern_close(&d->family);
    *d = (struct detector){0};
}

static float grey(const float rgb[3])
{
    return (rgb[0] + rgb[1] + rgb[2]) / 3;
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

// The radiance that 5 % of the pixels exceed: the board's white, as a rule; highlights, lamps and
// a reference patch are fewer pixels, and may be clipped. From every 7th pixel of every 7th row.
static float bright_level(const struct radiance *map)
{
    enum { STRIDE = 7 };
    size_t room = (size_t)(map->width / STRIDE + 1) * (size_t)(map->height / STRIDE + 1), n = 0;
    float *level = malloc(room * sizeof *level);
    if (!level)
        return 0;
    for (int y = 0; y < map->height; y += STRIDE)
        for (int x = 0; x < map->width; x += STRIDE) {
            float v = grey(map->value + 3 * ((size_t)y * (size_t)map->width + (size_t)x));
            if (isfinite(v))
                level[n++] = v;
        }
    qsort(level, n, sizeof *level, compare_floats);
    float bright = n ? level[n - 1 - n / 20] : 0;
    free(level);
    return bright;
}

static image_u8_t *eight_bits(const struct radiance *map, float white)
{
    image_u8_t *image = image_u8_create((unsigned)map->width, (unsigned)map->height);
    if (!image)
        return NULL;
    for (int y = 0; y < map->height; y++)
        for (int x = 0; x < map->width; x++) {
            float v = grey(map->value + 3 * ((size_t)y * (size_t)map->width + (size_t)x));
            float scaled = 255 * v / white + 0.5f;
            uint8_t level = 0;  // also of NaN
            if (scaled >= 1)
                level = scaled < 255 ? (uint8_t)scaled : 255;
            image->buf[(size_t)y * (size_t)image->stride + (size_t)x] = level;
        }
    return image;
}

// Keep a detection if capture names its tag and no better one of the same tag is there.
static void keep(const struct capture *capture, const apriltag_detection_t *a,
                 struct detection *found, int *count)
{
    for (int place = 0; place < capture->tags; place++) {
        if (capture->tag[place].id != a->id)
            continue;
        struct detection new = {.place = place, .margin = a->decision_margin};
        for (int k = 0; k < 4; k++)
            for (int i = 0; i < 2; i++)
                new.corner[k][i] = a->p[k][i] - 0.5;  // AprilTag counts from the pixel's corner
        int at = 0;
        while (at < *count && found[at].place != place)
            at++;
        if (at == *count)
            (*count)++;
        else if (found[at].margin >= new.margin)
            return;
        found[at] = new;
    }
}

static bool search(struct detector *d, const struct capture *capture, const struct radiance *map,
                   float white, float decimate, struct detection *found, int *count)
{
    image_u8_t *image = eight_bits(map, white);
    if (!image)
        return false;
    d->detector->quad_decimate = decimate;
    zarray_t *all = apriltag_detector_detect(d->detector, image);
    for (int i = 0; i < zarray_size(all); i++) {
        apriltag_detection_t *a;
        zarray_get(all, i, &a);
        keep(capture, a, found, count);
    }
    apriltag_detections_destroy(all);
    image_u8_destroy(image);
    return true;
}

static int by_place(const void *a, const void *b)
{
    return ((const struct detection *)a)->place - ((const struct detection *)b)->place;
}

enum status detector_find(struct detector *d, const struct capture *capture,
                          const struct radiance *map, struct detection *found, int *count,
                          struct error *err)
{
    *count = 0;
    float white = bright_level(map);
    if (!(white > 0))
        return STATUS_OK;  // a black image holds no tags
    const struct {
        float white, decimate;
    } pass[] = {{white, 2}, {white, 1}, {white / 4, 1}};
    for (int i = 0; i < 3 && *count < (capture->tags + 1) / 2; i++)
        if (!search(d, capture, map, pass[i].white, pass[i].decimate, found, count))
            return cap_fail(err, STATUS_MEMORY, "%d x %d pixels", map->width, map->height);
    qsort(found, (size_t)*count, sizeof *found, by_place);
    return STATUS_OK;
}
