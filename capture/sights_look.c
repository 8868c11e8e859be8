/* sights_look.c -- bands of rows of a photograph, and which of its photosites stand out.
 *
 * What a photosite is compared with are its 8 nearest neighbours of the same channel, whatever the
 * mosaic. Values of the same place in the cell of filters stand beside each other, so that their
 * neighbours do too: 8 or 16 go through together, free of branches.
 */
#include "sights_look.h"
#include "photo.h"

#include <stdlib.h>
#include <string.h>

static const double ODD_SIGMAS = 2.5, SMOOTH_SIGMAS = 4, LIT_SIGMAS = 10;
static const double DIM_PART = 0.1;      // of the scale
static const double UNEQUAL = 0.01;      // relative: no reason by itself to stand out
static const double NOISE_MAX = 0.02;    // relative, of photosites that tell how unequal they are
static const double RESIDUAL_MAX = 0.1;  // relative; beyond is a defect, or an edge

static int channel_at(const struct look *l, int x, int y, int c)
{
    return l->channels == 3 ? c : cap_cfa_channel(l->cfa, x, y);
}

int look_channel(const struct look *look, int y, int place)
{
    return channel_at(look, place / look->channels, y, place % look->channels);
}

size_t look_line(const struct look *look)
{
    return (size_t)look->places * (size_t)look->plane;
}

/* The nearest in growing squares, in the order of rows: ties have an order of their own. */
static void find_nearest(struct look *l)
{
    const int side = l->side, far = 2 * side;
    for (int k = 0; k < side * l->places; k++) {
        const int y = k / l->places, x = k / l->channels % side, c = k % l->channels;
        const int own = channel_at(l, x, y, c);
        int found = 0;
        for (int d2 = 1; found < LOOK_NEAR && d2 <= 2 * far * far; d2++)
            for (int v = -far; v <= far; v++)
                for (int u = -far; u <= far && found < LOOK_NEAR; u++) {
                    if (u * u + v * v != d2
                        || channel_at(l, x + u + 8 * side, y + v + 8 * side, c) != own)
                        continue;
                    l->near[k].along[found] = u * l->channels;
                    l->near[k].rows[found++] = v;
                    l->reach = abs(v) > l->reach ? abs(v) : l->reach;
                    l->reach = abs(u) > l->reach ? abs(u) : l->reach;
                }
    }
}

struct look look_for(const struct photo *photo, const struct sensor *sensor)
{
    struct look look = {.sensor = sensor,
                        .width = photo->width,
                        .height = photo->height,
                        .channels = photo->channels,
                        .count = photo->width * photo->channels,
                        .side = photo->channels == 3 ? 1 : cap_cfa_side(photo->cfa)};
    memcpy(look.cfa, photo->cfa, sizeof look.cfa);
    look.places = look.side * look.channels;
    look.plane = (look.count + look.places - 1) / look.places;
    find_nearest(&look);
    return look;
}

bool view_make(struct view *view, const struct look *look)
{
    const size_t line = look_line(look), rows = LOOK_BAND + 2 * (size_t)look->reach;
    view->row = malloc((size_t)look->count * sizeof *view->row);
    view->dn = calloc(rows * line, sizeof *view->dn);  // also where a place has a value less
    view->flags = malloc(LOOK_BAND * line);
    view->residual = malloc(LOOK_BAND * line * sizeof *view->residual);
    view->coarse = malloc(LOOK_BAND * line * sizeof *view->coarse);
    return view->row && view->dn && view->flags && view->residual && view->coarse;
}

void view_free(struct view *view)
{
    photo_close(view->file);
    free(view->row);
    free(view->dn);
    free(view->flags);
    free(view->residual);
    free(view->coarse);
    *view = (struct view){0};
}

/* A row's values to their places. */
WIDE static void sort_row(float *restrict dn, const float *restrict row, const struct look *l)
{
    const int places = l->places;
    for (int p = 0; p < places; p++) {
        const int count = (l->count - p + places - 1) / places;
        float *restrict to = dn + (size_t)p * (size_t)l->plane;
        if (places == 2)
            for (int i = 0; i < count; i++)
                to[i] = row[2 * i + p];
        else
            for (int i = 0; i < count; i++)
                to[i] = row[places * i + p];
    }
}

