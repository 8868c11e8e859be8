/* sights.c -- the same photosites in shots of different views, read side by side in bands of rows.
 *
 * Every photosite is looked at, for each may be a defect. What all of them tell together (how
 * unequal they are, which views are the same) is told by some rows of a large photograph. Sums of
 * numbers that are rounded are one thread's from the first row to the last: they do not depend on
 * the number of threads.
 */
#include "sights.h"
#include "photo.h"
#include "sights_look.h"

#include <stdlib.h>
#include <string.h>

enum { CELL = 64 };
enum { SAMPLES = 500000, SQUARES = 50000 };  // enough for what photosites tell together
enum { THIN_BANDS = 16 };                    // so many at least, of a row of squares each

struct reading {
    struct look look;
    struct view view[SIGHTS_MAX];
    int views, threads;
    int band, step;            // rows of a band, and from one to the next
    int every;                 // of so many cells' rows one is sampled
    int square, every_square;  // pixels; of so many rows of squares one is looked at
    unsigned char *odd;        // [LOOK_BAND][places][plane]: views in which a value is odd
    unsigned char *column;     // [SIGHTS_MAX][2][places][plane]: rows where one is odd, tested
};

static bool is_sampled(const struct reading *r, int y)
{
    return y / r->look.side % r->every == 0;
}

/* In how many rows, or views, each value has a flag. */
WIDE static void add_flag(unsigned char *restrict sum, const unsigned char *restrict flags,
                          size_t count, int flag)
{
    for (size_t i = 0; i < count; i++)
        sum[i] = (unsigned char)(sum[i] + ((flags[i] & flag) != 0));
}

static void look_at_row(struct reading *r, int y, int k)
{
    const size_t line = look_line(&r->look);
    unsigned char *odd = r->odd + (size_t)k * line;
    memset(odd, 0, line);
    for (int j = 0; j < r->views; j++) {
        view_look(&r->view[j], &r->look, y, k, is_sampled(r, y));
        add_flag(odd, r->view[j].flags + (size_t)k * line, line, LOOK_ODD);
    }
}

static int cells_across(const struct look *l)
{
    return l->width / CELL + 1;
}

/* The values of a place, from one, below another, that lie in a cell. */
static int begin_of(const struct look *l, int cell, int place)
{
    const int begin = (cell * CELL * l->channels - place + l->places - 1) / l->places;
    return begin < l->plane ? begin > 0 ? begin : 0 : l->plane;
}

/* What a band of one view tells of its cells: bands do not straddle them. */
static void count_cells(struct sights *s, struct reading *r, int view, int top, int rows)
{
    const struct look *l = &r->look;
    const size_t line = look_line(l);
    unsigned char *odd = r->column + 2 * (size_t)view * line, *tested = odd + line;
    memset(odd, 0, 2 * line);
    for (int k = 0; k < rows; k++) {
        add_flag(odd, r->view[view].flags + (size_t)k * line, line, LOOK_ODD);
        add_flag(tested, r->view[view].flags + (size_t)k * line, line, LOOK_TESTED);
    }
    for (int c = 0; c < cells_across(l); c++) {
        size_t cell = (size_t)(top / CELL) * (size_t)cells_across(l) + (size_t)c;
        struct sight_count *here = &s->cell[cell * (size_t)r->views + (size_t)view];
        for (int p = 0; p < l->places; p++)
            for (int i = begin_of(l, c, p); i < begin_of(l, c + 1, p); i++) {
                here->odd += odd[p * l->plane + i];
                here->tested += tested[p * l->plane + i];
            }
    }
}

/* The rows of squares of a band, one after the other; their number. */
static int look_at_squares(const struct reading *r, int view, int top, int rows)
{
    const int columns = r->look.width / r->square;
    int seen = 0;
    for (int k = 0; (k + 1) * r->square <= rows; k++)
        if ((top / r->square + k) % r->every_square == 0)
            view_look_coarsely(&r->view[view], &r->look, top + k * r->square, r->square,
                               r->view[view].coarse + (size_t)(columns * seen++));
    return seen;
}

/* What a band of two views, or of one with itself, tells of structure. */
static void add_structure(struct sights *s, const struct reading *r, int j, int k, int squares)
{
    const int columns = r->look.width / r->square;
    double sum = 0;
    for (int y = 0; y < squares; y++)
        for (int x = 0; x + 2 < columns; x++) {
            size_t at = (size_t)(y * columns + x);
            sum += (double)r->view[j].coarse[at] * (double)r->view[k].coarse[at];
        }
    s->structure[j][k] += sum;
    if (j != k)
        s->structure[k][j] += sum;
}

