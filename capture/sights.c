/* sights.c -- the same photosites in shots of different views, read side by side in bands of rows.
 *
 * What a photosite is compared with are its 8 nearest neighbours of the same channel, whatever the
 * mosaic. Bands overlap by their reach.
 */
#include "sights.h"
#include "photo.h"

#include <stdlib.h>
#include <string.h>

enum { NEAR = 8, BAND = 24, CELL = 64, THIN = 8, SAMPLES = 500000 };
enum { ODD = 1, BRIGHT = 2, TESTED = 4, DIM = 8, LIT = 16 };

static const double ODD_SIGMAS = 2.5, SMOOTH_SIGMAS = 4, LIT_SIGMAS = 10;
static const double DIM_PART = 0.1;      // of the scale
static const double UNEQUAL = 0.01;      // relative: no reason by itself to stand out
static const double NOISE_MAX = 0.02;    // relative, of photosites that tell how unequal they are
static const double RESIDUAL_MAX = 0.1;  // relative; beyond is a defect, or an edge

/* Distances from a value: along the row, in values, and in rows; by place in the cell of filters.
 */
struct nearest {
    int side, reach;  // of the cell; rows that neighbours are away at most
    struct {
        int along[NEAR], rows[NEAR];
    } at[3 * CFA_SIDE_MAX * CFA_SIDE_MAX];
};

/* One view's rows and what they tell. */
struct view {
    struct photo_file *file;
    int first, end;        // rows that dn holds
    float *dn;             // [BAND + 2 reach][count]
    unsigned char *flags;  // [BAND][count]
    float *residual;       // [BAND][count], NAN: does not tell
    float *coarse;         // [BAND / cell][width / cell] second differences, in turn
};

struct reading {
    const struct sensor *sensor;
    struct nearest nearest;
    struct view view[SIGHTS_MAX];
    float *scale;  // make_scales()
    int views, width, height, channels, count, coarse_side;
    char cfa[CFA_SIZE];
};

static int channel_at(const struct reading *r, int x, int y, int c)
{
    return r->channels == 3 ? c : cap_cfa_channel(r->cfa, x, y);
}

/* The nearest in growing squares, in the order of rows: ties have an order of their own. */
static void find_nearest(struct reading *r)
{
    struct nearest *n = &r->nearest;
    const int side = r->channels == 3 ? 1 : cap_cfa_side(r->cfa), far = 2 * side;
    n->side = side;
    for (int k = 0; k < side * side * r->channels; k++) {
        const int y = k / (side * r->channels), x = k / r->channels % side, c = k % r->channels;
        const int own = channel_at(r, x, y, c);
        int found = 0;
        for (int d2 = 1; found < NEAR && d2 <= 2 * far * far; d2++)
            for (int v = -far; v <= far; v++)
                for (int u = -far; u <= far && found < NEAR; u++) {
                    if (u * u + v * v != d2
                        || channel_at(r, x + u + 8 * side, y + v + 8 * side, c) != own)
                        continue;
                    n->at[k].along[found] = u * r->channels;
                    n->at[k].rows[found++] = v;
                    n->reach = abs(v) > n->reach ? abs(v) : n->reach;
                    n->reach = abs(u) > n->reach ? abs(u) : n->reach;
                }
    }
}

static enum status fill(struct view *v, const struct reading *r, int top)
{
    const int reach = r->nearest.reach;
    int first = top > reach ? top - reach : 0;
    int end = top + BAND + reach < r->height ? top + BAND + reach : r->height;
    size_t line = (size_t)r->count;
    enum status status = STATUS_OK;
    if (v->end > first)
        memmove(v->dn, v->dn + (size_t)(first - v->first) * line,
                (size_t)(v->end - first) * line * sizeof *v->dn);
    else
        status = photo_skip(v->file, first - v->end, NULL);
    int have = v->end > first ? v->end : first;
    if (!status)
        status = photo_read(v->file, v->dn + (size_t)(have - first) * line, end - have, NULL);
    v->first = first;
    v->end = end;
    return status;
}

/* What a row of values is compared by, value by value: each channel's own. */
struct scales {
    const float *black, *full, *read2, *slope;  // [count]
};

/* The values from, from + step, ... below end, whose neighbours are near[k] away. Free of branches.
 */