bool view_fill(struct view *v, const struct look *look, int top, int rows)
{
    const int reach = look->reach;
    const int first = top > reach ? top - reach : 0;
    const int end = top + rows + reach < look->height ? top + rows + reach : look->height;
    const size_t line = look_line(look);
    enum status status = STATUS_OK;
    if (v->end > first)
        memmove(v->dn, v->dn + (size_t)(first - v->first) * line,
                (size_t)(v->end - first) * line * sizeof *v->dn);
    else
        status = photo_skip(v->file, first - v->end, NULL);
    for (int y = v->end > first ? v->end : first; y < end && !status; y++) {
        status = photo_read(v->file, v->row, 1, NULL);
        if (!status)
            sort_row(v->dn + (size_t)(y - first) * line, v->row, look);
    }
    v->first = first;
    v->end = end;
    return !status;
}

const float *view_row(const struct view *view, const struct look *look, int y)
{
    return view->dn + (size_t)(y - view->first) * look_line(look);
}

/* What the values of a place are compared by. */
struct scale {
    float black, full, read2, slope;
};

static struct scale scale_of(const struct look *l, int y, int place)
{
    const struct sensor *sensor = l->sensor;
    const int c = look_channel(l, y, place);
    return (struct scale){(float)sensor->black[c], (float)(sensor->usable[c] - sensor->black[c]),
                          (float)(sensor->read_noise[c] * sensor->read_noise[c]),
                          (float)(1 / sensor->gain[c])};
}

/* `count` values and their neighbours; residual may be NULL. */
static inline __attribute__((always_inline)) void look_at(unsigned char *restrict flags,
                                                          float *restrict residual, const float *at,
                                                          const float *const near[LOOK_NEAR],
                                                          struct scale scale, int count)
{
    const float *n0 = near[0], *n1 = near[1], *n2 = near[2], *n3 = near[3];
    const float *n4 = near[4], *n5 = near[5], *n6 = near[6], *n7 = near[7];
    const float odd2 = (float)(ODD_SIGMAS * ODD_SIGMAS), lit2 = (float)(LIT_SIGMAS * LIT_SIGMAS);
    const float smooth2 = (float)(SMOOTH_SIGMAS * SMOOTH_SIGMAS);
    const float unequal2 = (float)(UNEQUAL * UNEQUAL), noise2 = (float)(NOISE_MAX * NOISE_MAX);
    const float dim_below = (float)DIM_PART * scale.full, far = (float)RESIDUAL_MAX;
#define LOW(a, b)  ((a) < (b) ? (a) : (b))
#define HIGH(a, b) ((a) > (b) ? (a) : (b))
    for (int i = 0; i < count; i++) {
        const float a = n0[i], b = n1[i], c = n2[i], d = n3[i];
        const float e = n4[i], f = n5[i], g = n6[i], h = n7[i];
        const float lowest = LOW(LOW(LOW(a, b), LOW(c, d)), LOW(LOW(e, f), LOW(g, h)));
        const float highest = HIGH(HIGH(HIGH(a, b), HIGH(c, d)), HIGH(HIGH(e, f), HIGH(g, h)));
        const float sum = ((a + b) + (c + d)) + ((e + f) + (g + h));
        const float low = lowest - scale.black, high = highest - scale.black;
        const float x = at[i] - scale.black, mean = sum * (1.0f / LOOK_NEAR) - scale.black;
        const float photons = scale.read2 + scale.slope * HIGH(mean, 0);
        const float noise = photons + unequal2 * mean * mean;
        const float off = HIGH(x - high, low - x);
        const int dim = mean < dim_below ? LOOK_DIM : 0;
        const int lit = ((low > 0) & (low * low > lit2 * photons)) ? LOOK_LIT : 0;
        const int odd = ((off > 0) & (off * off > odd2 * noise)) ? LOOK_ODD : 0;
        const int bright = odd && x > high ? LOOK_BRIGHT : 0;
        const int seen = high < scale.full ? LOOK_TESTED | dim | lit | odd | bright : 0;
        flags[i] = (unsigned char)seen;
        if (residual) {
            const float spread = high - low;
            const bool tells = (seen != 0) & (odd == 0) & (spread * spread < smooth2 * noise)
                               & (x < scale.full) & (mean > 0) & (photons < noise2 * mean * mean)
                               & (fabsf(x - mean) < far * mean);
            residual[i] = tells ? (x - mean) / mean : NAN;
        }
    }
#undef LOW
#undef HIGH
}