/* Squares of what a view's values of a place are off, less what noise explains. */
static void add_excess(struct sights *s, const struct reading *r, int k, int y, int row, int place)
{
    const struct look *l = &r->look;
    const int c = look_channel(l, y, place);
    const double read2 = l->sensor->read_noise[c] * l->sensor->read_noise[c];
    const size_t from = (size_t)place * (size_t)l->plane;
    const float *residual = r->view[k].residual + (size_t)row * look_line(l) + from;
    const float *dn = view_row(&r->view[k], l, y) + from;
    for (int i = 0; i < l->plane; i++) {
        const double e = (double)residual[i];
        if (!(e == e))
            continue;
        double signal = fmax(((double)dn[i] - l->sensor->black[c]) / (1 + e), 1);
        double noise = 9.0 / 8 * (read2 + signal / l->sensor->gain[c]) / (signal * signal);
        double more = e * e - noise;
        s->excess[c][k] += more;
        s->excess2[c][k] += more * more;
        s->explained[c][k] += noise;
        s->smooth[c][k]++;
    }
}

/* Products of what two views' values of a place are off. */
static void add_products(struct sights *s, const struct reading *r, int j, int k, int y, int row,
                         int place)
{
    const struct look *l = &r->look;
    const size_t from = (size_t)row * look_line(l) + (size_t)place * (size_t)l->plane;
    const float *first = r->view[j].residual + from, *second = r->view[k].residual + from;
    double product = 0, product2 = 0, sum_first = 0, sum_second = 0, pairs = 0;
    for (int i = 0; i < l->plane; i++) {
        const double a = (double)first[i], b = (double)second[i], both = a * b;
        if (!(both == both))
            continue;
        product += both;
        product2 += both * both;
        sum_first += a;
        sum_second += b;
        pairs++;
    }
    const int c = look_channel(l, y, place);
    s->product[c][j][k] += product;
    s->product2[c][j][k] += product2;
    s->first[c][j][k] += sum_first;
    s->second[c][j][k] += sum_second;
    s->pairs[c][j][k] += pairs;
}

/* What a band tells of views j <= k. */
static void add_pair(struct sights *s, const struct reading *r, int j, int k, int top, int rows,
                     int squares)
{
    add_structure(s, r, j, k, squares);
    for (int row = 0; row < rows; row++) {
        const int y = top + row;
        for (int place = 0; place < r->look.places && is_sampled(r, y); place++)
            if (j == k)
                add_excess(s, r, k, y, row, place);
            else
                add_products(s, r, j, k, y, row, place);
    }
}

/* Value i of a row of the band, as the values stand there. */
static bool keep_sight(struct sights *s, const struct reading *r, int y, int row, size_t i)
{
    const struct look *l = &r->look;
    if ((s->sights & (s->sights + 1)) == 0) {  // full: 0, 1, 3, 7, ... of them
        struct sight *grown = realloc(s->sight, (2 * s->sights + 1) * sizeof *grown);
        if (!grown)
            return false;
        s->sight = grown;
    }
    const size_t plane = (size_t)l->plane, x = i % plane * (size_t)l->places + i / plane;
    struct sight *made = &s->sight[s->sights++];
    *made = (struct sight){.at = (size_t)y * (size_t)l->count + x,
                           .cell = (size_t)(y / CELL) * (size_t)cells_across(l)
                                   + x / (size_t)l->channels / CELL};
    for (int k = 0; k < r->views; k++) {
        unsigned flags = r->view[k].flags[(size_t)row * look_line(l) + i];
        made->odd |= (flags & LOOK_ODD ? 1u : 0) << k;
        made->bright |= (flags & LOOK_BRIGHT ? 1u : 0) << k;
        made->tested |= (flags & LOOK_TESTED ? 1u : 0) << k;
        made->dim |= (flags & LOOK_DIM ? 1u : 0) << k;
        made->lit |= (flags & LOOK_LIT ? 1u : 0) << k;
    }
    return true;
}

/* Is one of the values odd in enough views? */
WIDE static bool any_odd(const unsigned char *odd, size_t count)
{
    unsigned char any = 0;
    for (size_t i = 0; i < count; i++)
        any |= (unsigned char)(odd[i] >= SIGHTS_LEAST);
    return any != 0;
}

static bool keep_sights(struct sights *s, const struct reading *r, int top, int rows)
{
    enum { PIECE = 256 };
    const size_t line = look_line(&r->look);
    bool ok = true;
    for (int row = 0; row < rows; row++)
        for (size_t from = 0; from < line; from += PIECE) {
            const unsigned char *odd = r->odd + (size_t)row * line;
            const size_t end = from + PIECE < line ? from + PIECE : line;
            if (!any_odd(odd + from, end - from))
                continue;
            for (size_t i = from; i < end && ok; i++)
                if (odd[i] >= SIGHTS_LEAST)
                    ok = keep_sight(s, r, top + row, row, i);
        }
    s->photosites += (double)rows * (double)r->look.count;
    return ok;
}

