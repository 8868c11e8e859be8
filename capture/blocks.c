/* blocks.c -- the noise of encoded photographs, block by block.
 *
 * What a JPEG encoder does to a block of its transform depends on what is in it: next to nothing to
 * a smooth surface, some per cent beside an edge. What the codes of each frame are worth, the
 * file's tables tell (coding.h): variance k of what is in the file, and l of what is not, in codes;
 * in DN they are times the square of the step from one code to the next. Frames are encoded one by
 * one. With the weights w of the merge, sum w t = 1, a value has the variance
 *
 *     sum w^2 (k + (1 - a) l) + a (sum w sqrt(l))^2,
 *
 * where a is the correlation of what two frames lose. Detail that is dropped from a frame is
 * dropped from the next one, unless it is just at the threshold: where coefficients are spread far
 * beyond it, frames whose contrast differs by the factor r have a = r^(-3/2), 1/2 where times are 4
 * apart (contrast of sRGB codes grows as t^(1/2.4)); where they are within, 1.
 *
 * The model is good to some ten per cent of a deviation; by how much the frames disagree against
 * it, in chi^2 over what is expected of it, is the block's own factor. Errors of a block are few
 * numbers over many values, so the blocks beside it help, where their tables are known, and PRIOR
 * degrees of freedom with the factor 1 are added. Files without tables (8-bit PNG, TIFF) have the
 * sensor's variance, as photon transfer finds it.
 */
#include "blocks.h"
#include "bracket.h"

#include <string.h>

static const double PRIOR = 4;
enum { REACH = 2 };                // blocks to either side that help,
static const double BESIDE = 0.5;  // with this part of what they tell
static const float ALIKE = 0.5f;   // correlation of what two frames lose

void blocks_steps(struct code_steps *steps, const struct curve *curve)
{
    for (int c = 0; c < 3; c++)
        for (int i = 0, z = 0; i < STEPS; i++) {
            const float *dn = curve->dn[c];
            while (z < 254 && (double)dn[z + 1] < (i + 0.5) * STEP_DN)
                z++;
            // Over three codes: single steps of a recovered curve are noise.
            int low = z > 0 ? z - 1 : 0, high = z < 254 ? z + 2 : 255;
            steps->step[c][i] = (dn[high] - dn[low]) / (float)(high - low);
        }
}

static float step_at(const struct code_steps *steps, int c, float dn)
{
    int i = (int)dn / STEP_DN;
    return steps->step[c][i < 0 ? 0 : i < STEPS ? i : STEPS - 1];
}

/* A frame of a value. */
struct seen {
    float t, off;       // seconds; DN less what the merge made of all
    float weight;       // of the DN in the merge's sum
    float own2, alike;  // variance of errors of its own; deviation of those that all share
};

/* The frames of value i that serve. */
static int look(struct seen *seen, const struct encoded_row *encoded, int i, float x)
{
    const struct merge_row *row = encoded->row;
    const size_t block = (size_t)(i / 3 / BLOCK_SIDE), c = (size_t)i % 3;
    int used = 0;
    for (int f = 0; f < encoded->frames; f++) {
        float t = (float)encoded->time[f], dn = encoded->dn[f][i];
        if (dn >= row->usable[i]
            || (f > 0 && x * t >= row->usable[i] - row->black[i] - 2 / row->verge[i]))
            continue;
        float noise = row->read2[i] + row->slope[i] * (x > 0 ? x : 0) * t;
        struct seen *to = &seen[used++];
        *to = (struct seen){t, dn - row->black[i] - x * t, t / noise, noise, 0};
        if (!encoded->kept[f])
            continue;
        float step = step_at(encoded->steps, (int)c, dn), step2 = step * step;
        float lost = encoded->lost[f][3 * block + c];
        to->own2 = step2 * (encoded->kept[f][3 * block + c] + (1 - ALIKE) * lost);
        to->alike = step * sqrtf(ALIKE * lost);
    }
    return used;
}