static inline __attribute__((always_inline)) void look(
    unsigned char *restrict flags, float *restrict residual, const float *restrict at,
    const ptrdiff_t near[NEAR], const struct scales *scales, int from, int end, int step)
{
    const float *restrict black = scales->black, *restrict full = scales->full;
    const float *restrict read2 = scales->read2, *restrict slope = scales->slope;
    const float odd2 = (float)(ODD_SIGMAS * ODD_SIGMAS), lit2 = (float)(LIT_SIGMAS * LIT_SIGMAS);
    const float smooth2 = (float)(SMOOTH_SIGMAS * SMOOTH_SIGMAS);
    const float unequal2 = (float)(UNEQUAL * UNEQUAL), noise2 = (float)(NOISE_MAX * NOISE_MAX);
    const float dim_part = (float)DIM_PART, far = (float)RESIDUAL_MAX;
    for (int i = from; i < end; i += step) {
        float low = at[i + near[0]], high = low, sum = low;
        for (int k = 1; k < NEAR; k++) {
            float v = at[i + near[k]];
            low = v < low ? v : low;
            high = v > high ? v : high;
            sum += v;
        }
        float x = at[i] - black[i], mean = sum * (1.0f / NEAR) - black[i], spread = high - low;
        low -= black[i];
        high -= black[i];
        float photons = read2[i] + slope[i] * (mean > 0 ? mean : 0);
        float noise = photons + unequal2 * mean * mean;
        float off = x > high ? x - high : low - x;
        int dim = mean < dim_part * full[i] ? DIM : 0;
        int lit = ((low > 0) & (low * low > lit2 * photons)) ? LIT : 0;
        int odd = ((off > 0) & (off * off > odd2 * noise)) ? ODD | (x > high ? BRIGHT : 0) : 0;
        int seen = high < full[i] ? TESTED | dim | lit | odd : 0;
        bool tells = (seen != 0) & (odd == 0) & (spread * spread < smooth2 * noise) & (x < full[i])
                     & (mean > 0) & (photons < noise2 * mean * mean)
                     & (fabsf(x - mean) < far * mean);
        flags[i] = (unsigned char)seen;
        residual[i] = tells ? (x - mean) / mean : NAN;
    }
}

WIDE static void look_at_all(unsigned char *flags, float *residual, const float *at,
                             const ptrdiff_t near[NEAR], const struct scales *scales, int from,
                             int end)
{
    look(flags, residual, at, near, scales, from, end, 1);
}

WIDE static void look_at_some(unsigned char *flags, float *residual, const float *at,
                              const ptrdiff_t near[NEAR], const struct scales *scales, int from,
                              int end, int step)
{
    if (step == 2)
        look(flags, residual, at, near, scales, from, end, 2);
    else
        look(flags, residual, at, near, scales, from, end, step);
}

static void look_at_row(const struct view *v, const struct reading *r, int y, int row)
{
    const struct nearest *n = &r->nearest;
    const size_t line = (size_t)r->count;
    const int margin = n->reach * r->channels, places = n->side * r->channels;
    const float *at = v->dn + (size_t)(y - v->first) * line;
    const float *scale = r->scale + (size_t)(y % n->side) * 4 * line;
    const struct scales scales = {scale, scale + line, scale + 2 * line, scale + 3 * line};
    unsigned char *flags = v->flags + (size_t)row * line;
    float *residual = v->residual + (size_t)row * line;
    memset(flags, 0, line);
    for (size_t i = 0; i < line; i++)
        residual[i] = NAN;
    if (y < n->reach || y >= r->height - n->reach || r->count <= 2 * margin)
        return;
    for (int p = 0; p < (r->channels == 3 ? 1 : places); p++) {
        ptrdiff_t near[NEAR];
        for (int j = 0; j < NEAR; j++)
            near[j] = n->at[y % n->side * places + p].rows[j] * (ptrdiff_t)line
                      + n->at[y % n->side * places + p].along[j];
        int from = margin + (p + places - margin % places) % places, end = r->count - margin;
        if (r->channels == 3)
            look_at_all(flags, residual, at, near, &scales, margin, end);
        else
            look_at_some(flags, residual, at, near, &scales, from, end, places);
    }
}

