/* detect.c -- tags in a radiance map.
 *
 * Method.   The AprilTag library searches an 8-bit image that is linear in radiance (its corners
 *           are half as far off as on a gamma-encoded one: an edge's 50 % level stays where the
 *           edge is). A large image is reduced first. The search is decimated, the edges are
 *           refined at full resolution of what is searched. Where it finds less than half of the
 *           board, it looks again at more of the resolution, again four times brighter for light
 *           that grazes the board, and in an encoded image for tags in shadow or of few pixels.
 *           Tags missed by all of these are found later from the pose (corners.h), so speed comes
 *           first here.
 * Accuracy. 0.1 to 0.3 pixels a corner, of the reduced image where it was enough: a start for
 *           corners.h.
 */
#include "detect.h"

#include <stdlib.h>
#include <string.h>

// How many wrong bits of a tag are forgiven: two; one in the small families, where more would make
// false tags, and in the largest, where a table of all that two wrong bits make is gigabytes.
static int bits_forgiven(const apriltag_family_t *family)
{
    const double most = 4e6;  // entries of that table: 0.2 GB
    double bits = family->nbits, entries = family->ncodes * (1 + bits + bits * (bits - 1) / 2);
    return family->h >= 10 && entries <= most ? 2 : 1;
}

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
    apriltag_detector_add_family_bits(made.detector, made.family.tags,
                                      bits_forgiven(made.family.tags));
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
// a reference patch are fewer pixels, and may be clipped. From every 7th pixel of every 7th row, in
// a large image from fewer: some 30000 pixels tell.
static float bright_level(const struct radiance *map)
{
    enum { STRIDE = 7, ENOUGH = 30000 };
    const double pixels = (double)map->width * map->height;
    const int fewer = (int)sqrt(pixels / ENOUGH), stride = fewer > STRIDE ? fewer : STRIDE;
    size_t room = (size_t)(map->width / stride + 1) * (size_t)(map->height / stride + 1), n = 0;
    float *level = malloc(room * sizeof *level);
    if (!level)
        return 0;
    for (int y = 0; y < map->height; y += stride)
        for (int x = 0; x < map->width; x += stride) {
            float rgb[3];
            cap_radiance_at(map, x, y, rgb, NULL);
            float v = grey(rgb);
            if (isfinite(v))
                level[n++] = v;
        }
    qsort(level, n, sizeof *level, compare_floats);
    float bright = n ? level[n - 1 - n / 20] : 0;
    free(level);
    return bright;
}

// sRGB's curve: what stands in shadow keeps as many levels as what stands in light.
static float encode(float part)
{
    return part <= 0.0031308f ? 12.92f * part : 1.055f * powf(part, 1 / 2.4f) - 0.055f;
}

// Linear in radiance, or encoded as for a display.
static uint8_t eight_bit(float part, bool encoded)
{
    float scaled = 255 * (encoded ? encode(part) : part) + 0.5f;
    return scaled >= 1 ? scaled < 255 ? (uint8_t)scaled : 255 : 0;  // NaN is 0, too
}

// The map, or the middle rows of blocks of reduce x reduce pixels (reduce is odd).
static image_u8_t *eight_bits(const struct radiance *map, float white, bool encoded, int reduce)
{
    int width = map->width / reduce, height = map->height / reduce;
    image_u8_t *image = image_u8_create((unsigned)width, (unsigned)height);
    float *row = malloc(3 * (size_t)map->width * sizeof *row);
    for (int y = 0; image && row && y < height; y++) {
        uint8_t *to = image->buf + (size_t)y * (size_t)image->stride;
        cap_radiance_row(map, y * reduce + reduce / 2, 0, map->width, row, NULL);
        for (int x = 0; x < width; x++) {
            float sum = 0;
            for (int i = 0; i < reduce; i++)
                sum += grey(row + 3 * (x * reduce + i));
            to[x] = eight_bit(sum / (white * (float)reduce), encoded);
        }
    }
    if (image && !row)
        image_u8_destroy(image);
    image = row ? image : NULL;
    free(row);
    return image;
}

// A tag of any id.
struct sight {
    int id;
    double corner[4][2], margin;
    bool refined;
};
struct sights {
    struct sight *sight;
    int count;
};

// The same printed tag, seen in two passes: they differ by pixels, where neighbours, which may meet
// in a corner, differ by most of their size.
static bool same_tag(const struct sight *a, const struct sight *b, double *farthest)
{
    double apart = 0, side = 0;
    for (int k = 0; k < 4; k++) {
        const double *p = a->corner[k], *q = b->corner[k], *next = a->corner[(k + 1) % 4];
        apart = fmax(apart, hypot(p[0] - q[0], p[1] - q[1]));
        side = fmax(side, hypot(p[0] - next[0], p[1] - next[1]));
    }
    *farthest = apart;
    return a->id == b->id && apart < fmax(3, 0.3 * side);
}

// Keep a detection in a reduced image; of one that is there already (from another pass), the better
// one: refined edges may have snapped to what is beside the tag.
static bool keep(struct sights *sights, const apriltag_detection_t *a, int reduce, bool refined)
{
    static const double snapped_px = 3;
    double apart;
    struct sight new = {.id = a->id, .margin = a->decision_margin, .refined = refined};
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 2; i++)
            new.corner[k][i] =
                reduce * a->p[k][i] - 0.5;  // AprilTag counts from the pixel's corner
    for (int i = 0; i < sights->count; i++) {
        struct sight *old = sights->sight + i;
        if (!same_tag(old, &new, &apart))
            continue;
        if (old->refined == refined ? old->margin < new.margin : refined != (apart > snapped_px))
            *old = new;
        return true;
    }
    struct sight *grown =
        realloc(sights->sight, (size_t)(sights->count + 1) * sizeof *sights->sight);
    if (!grown)
        return false;
    sights->sight = grown;
    sights->sight[sights->count++] = new;
    return true;
}