/* A band of all views; false: a photograph or memory failed. */
static bool read_band(struct sights *s, struct reading *r, int top)
{
    const int left = r->look.height - top, rows = left < r->band ? left : r->band;
    int failed = 0, squares = 0;
#pragma omp parallel for schedule(dynamic) num_threads(r->threads) reduction(+ : failed)
    for (int k = 0; k < r->views; k++)
        failed += !view_fill(&r->view[k], &r->look, top, rows);
    if (failed)
        return false;
#pragma omp parallel for schedule(dynamic) num_threads(r->threads)
    for (int k = 0; k < rows; k++)
        look_at_row(r, top + k, k);
#pragma omp parallel for schedule(dynamic) num_threads(r->threads) reduction(max : squares)
    for (int k = 0; k < r->views; k++) {
        count_cells(s, r, k, top, rows);
        squares = look_at_squares(r, k, top, rows);
    }
#pragma omp parallel for schedule(dynamic) num_threads(r->threads)
    for (int pair = 0; pair < r->views * r->views; pair++)
        if (pair / r->views <= pair % r->views)
            add_pair(s, r, pair / r->views, pair % r->views, top, rows, squares);
    return keep_sights(s, r, top, rows);
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
            bool fits = info->width == r->look.width && info->height == r->look.height
                        && info->channels == r->look.channels
                        && strcmp(info->cfa, r->look.cfa) == 0;
            r->views += fits;
            if (!fits)
                view_free(v);
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

/* Rows and their sums; false: out of memory. */
static bool make_room(struct reading *r, struct sights *s)
{
    const size_t line = look_line(&r->look);
    const size_t cells = (size_t)cells_across(&r->look) * ((size_t)r->look.height / CELL + 1);
    s->cell = calloc(cells * SIGHTS_MAX, sizeof *s->cell);
    r->odd = malloc(LOOK_BAND * line);
    r->column = malloc(2 * SIGHTS_MAX * line);
    bool ok = s->cell && r->odd && r->column;
    for (int k = 0; k < r->views; k++)
        ok = view_make(&r->view[k], &r->look) && ok;
    return ok;
}

static void free_room(struct reading *r)
{
    for (int k = 0; k < SIGHTS_MAX; k++)
        view_free(&r->view[k]);
    free(r->odd);
    free(r->column);
    free(r);
}

static void plan_samples(struct reading *r)
{
    const double values = (double)r->look.count * r->look.height;
    r->square = r->look.side == 6 ? 6 : 8;
    const double squares = (double)r->look.width * r->look.height / (r->square * r->square);
    r->every = (int)fmax(values / SAMPLES, 1);
    r->every_square = (int)fmax(squares / SQUARES, 1);
    r->band = r->step = LOOK_BAND;
    if (r->views >= SIGHTS_LEAST)
        return;
    // No photosite can be judged, so that not all need be seen: thin bands, of which all is.
    const double bands = fmax(SAMPLES / ((double)r->look.count * r->square), THIN_BANDS);
    r->band = r->square;
    r->step = (int)fmax(r->look.height / bands / r->square, 1) * r->square;
    r->every = r->every_square = 1;
}

static int by_place(const void *a, const void *b)
{
    const struct sight *p = a, *q = b;
    return (p->at > q->at) - (p->at < q->at);
}

/* The whole image of the cells, and sights in order. */
static void finish(struct sights *s, const struct look *look)
{
    const size_t cells = (size_t)cells_across(look) * ((size_t)look->height / CELL + 1);
    for (size_t i = 0; i < cells; i++)
        for (int k = 0; k < s->views; k++) {
            s->all[k].odd += s->cell[i * (size_t)s->views + (size_t)k].odd;
            s->all[k].tested += s->cell[i * (size_t)s->views + (size_t)k].tested;
        }
    if (s->sights > 0)
        qsort(s->sight, s->sights, sizeof *s->sight, by_place);
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
    r->threads = run->threads;
    r->look = look_for(photo, sensor);
    open_views(r, capture, camera, left_out);
    plan_samples(r);
    made.views = r->views;
    const bool memory = make_room(r, &made);
    bool ok = memory && r->views > 0;
    for (int top = 0; top < r->look.height && ok; top += r->step)
        ok = read_band(&made, r, top);
    if (ok)
        finish(&made, &r->look);
    else
        sights_free(&made);  // a damaged photograph: nothing is told; the merge names it
    free_room(r);
    *sights = made;
    return memory ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "rows of photographs");
}

void sights_free(struct sights *sights)
{
    free(sights->sight);
    free(sights->cell);
    *sights = (struct sights){0};
}