/* The scales of the rows of a cell: [side][4][count]. */
static bool make_scales(struct reading *r)
{
    const size_t line = (size_t)r->count;
    r->scale = malloc((size_t)r->nearest.side * 4 * line * sizeof *r->scale);
    for (int y = 0; r->scale && y < r->nearest.side; y++)
        for (size_t i = 0; i < line; i++) {
            const struct sensor *sensor = r->sensor;
            int c = channel_at(r, (int)i / r->channels, y, (int)i % r->channels);
            float *to = r->scale + (size_t)y * 4 * line + i;
            to[0] = (float)sensor->black[c];
            to[line] = (float)(sensor->usable[c] - sensor->black[c]);
            to[2 * line] = (float)(sensor->read_noise[c] * sensor->read_noise[c]);
            to[3 * line] = (float)(1 / sensor->gain[c]);
        }
    return r->scale != NULL;
}

/* Logarithms of the means of coarse cells, along a row of them; then their second differences. */
static void look_coarsely(const struct view *v, const struct reading *r, int top, float *coarse)
{
    const int side = r->coarse_side, columns = r->width / side;
    const size_t line = (size_t)r->count;
    for (int x = 0; x < columns; x++) {
        float sum = 0;
        for (int y = top; y < top + side; y++) {
            const float *dn = v->dn + (size_t)(y - v->first) * line;
            const float *scale = r->scale + (size_t)(y % r->nearest.side) * 4 * line;
            for (int i = x * side * r->channels; i < (x + 1) * side * r->channels; i++)
                sum += fminf(dn[i] - scale[i], scale[line + (size_t)i]);
        }
        coarse[x] = (float)log(fmax((double)sum / (side * side * r->channels), 1));
    }
    for (int x = 0; x + 2 < columns; x++)
        coarse[x] = fmaxf(fminf(coarse[x] - 2 * coarse[x + 1] + coarse[x + 2], 1), -1);
}

/* What a band of all views tells of structure. */
static void add_structure(struct sights *s, const struct reading *r, int rows)
{
    const int columns = r->width / r->coarse_side;
    for (int j = 0; j < r->views; j++)
        for (int k = 0; k <= j; k++)
            for (int y = 0; y + r->coarse_side <= rows; y += r->coarse_side)
                for (int x = 0; x + 2 < columns; x++) {
                    size_t at = (size_t)(y / r->coarse_side) * (size_t)columns + (size_t)x;
                    double product = (double)r->view[j].coarse[at] * (double)r->view[k].coarse[at];
                    s->structure[j][k] += product;
                    if (j != k)
                        s->structure[k][j] += product;
                }
}

static void add_residuals(struct sights *s, const struct reading *r, int top, size_t from,
                          size_t stride)
{
    const size_t line = (size_t)r->count;
    for (size_t i = from; i < line * BAND; i += stride) {
        int row = (int)(i / line), x = (int)(i % line);
        if (top + row >= r->height)
            break;
        int c = channel_at(r, x / r->channels, top + row, x % r->channels);
        double read2 = r->sensor->read_noise[c] * r->sensor->read_noise[c];
        for (int k = 0; k < r->views; k++) {
            double e = (double)r->view[k].residual[i];
            if (!(e == e))
                continue;
            double x1 = (double)r->view[k].dn[i + (size_t)(top - r->view[k].first) * line];
            double signal = fmax((x1 - r->sensor->black[c]) / (1 + e), 1);
            double more =
                e * e - 9.0 / 8 * (read2 + signal / r->sensor->gain[c]) / (signal * signal);
            s->excess[c][k] += more;
            s->excess2[c][k] += more * more;
            s->smooth[c][k]++;
            for (int j = 0; j < k; j++) {
                double product = (double)r->view[j].residual[i] * e;
                if (!(product == product))
                    continue;
                s->product[c][j][k] += product;
                s->product2[c][j][k] += product * product;
                s->first[c][j][k] += (double)r->view[j].residual[i];
                s->second[c][j][k] += e;
                s->pairs[c][j][k]++;
            }
        }
    }
}

