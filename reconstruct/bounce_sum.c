/* bounce_sum.c -- the lit board's light at one place of the sample, through a table.
 *
 * Method.   L(wo) = sum f(w, wo) B A (n.w) (m.-w) / d^2 over cells of radiance B, area A and normal
 *           m, w towards the cell. Where the lobe is narrower than a cell looks from here, the cell
 *           is cut further, so that the sum does not depend on where its middle lies.
 * Errors.   A cell is taken as evenly bright, though letters and bits are smaller. What it hides is
 *           taken to differ as much as cells do from each other where the lobe looks: the weighted
 *           variance of B, over the number of cells that matter, (sum w)^2 / sum w^2.
 */
#include "bounce_sum.h"

#include "lanes.h"

enum { CUTS_MAX = 8 };
static const double FINE = 0.5;  // a piece spans this part of the lobe's half width, in h
static const double FAR = 4;     // half widths from the mirror direction beyond which f is smooth
static const double HIDDEN =
    0.5;  // of the cells' differences: pieces are partly told by neighbours

struct bounce_through rec_bounce_through(const struct lookup *table)
{
    enum { STEPS = 256 };
    const double theta_d = 0.5, across = CAP_PI / 2;
    struct bounce_through t = {table, CAP_PI / 2};
    vec3 wi[STEPS], wo[STEPS];
    double f[STEPS][3], sum[STEPS];
    for (int k = 0; k < STEPS; k++)  // to 60 degrees, in steps of the root
        rec_directions(
            (half_diff){CAP_PI / 3 * k * k / ((STEPS - 1) * (STEPS - 1)), theta_d, across}, &wi[k],
            &wo[k]);
    rec_lookup_eval(table, wi, wo, f, STEPS);
    for (int k = 0; k < STEPS; k++)
        sum[k] = f[k][0] + f[k][1] + f[k][2];
    double base = sum[STEPS - 1], half = base + (sum[0] - base) / 2;
    if (sum[0] > 1.5 * base)
        for (int k = 0; k < STEPS && t.gloss > CAP_PI / 3; k++)
            if (sum[k] < half)
                t.gloss = CAP_PI / 3 * k * k / ((STEPS - 1) * (STEPS - 1));
    return t;
}

/** A place of the sample: its frame, with wo in the plane of x and z. */
struct place {
    vec3 point, x, y, z, out;  // out: wo in that frame
};

static struct place place_of(vec3 point, vec3 n, vec3 wo)
{
    vec3 x = vec3_sub(wo, vec3_scale(n, vec3_dot(wo, n)));
    double sine = vec3_length(x);
    x = sine > 1e-9
            ? vec3_scale(x, 1 / sine)
            : vec3_normalize(vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0}));
    vec3 y = vec3_cross(n, x);
    return (struct place){point, x, y, n, {vec3_dot(wo, x), 0, vec3_dot(wo, n)}};
}

/** Pieces of cells on their way into the sum, evaluated many at a time. */
struct batch {
    const struct lookup *table;
    vec3 in[LANES], out[LANES];
    double light[LANES][3], form[LANES], pieces[LANES];  // pieces: that share the piece's cell
    int count;
    double radiance[3], w, ww, wb, wbb;  // w: weight of a cell, f times form; b: its radiance
};

static void flush(struct batch *b)
{
    double f[LANES][3];
    rec_lookup_eval(b->table, b->in, b->out, f, (size_t)b->count);
    for (int i = 0; i < b->count; i++) {
        double w = 0, bright = 0;
        for (int c = 0; c < 3; c++) {
            b->radiance[c] += f[i][c] * b->light[i][c] * b->form[i];
            w += f[i][c] * b->form[i];
            bright += b->light[i][c];
        }
        b->w += w;
        b->ww += w * w * b->pieces[i];  // what a cell hides all of its pieces share
        b->wb += w * bright;
        b->wbb += w * bright * bright;
    }
    b->count = 0;
}

static void add_piece(struct batch *b, const struct place *at, const struct glow *cell, vec3 middle,
                      double area, int pieces)
{
    vec3 to = vec3_sub(middle, at->point);
    double up = vec3_dot(to, at->z), down = -vec3_dot(to, cell->normal);
    if (up <= 0 || down <= 0)
        return;
    double r2 = vec3_dot(to, to), s = 1 / sqrt(r2);
    int i = b->count++;
    b->in[i] = (vec3){vec3_dot(to, at->x) * s, vec3_dot(to, at->y) * s, up * s};
    b->out[i] = at->out;
    b->form[i] = up * down * area / (r2 * r2);
    b->pieces[i] = pieces;
    for (int c = 0; c < 3; c++)
        b->light[i][c] = cell->radiance[c];
    if (b->count == LANES)
        flush(b);
}

// Into how many pieces a side a cell is cut: by how far its h spans, and lies from the normal.
static int cuts_of(const struct place *at, const struct glow *cell, double gloss)
{
    vec3 to = vec3_sub(cell->point, at->point);
    double r = vec3_length(to), span = cell->side / (2 * r);
    if (span <= FINE * gloss)
        return 1;
    vec3 in = {vec3_dot(to, at->x) / r, vec3_dot(to, at->y) / r, vec3_dot(to, at->z) / r};
    vec3 h = vec3_add(in, at->out);
    double off = hypot(h.x, h.y) / fmax(vec3_length(h), 1e-9);
    if (off > FAR * gloss + span)
        return 1;
    return (int)fmin(CUTS_MAX, ceil(span / (FINE * gloss)));
}

struct bounced_light rec_bounce_sum(const struct bounce_through *through, const struct glow *cell,
                                    int count, vec3 point, vec3 normal, vec3 wo)
{
    const struct place at = place_of(point, normal, wo);
    struct batch b = {.table = through->table};
    struct bounced_light light = {{0}, 0};
    for (int i = 0; i < count; i++) {
        int n = cuts_of(&at, &cell[i], through->gloss);
        double side = cell[i].side / n;
        vec3 y = vec3_cross(cell[i].normal, cell[i].x);
        for (int k = 0; k < n * n; k++) {
            int row = k / n;
            double u = (k % n + 0.5) * side - cell[i].side / 2;
            double v = (row + 0.5) * side - cell[i].side / 2;
            vec3 middle =
                vec3_add(cell[i].point, vec3_add(vec3_scale(cell[i].x, u), vec3_scale(y, v)));
            add_piece(&b, &at, &cell[i], middle, side * side, n * n);
        }
    }
    flush(&b);
    double mean = b.w > 0 ? b.wb / b.w : 0;
    double variance = b.w > 0 ? fmax(0, b.wbb / b.w - mean * mean) : 0;
    for (int c = 0; c < 3; c++)
        light.radiance[c] = b.radiance[c];
    if (mean > 0)
        light.doubt = HIDDEN * sqrt(variance * b.ww) / (mean * b.w);
    return light;
}
