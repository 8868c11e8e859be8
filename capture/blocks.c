/* blocks.c -- the noise of encoded photographs, block by block.
 *
 * What a JPEG encoder loses depends on what is in a block of its transform: next to nothing of a
 * smooth surface, some per cent beside an edge. Photon transfer finds the mean over the picture,
 * with which smooth blocks are better than their stated variance and textured ones several times
 * worse. But the frames of a bracket are encoded one by one: by how much they disagree, in chi^2
 * over its degrees of freedom, is the block's own factor. Degrees of freedom that are few lean on
 * the picture's mean: PRIOR of them are added, with the factor 1. Detail that the encoder drops, it
 * drops in all frames alike: they are no better together than the best of them, and what they share
 * does not show when they disagree. Beside edges two frames' errors have a correlation of about a
 * half (0.3 to 0.6 on photographs of known radiance, next to none on smooth surfaces): what a block
 * has more than smooth ones, SMOOTH, counts twice.
 */
#include "blocks.h"

static const double PRIOR = 4;
static const double SMOOTH = 0.5;  // factor of blocks without edges

void blocks_disagreement(float *chi2, float *freedom, float *variance, const float *value,
                         const struct merge_row *row, const float *const *dn, const double *time,
                         int frames)
{
    for (int i = 0; i < row->count; i++) {
        float x = value[i] / row->scale[i], sum = 0, used = 0, best = 0;
        for (int f = 0; f < frames; f++) {
            float t = (float)time[f], d = dn[f][i] - row->black[i] - x * t;
            bool serves = dn[f][i] < row->usable[i] && (f == 0 || x * t < row->safe[i]);
            float noise = row->read2[i] + row->slope[i] * (x > 0 ? x : 0) * t;
            sum += serves ? d * d / noise : 0;
            used += serves ? 1 : 0;
            float weight = serves ? t * t / noise : 0;
            best = weight > best ? weight : best;
        }
        // What disagreed by itself is the block's to tell.
        if (best > 0 && isfinite(variance[i]))
            variance[i] =
                row->relative2[i] * value[i] * value[i] + row->scale[i] * row->scale[i] / best;
        chi2[i] = used > 1 ? sum : 0;
        freedom[i] = used > 1 ? used - 1 : 0;
    }
}

static double factor_of(const float *chi2, const float *freedom, size_t line, int columns, int rows)
{
    double sum = PRIOR, count = PRIOR;
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < columns; x++) {
            sum += (double)chi2[(size_t)y * line + 3 * (size_t)x];
            count += (double)freedom[(size_t)y * line + 3 * (size_t)x];
        }
    return sum / count;
}

void blocks_apply(float *variance, const float *value, const float *chi2, const float *freedom,
                  const struct merge_row *row, int rows)
{
    const size_t line = (size_t)row->count;
    for (int top = 0; top < rows; top += BLOCK_SIDE)
        for (size_t left = 0; left < line; left++) {  // of a block, in each channel
            if (left / 3 % BLOCK_SIDE != 0)
                continue;
            int columns = (int)((line - left + 2) / 3);
            columns = columns < BLOCK_SIDE ? columns : BLOCK_SIDE;
            int high = rows - top < BLOCK_SIDE ? rows - top : BLOCK_SIDE;
            size_t at = (size_t)top * line + left;
            double factor = factor_of(chi2 + at, freedom + at, line, columns, high);
            factor += factor > SMOOTH ? factor - SMOOTH : 0;
            for (int y = 0; y < high; y++)
                for (int x = 0; x < columns; x++) {
                    size_t i = at + (size_t)y * line + 3 * (size_t)x;
                    float shared = row->relative2[left] * value[i] * value[i];
                    float noise = variance[i] - shared;
                    variance[i] = shared + (float)factor * (noise > 0 ? noise : 0);
                }
        }
}