static bool keep_sight(struct sights *s, const struct reading *r, size_t value, size_t i,
                       size_t cell)
{
    if ((s->sights & (s->sights + 1)) == 0) {  // full: 0, 1, 3, 7, ... of them
        struct sight *grown = realloc(s->sight, (2 * s->sights + 1) * sizeof *grown);
        if (!grown)
            return false;
        s->sight = grown;
    }
    struct sight *made = &s->sight[s->sights++];
    *made = (struct sight){.at = value, .cell = cell};
    for (int k = 0; k < r->views; k++) {
        unsigned flags = r->view[k].flags[i];
        made->odd |= (flags & ODD ? 1u : 0) << k;
        made->bright |= (flags & BRIGHT ? 1u : 0) << k;
        made->tested |= (flags & TESTED ? 1u : 0) << k;
        made->dim |= (flags & DIM ? 1u : 0) << k;
        made->lit |= (flags & LIT ? 1u : 0) << k;
    }
    return true;
}

/* How many of `count` flags are odd, and tested. */
WIDE static struct sight_count count_flags(const unsigned char *restrict flags, size_t count)
{
    int odd = 0, tested = 0;
    for (size_t i = 0; i < count; i++) {
        odd += flags[i] & ODD;
        tested += flags[i] & TESTED ? 1 : 0;
    }
    return (struct sight_count){odd, tested};
}

/* In how many of the views each value of a row is odd. */
WIDE static void add_odd(unsigned char *restrict odd, const unsigned char *restrict flags,
                         size_t count)
{
    for (size_t i = 0; i < count; i++)
        odd[i] = (unsigned char)(odd[i] + (flags[i] & ODD));
}

static bool add_flags(struct sights *s, const struct reading *r, int top, int rows)
{
    const size_t line = (size_t)r->count, wide = (size_t)CELL * (size_t)r->channels;
    const size_t cells_across = (line + wide - 1) / wide;
    unsigned char *odd = malloc(line);
    bool ok = odd != NULL;
    for (int row = 0; row < rows && ok; row++) {
        memset(odd, 0, line);
        for (int k = 0; k < r->views; k++)
            add_odd(odd, r->view[k].flags + (size_t)row * line, line);
        for (size_t left = 0; left < line && ok; left += wide) {
            size_t cell = (size_t)((top + row) / CELL) * cells_across + left / wide;
            size_t end = left + wide < line ? left + wide : line;
            for (int k = 0; k < r->views; k++) {
                struct sight_count *here = &s->cell[cell * (size_t)r->views + (size_t)k];
                struct sight_count more =
                    count_flags(r->view[k].flags + (size_t)row * line + left, end - left);
                here->odd += more.odd;
                here->tested += more.tested;
            }
            for (size_t x = left; x < end && ok; x++)
                if (odd[x] >= SIGHTS_LEAST)
                    ok = keep_sight(s, r, (size_t)(top + row) * line + x, (size_t)row * line + x,
                                    cell);
        }
        s->photosites += (double)line;
    }
    free(odd);
    return ok;
}

/* A band of all views; false: a photograph or memory failed. */
static bool read_band(struct sights *s, struct reading *r, int top, size_t stride, int threads)
{
    const int rows = r->height - top < BAND ? r->height - top : BAND;
    const int columns = r->width / r->coarse_side;
    bool ok = true;
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (int k = 0; k < r->views; k++) {
        struct view *v = &r->view[k];
        bool read = fill(v, r, top) == STATUS_OK;
        for (int row = 0; row < rows && read; row++)
            look_at_row(v, r, top + row, row);
        for (int y = 0; y + r->coarse_side <= rows && read; y += r->coarse_side)
            look_coarsely(v, r, top + y, v->coarse + (size_t)(y / r->coarse_side * columns));
#pragma omp critical(sights_read)
        ok = ok && read;
    }
    if (!ok)
        return false;
    add_structure(s, r, rows);
    add_residuals(s, r, top, (size_t)top % stride, stride);
    return add_flags(s, r, top, rows);
}

static bool make_view(struct view *v, const struct reading *r)
{
    const size_t line = (size_t)r->count, rows = BAND + 2 * (size_t)r->nearest.reach;
    v->dn = malloc(rows * line * sizeof *v->dn);
    v->flags = malloc(BAND * line);
    v->residual = malloc(BAND * line * sizeof *v->residual);
    v->coarse = malloc(BAND * line * sizeof *v->coarse);
    return v->dn && v->flags && v->residual && v->coarse;
}

static void free_view(struct view *v)
{
    photo_close(v->file);
    free(v->dn);
    free(v->flags);
    free(v->residual);
    free(v->coarse);
    *v = (struct view){0};
}

