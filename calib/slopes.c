/* slopes.c -- where a photograph changes, at a reduced size.
 *
 * Method.   Blocks of photosites are averaged, a hundredth of the bright ones' radiance is added
 *           (what is darker is dark), and the logarithm taken, so that an edge counts by its
 *           contrast. Two binomial filters widen an edge to about two blocks on each side: from so
 *           far an outline still feels it.
 */
#include "slopes.h"

#include <stdlib.h>

static const double DARK = 0.01;    // of the bright blocks
static const double BRIGHT = 0.95;  // their quantile
static const double FAINT = 0.01;   // a slope of ln radiance, each block, that is half an edge
static const double ALIGNED = 0.7;  // an edge 45 degrees off an outline is none of its own
enum { ROWS_READ = 3 };             // of a block

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/** Means of blocks, [height][width]. */
static void average(float *mean, const struct slopes *s, const struct radiance *map, float *row)
{
    const int step = (int)s->step, rows = step < ROWS_READ ? step : ROWS_READ;
    for (int y = 0; y < s->height; y++) {
        float *to = mean + (size_t)y * (size_t)s->width;
        for (int k = 0; k < rows; k++) {
            cap_radiance_row(map, y * step + k * step / rows, 0, s->width * step, row, NULL);
            for (int x = 0; x < s->width * step; x++)
                to[x / step] +=
                    (row[3 * x] + row[3 * x + 1] + row[3 * x + 2]) / (float)(rows * step);
        }
    }
}

/** Logarithms, in place. work: [pixels]. */
static void logarithms(float *mean, size_t pixels, float *work)
{
    for (size_t i = 0; i < pixels; i++)
        work[i] = mean[i];
    qsort(work, pixels, sizeof *work, by_value);
    const float dark = (float)DARK * fmaxf(work[(size_t)(BRIGHT * (double)(pixels - 1))], 1e-30F);
    for (size_t i = 0; i < pixels; i++)
        mean[i] = logf(fmaxf(mean[i], 0) + dark);
}

static int within(int at, int end)
{
    return at < 0 ? 0 : at >= end ? end - 1 : at;
}

/** The binomial filter 1 4 6 4 1 along rows (dx = 1) or columns. */
static void smooth(float *to, const float *from, int width, int height, int dx)
{
    static const float weight[] = {1 / 16.F, 4 / 16.F, 6 / 16.F, 4 / 16.F, 1 / 16.F};
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float sum = 0;
            for (int k = -2; k <= 2; k++) {
                int u = within(dx ? x + k : x, width), v = within(dx ? y : y + k, height);
                sum += weight[k + 2] * from[(size_t)v * (size_t)width + (size_t)u];
            }
            to[(size_t)y * (size_t)width + (size_t)x] = sum;
        }
}

static void differentiate(struct slopes *s, const float *value)
{
    const int width = s->width, height = s->height;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const float *row = value + (size_t)y * (size_t)width;
            double gx = 0.5 * (double)(row[within(x + 1, width)] - row[within(x - 1, width)]);
            double gy =
                0.5
                * (double)(value[(size_t)within(y + 1, height) * (size_t)width + (size_t)x]
                           - value[(size_t)within(y - 1, height) * (size_t)width + (size_t)x]);
            double over = 1 / (hypot(gx, gy) + FAINT);
            float *to = s->slope + 2 * ((size_t)y * (size_t)width + (size_t)x);
            to[0] = (float)(gx * over);
            to[1] = (float)(gy * over);
        }
}

enum status cal_slopes_make(struct slopes *slopes, const struct radiance *map, int step,
                            struct error *err)
{
    struct slopes s = {.width = map->width / step, .height = map->height / step, .step = step};
    const size_t pixels = (size_t)s.width * (size_t)s.height;
    float *value = calloc(pixels + 1, sizeof *value), *work = calloc(pixels + 1, sizeof *work);
    float *row = calloc(3 * (size_t)map->width, sizeof *row);
    s.slope = calloc(2 * pixels + 1, sizeof *s.slope);
    enum status status = STATUS_OK;
    if (!value || !work || !row || !s.slope) {
        status = cap_fail(err, STATUS_MEMORY, "%zu slopes", pixels);
    } else if (pixels) {
        average(value, &s, map, row);
        logarithms(value, pixels, work);
        for (int k = 0; k < 2; k++) {
            smooth(work, value, s.width, s.height, 1);
            smooth(value, work, s.width, s.height, 0);
        }
        differentiate(&s, value);
    }
    free(value);
    free(work);
    free(row);
    if (status)
        free(s.slope);
    else
        *slopes = s;
    return status;
}

void cal_slopes_free(struct slopes *s)
{
    free(s->slope);
    *s = (struct slopes){0};
}

double cal_slopes_edge(const struct slopes *s, const double pixel[2], const double normal[2])
{
    const double x = (pixel[0] + 0.5) / s->step, y = (pixel[1] + 0.5) / s->step;
    if (!(x >= 0 && y >= 0 && x < s->width && y < s->height))
        return -1;
    const float *g = s->slope + 2 * ((size_t)y * (size_t)s->width + (size_t)x);
    double along = fabs((double)g[0] * normal[0] + (double)g[1] * normal[1]);
    return fmax(along - ALIGNED, 0) / (1 - ALIGNED);
}