static bool search(struct detector *d, const struct radiance *map, float white, bool encoded,
                   float decimate, int reduce, struct sights *sights)
{
    image_u8_t *image = eight_bits(map, white, encoded, reduce);
    if (!image)
        return false;
    bool kept = true;
    d->detector->quad_decimate = decimate;
    // Encoded images are for tags that are hard to see; refinement would lose a few of them.
    d->detector->refine_edges = !encoded;
    zarray_t *all = apriltag_detector_detect(d->detector, image);
    for (int i = 0; i < zarray_size(all) && kept; i++) {
        apriltag_detection_t *a;
        zarray_get(all, i, &a);
        kept = keep(sights, a, reduce, !encoded);
    }
    apriltag_detections_destroy(all);
    image_u8_destroy(image);
    return kept;
}

static bool is_named(const struct capture *capture, int id)
{
    for (int place = 0; place < capture->tags; place++)
        if (capture->tag[place].id == id)
            return true;
    return false;
}

// The tags of a capture among what is in sight, the surest of each id; -> how many. found has room
// for all in sight.
static int choose(const struct sights *sights, const struct capture *capture,
                  struct detection *found)
{
    int count = 0;
    for (int i = 0; i < sights->count; i++) {
        const struct sight *s = sights->sight + i;
        struct detection *d = found;
        if (!(capture->tag_size > 0) && !is_named(capture, s->id))
            continue;
        while (d < found + count && d->id != s->id)
            d++;
        bool again = d < found + count;
        if (!again)
            found[count++] = (struct detection){.id = s->id, .margin = -1};
        d->twice = again;
        if (s->margin > d->margin) {
            d->margin = s->margin;
            memcpy(d->corner, s->corner, sizeof d->corner);
        }
    }
    return count;
}

static int compare_ids(const void *a, const void *b)
{
    return ((const struct detection *)a)->id - ((const struct detection *)b)->id;
}

// By how much an image is reduced to some 2000 pixels: an odd number, so that blocks have a middle.
static int reduction(const struct radiance *map)
{
    enum { LONGEST = 1500 };
    int n = (map->width > map->height ? map->width : map->height) / LONGEST;
    return n < 3 ? 1 : n - 1 + n % 2;
}

// The passes over a map whose bright level is white, the fastest first.
enum { PASSES = 5 };
static bool pass(struct detector *d, const struct radiance *map, float white, int i,
                 struct sights *sights)
{
    static const struct {
        float white, decimate;
        bool encoded, reduced;
    } table[PASSES] = {{1, 2, false, true},
                       {1, 2, false, false},
                       {1, 1, false, false},
                       {0.25f, 1, false, false},
                       {2, 1, true, false}};
    int reduce = table[i].reduced ? reduction(map) : 1;
    if (table[i].reduced && reduce == 1)
        return true;  // the next pass is the same
    return search(d, map, table[i].white * white, table[i].encoded, table[i].decimate, reduce,
                  sights);
}

// Enough of the board is found for the rest to follow from the pose; of a board that is not known,
// full resolution tells what is there.
static bool enough(const struct capture *capture, int count, int passes)
{
    if (capture->tag_size > 0)
        return passes >= 3 && count > 0;
    return passes > 0 && count >= (capture->tags + 1) / 2;
}

enum status detector_find(struct detector *d, const struct capture *capture,
                          const struct radiance *map, struct detection **found, int *count,
                          struct error *err)
{
    struct sights sights = {0};
    struct detection *chosen = NULL;
    float white = bright_level(map);
    bool done = true;
    int n = 0;
    for (int i = 0; i < PASSES && done && white > 0 && !enough(capture, n, i); i++) {
        done = pass(d, map, white, i, &sights);
        struct detection *grown = realloc(chosen, (size_t)(sights.count + 1) * sizeof *grown);
        done = done && grown;
        chosen = grown ? grown : chosen;
        n = done ? choose(&sights, capture, chosen) : 0;
    }
    free(sights.sight);
    if (!done) {
        free(chosen);
        return cap_fail(err, STATUS_MEMORY, "%d x %d pixels", map->width, map->height);
    }
    if (n > 0)
        qsort(chosen, (size_t)n, sizeof *chosen, compare_ids);
    *found = chosen;
    *count = n;
    return STATUS_OK;
}

enum status detector_all(struct detector *d, const struct radiance *map, int id,
                         double (*corner)[4][2], int room, int *count, struct error *err)
{
    struct sights sights = {0};
    float white = bright_level(map);
    bool done = true;
    *count = 0;
    for (int i = 0; i < PASSES && done && white > 0; i++)
        done = pass(d, map, white, i, &sights);
    for (int i = 0; i < sights.count && *count < room; i++)
        if (sights.sight[i].id == id)
            memcpy(corner[(*count)++], sights.sight[i].corner, sizeof *corner);
    free(sights.sight);
    return done ? STATUS_OK
                : cap_fail(err, STATUS_MEMORY, "%d x %d pixels", map->width, map->height);
}