/* The longest frame of a shot that is not left out; -1: there is none. */
static int longest_frame(const struct capture *capture, const struct shot *shot,
                         const bool *left_out)
{
    int longest = -1;
    for (int k = 0; k < shot->photos; k++) {
        int i = shot->photo[k];
        if (!left_out[i]
            && (longest < 0
                || capture->photo[i].exposure_time > capture->photo[longest].exposure_time))
            longest = i;
    }
    return longest;
}

/* Open the frames, evenly from the shots; those that fail are passed over. */
static void open_views(struct reading *r, const struct capture *capture, int camera,
                       const bool *left_out)
{
    int shots = 0, seen = 0;
    for (int s = 0; s < capture->shots; s++)
        shots += capture->shot[s].camera == camera;
    int wanted = shots < SIGHTS_MAX ? shots : SIGHTS_MAX;
    for (int s = 0; s < capture->shots && r->views < wanted; s++) {
        if (capture->shot[s].camera != camera)
            continue;
        bool take = (seen + 1) * wanted / shots > seen * wanted / shots;
        int photo = longest_frame(capture, &capture->shot[s], left_out);
        seen++;
        if (!take || photo < 0)
            continue;
        const struct photo *p = &capture->photo[photo];
        char *path = cap_path(capture->folder, p->name);
        struct view *v = &r->view[r->views];
        if (path && photo_open(&v->file, path, NULL) == STATUS_OK) {
            const struct photo *info = &v->file->info;
            bool fits = info->width == r->width && info->height == r->height
                        && info->channels == r->channels && strcmp(info->cfa, r->cfa) == 0;
            r->views += fits;
            if (!fits)
                free_view(v);
        }
        free(path);
    }
}

static const struct photo *first_photo(const struct capture *capture, int camera)
{
    for (int s = 0; s < capture->shots; s++)
        if (capture->shot[s].camera == camera)
            return &capture->photo[capture->shot[s].photo[0]];
    return NULL;
}

enum status sights_read(struct sights *sights, const struct capture *capture, int camera,
                        const struct sensor *sensor, const bool *left_out, const struct run *run,
                        struct error *err)
{
    const struct photo *photo = first_photo(capture, camera);
    if (!photo || photo->encoded)
        return STATUS_OK;
    struct reading *r = calloc(1, sizeof *r);
    struct sights made = {0};
    if (!r)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    *r = (struct reading){.sensor = sensor,
                          .width = photo->width,
                          .height = photo->height,
                          .channels = photo->channels,
                          .count = photo->width * photo->channels};
    memcpy(r->cfa, photo->cfa, sizeof r->cfa);
    r->coarse_side = r->channels == 1 && cap_cfa_side(r->cfa) == 6 ? 6 : 8;
    find_nearest(r);
    open_views(r, capture, camera, left_out);
    made.views = r->views;
    size_t values = (size_t)r->count * (size_t)r->height;
    size_t cells = ((size_t)r->width / CELL + 1) * ((size_t)r->height / CELL + 1);
    // A step that comes to all places of every cell of filters.
    size_t stride = 6 * (values / SAMPLES / 6) + 1;
    made.cell = calloc(cells * SIGHTS_MAX, sizeof *made.cell);
    bool ok = made.cell != NULL, memory = ok;
    for (int k = 0; k < r->views; k++)
        memory = make_view(&r->view[k], r) && memory;
    memory = made.cell && make_scales(r) && memory;
    ok = memory;
    int step = r->views < SIGHTS_LEAST ? THIN * BAND : BAND;
    for (int top = 0; top < r->height && ok && r->views > 0; top += step)
        ok = read_band(&made, r, top, stride, run->threads);
    for (size_t i = 0; made.cell && i < cells; i++)
        for (int k = 0; k < made.views; k++) {
            made.all[k].odd += made.cell[i * (size_t)made.views + (size_t)k].odd;
            made.all[k].tested += made.cell[i * (size_t)made.views + (size_t)k].tested;
        }
    for (int k = 0; k < SIGHTS_MAX; k++)
        free_view(&r->view[k]);
    free(r->scale);
    free(r);
    if (!ok || made.views == 0)
        sights_free(&made);  // a damaged photograph: nothing is told; the merge names it
    *sights = made;
    return memory ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "rows of photographs");
}

void sights_free(struct sights *sights)
{
    free(sights->sight);
    free(sights->cell);
    *sights = (struct sights){0};
}