void blocks_disagreement(float *chi2, float *freedom, float *variance, const float *value,
                         const struct encoded_row *encoded)
{
    const struct merge_row *row = encoded->row;
    struct seen seen[BRACKET_FRAMES_MAX];
    for (int i = 0; i < row->count; i++) {
        float x = value[i] / row->scale[i], weights = 0, own2 = 0, alike = 0;
        int used = look(seen, encoded, i, x);
        chi2[i] = freedom[i] = 0;
        if (used == 0 || !isfinite(variance[i]))
            continue;
        for (int f = 0; f < used; f++)
            weights += seen[f].weight * seen[f].t;
        for (int f = 0; f < used; f++) {
            float w = seen[f].weight /= weights;
            own2 += w * w * seen[f].own2;
            alike += w * seen[f].alike;
        }
        for (int f = 0; f < used && used > 1; f++) {
            const struct seen *s = &seen[f];
            float apart = s->alike - s->t * alike;
            float due = s->own2 * (1 - 2 * s->weight * s->t) + s->t * s->t * own2 + apart * apart;
            float size = s->own2 + s->alike * s->alike;
            chi2[i] += s->off * s->off / size;
            freedom[i] += due / size;
        }
        variance[i] = row->scale[i] * row->scale[i] * (own2 + alike * alike);
    }
}

/* A block of one channel: its values are at first + line y + 3 x. */
struct place {
    size_t first, line;
    int columns, rows;
};

static struct place place_of(int block, int channel, int top, int count, int rows)
{
    int columns = count / 3 - BLOCK_SIDE * block, high = rows - top;
    return (struct place){.first = (size_t)top * (size_t)count + 3 * (size_t)(BLOCK_SIDE * block)
                                   + (size_t)channel,
                          .line = (size_t)count,
                          .columns = columns < BLOCK_SIDE ? columns : BLOCK_SIDE,
                          .rows = high < BLOCK_SIDE ? high : BLOCK_SIDE};
}

/* What a block tells. */
struct told {
    double chi2, freedom;
};

static struct told told_by(const float *chi2, const float *freedom, struct place place)
{
    struct told told = {0};
    for (int y = 0; y < place.rows; y++)
        for (int x = 0; x < place.columns; x++) {
            size_t i = place.first + (size_t)y * place.line + 3 * (size_t)x;
            told.chi2 += (double)chi2[i];
            told.freedom += (double)freedom[i];
        }
    return told;
}

static void enlarge(float *variance, const float *value, float factor, float relative2,
                    struct place place)
{
    for (int y = 0; y < place.rows; y++)
        for (int x = 0; x < place.columns; x++) {
            size_t i = place.first + (size_t)y * place.line + 3 * (size_t)x;
            variance[i] = factor * variance[i] + relative2 * value[i] * value[i];
        }
}

/* One channel of a row of blocks. The window of blocks moves along. */
static void apply_row(float *variance, const float *value, const float *chi2, const float *freedom,
                      const struct merge_row *row, bool modelled, int top, int rows, int channel)
{
    const int blocks = (row->count / 3 + BLOCK_SIDE - 1) / BLOCK_SIDE;
    struct told window[2 * REACH + 1] = {{0}};
    for (int block = -REACH; block < blocks; block++) {
        double sum = PRIOR, count = PRIOR;
        memmove(window, window + 1, sizeof window - sizeof *window);
        window[2 * REACH] = (struct told){0};
        if (block + REACH < blocks)
            window[2 * REACH] =
                told_by(chi2, freedom, place_of(block + REACH, channel, top, row->count, rows));
        for (int k = 0; k <= 2 * REACH; k++) {
            double part = k == REACH ? 1 : modelled ? BESIDE : 0;
            sum += part * window[k].chi2;
            count += part * window[k].freedom;
        }
        if (block >= 0)
            enlarge(variance, value, (float)(sum / count), row->relative2[channel],
                    place_of(block, channel, top, row->count, rows));
    }
}

void blocks_apply(float *variance, const float *value, const float *chi2, const float *freedom,
                  const struct merge_row *row, bool modelled, int rows)
{
    for (int top = 0; top < rows; top += BLOCK_SIDE)
        for (int c = 0; c < 3; c++)
            apply_row(variance, value, chi2, freedom, row, modelled, top, rows, c);
}