WIDE static void look_at_flags(unsigned char *flags, const float *at,
                               const float *const near[LOOK_NEAR], struct scale scale, int count)
{
    look_at(flags, NULL, at, near, scale, count);
}

WIDE static void look_at_both(unsigned char *flags, float *residual, const float *at,
                              const float *const near[LOOK_NEAR], struct scale scale, int count)
{
    look_at(flags, residual, at, near, scale, count);
}

/* Division that rounds down, and up, of whole numbers of any sign. */
static int floor_div(int a, int b)
{
    return (a >= 0 ? a : a - b + 1) / b;
}

static int ceil_div(int a, int b)
{
    return floor_div(a + b - 1, b);
}

/* The values of one place of row y, the k-th of the band. */
static void look_at_place(struct view *v, const struct look *l, int y, int k, int place,
                          bool residual)
{
    const int margin = l->reach * l->channels, places = l->places, cell = y % l->side * places;
    const int from = ceil_div(margin - place, places);
    const int end = ceil_div(l->count - margin - place, places);
    const size_t to = (size_t)k * look_line(l) + (size_t)place * (size_t)l->plane + (size_t)from;
    const float *near[LOOK_NEAR];
    for (int n = 0; n < LOOK_NEAR; n++) {
        const int x = place + l->near[cell + place].along[n], step = floor_div(x, places);
        near[n] = view_row(v, l, y + l->near[cell + place].rows[n])
                  + (ptrdiff_t)(x - step * places) * l->plane + step + from;
    }
    const float *at = view_row(v, l, y) + (size_t)place * (size_t)l->plane + from;
    if (residual)
        look_at_both(v->flags + to, v->residual + to, at, near, scale_of(l, y, place), end - from);
    else
        look_at_flags(v->flags + to, at, near, scale_of(l, y, place), end - from);
}

void view_look(struct view *view, const struct look *look, int y, int k, bool residual)
{
    const size_t line = look_line(look);
    memset(view->flags + (size_t)k * line, 0, line);
    for (size_t i = 0; i < line && residual; i++)
        view->residual[(size_t)k * line + i] = NAN;
    if (y < look->reach || y >= look->height - look->reach || look->width <= 2 * look->reach)
        return;
    for (int place = 0; place < look->places; place++)
        look_at_place(view, look, y, k, place, residual);
}

/* The light of a square: each value at most what is usable. */
static float light_of(const struct view *v, const struct look *l, int left, int top, int side)
{
    const int each = side * l->channels / l->places;
    float sum = 0;
    for (int y = top; y < top + side; y++)
        for (int p = 0; p < l->places; p++) {
            const struct scale scale = scale_of(l, y, p);
            const float *dn =
                view_row(v, l, y) + (size_t)p * (size_t)l->plane + left * l->channels / l->places;
            for (int i = 0; i < each; i++)
                sum += fminf(dn[i] - scale.black, scale.full);
        }
    return sum;
}

void view_look_coarsely(const struct view *view, const struct look *look, int y, int side,
                        float *coarse)
{
    const int columns = look->width / side;
    const double values = (double)side * side * look->channels;
    for (int x = 0; x < columns; x++)
        coarse[x] = (float)log(fmax((double)light_of(view, look, x * side, y, side) / values, 1));
    for (int x = 0; x + 2 < columns; x++)
        coarse[x] = fmaxf(fminf(coarse[x] - 2 * coarse[x + 1] + coarse[x + 2], 1), -1);
}
