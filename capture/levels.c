/* levels.c -- black and saturation level of a sensor, from brackets.
 *
 * White.  A photosite whose shorter frame predicts far more than its longer frame shows is
 *         saturated in the longer one. Such values pile up at the saturation level; the pile's
 *         mean is `white`, and what lies less than 4 standard deviations of the pile below it is
 *         not `usable`: read noise pulls saturated values down (by more than any test v < maximum
 *         catches).
 * Black.  Of a shorter and a longer frame, with R the ratio of their times, a line through both
 *         values meets time 0 at
 *
 *             black = (R v_short - v_long) / (R - 1).
 *
 *         The mean over the darkest photosites is almost free of photon noise; brighter ones serve
 *         too, as far as errors of the times allow, and make it good to some 0.003 DN. Where the
 *         converter cuts off at 0, the darkest do not serve.
 */
#include "sensor.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { LEVELS = 65536 };

// A pile of fewer values than this may be dust or a moving highlight.
enum { PILE_MIN = 30 };

/* The smallest value with at least a share of the histogram at or below it. */
static int quantile(const uint32_t *histogram, double share)
{
    double total = 0, sum = 0;
    for (int v = 0; v < LEVELS; v++)
        total += histogram[v];
    for (int v = 0; v < LEVELS; v++) {
        sum += histogram[v];
        if (sum > 0 && sum >= share * total)
            return v;
    }
    return 0;
}

/* The histogram's place of a value; values of float files may lie anywhere. */
static int level_of(float dn)
{
    return dn > 0 ? dn < LEVELS - 1 ? (int)(dn + 0.5f) : LEVELS - 1 : 0;
}

static void count_values(uint32_t *histogram, const float *dn, size_t photosites)
{
    for (size_t i = 0; i < photosites; i++)
        histogram[level_of(dn[i])]++;
}

static float highest_value(const struct bracket_sample *sample, int samples)
{
    float top = 0;
    for (int k = 0; k < samples; k++)
        for (int f = 0; f < sample[k].frames; f++)
            for (size_t i = 0; i < sample[k].photosites; i++)
                top = sample[k].dn[f][i] > top ? sample[k].dn[f][i] : top;
    return top;
}

/* Where black may be: nothing in the shortest frames is darker, but for a thousandth. */
static double rough_black(const struct bracket_sample *sample, int samples, uint32_t *histogram)
{
    memset(histogram, 0, LEVELS * sizeof *histogram);
    for (int k = 0; k < samples; k++)
        if (sample[k].frames > 1)
            count_values(histogram, sample[k].dn[0], sample[k].photosites);
    return quantile(histogram, 0.001);
}

/* Histogram of the values that are too low by far for what the frame before predicts. The upper
 * half of the scale is enough: a pile lies at its top. */
static void count_saturated(uint32_t *histogram, const struct bracket_sample *s, double black,
                            double top)
{
    enum { RATIO_MAX = 32 };  // beyond, the prediction is more noise than signal
    for (int f = 1; f < s->frames; f++) {
        double ratio = s->time[f] / s->time[f - 1];
        if (ratio < 1.2 || ratio > RATIO_MAX)
            continue;
        for (size_t i = 0; i < s->photosites; i++) {
            double before = (double)s->dn[f - 1][i] - black, now = (double)s->dn[f][i] - black;
            if (now < 0.5 * (top - black))
                continue;
            // Less 4 standard deviations of photon noise at 1 electron a DN.
            double predicted = ratio * (before - 4 * sqrt(fmax(before, 1)));
            if (predicted > (1 + 0.3 * fmin(ratio - 1, 1)) * now)
                histogram[level_of(s->dn[f][i])]++;
        }
    }
}

struct pile {
    bool found;
    double mean, spread;
};

static struct pile measure_pile(const uint32_t *histogram)
{
    int median = quantile(histogram, 0.5);
    double total = 0, near = 0, count = 0, sum = 0, sum2 = 0;
    // Robust scale: half of a normal pile is within 0.67 standard deviations of its median.
    int half = (quantile(histogram, 0.75) - quantile(histogram, 0.25)) / 2;
    double reach = 5 * 1.4826 * half + 2;
    for (int v = 0; v < LEVELS; v++) {
        total += histogram[v];
        if (abs(v - median) <= reach) {
            near += histogram[v];
            count += histogram[v];
            sum += (double)histogram[v] * (v - median);
            sum2 += (double)histogram[v] * (v - median) * (v - median);
        }
    }
    if (total < PILE_MIN || near < 0.5 * total || reach > 0.1 * median)
        return (struct pile){0};
    double mean = sum / count;
    return (struct pile){true, median + mean, sqrt(fmax(sum2 / count - mean * mean, 0))};
}

static void set_white(struct sensor *sensor, int c, const struct bracket_sample *sample,
                      int samples, const struct sensor_known *known, double black,
                      uint32_t *histogram)
{
    // Quantised DCT coefficients ring by some codes around clipped regions of a JPEG file; near
    // white one sRGB code is 2.4 / 1.055 / 255 = 0.9 % of the scale.
    double ringing = known->encoded ? 4 * 0.0089 : 0;
    double top = (double)highest_value(sample, samples);
    memset(histogram, 0, LEVELS * sizeof *histogram);
    for (int k = 0; k < samples; k++)
        count_saturated(histogram, &sample[k], black, top);
    struct pile pile = measure_pile(histogram);
    if (!isnan(known->white)) {
        pile.found = pile.found && fabs(pile.mean - known->white) < 0.02 * known->white;
        pile.mean = known->white;
    } else if (!pile.found && !isnan(known->nominal_white)) {
        pile.mean = known->nominal_white;
    } else if (!pile.found) {
        // Nothing saturates: full scale is that of the smallest converter that reaches so far.
        int full = 255;
        while (full < top && full < LEVELS - 1)
            full = 2 * full + 1;
        pile.mean = known->encoded || known->real ? LEVELS - 1 : full;
    }
    if (!pile.found)
        pile.spread = 1;  // of a sensor with little noise, in DN
    sensor->white[c] = pile.mean;
    sensor->usable[c] = pile.mean - fmax(4 * fmax(pile.spread, 0.5), ringing * pile.mean);
    if (known->real && !pile.found && isnan(known->white))
        sensor->usable[c] = (double)FLT_MAX;  // a float file need not end anywhere
}

/* The frame that tells which photosites are dark. Chosen by the noise of the longest frame, they
 * would all be read too low in it: the one before it is independent. */
static const float *selector(const struct bracket_sample *s)
{
    return s->dn[s->frames > 2 ? s->frames - 2 : s->frames - 1];
}

/* Mean intercept of the photosites with values in [low, high) in the selector, from the longest
 * and the shortest frame of each bracket. */
struct intercept {
    double count, mean, deviation, at_zero;  // at_zero: share of values cut off at 0
};

static struct intercept mean_intercept(const struct bracket_sample *sample, int samples, double low,
                                       double high, double usable, struct intercept before)
{
    double count = 0, sum = 0, sum2 = 0, zeros = 0;
    for (int k = 0; k < samples; k++) {
        const struct bracket_sample *s = &sample[k];
        double ratio = s->time[s->frames - 1] / s->time[0];
        if (ratio < 2)
            continue;
        const float *dn_short = s->dn[0], *dn_long = s->dn[s->frames - 1];
        const float *by = selector(s);
        for (size_t i = 0; i < s->photosites; i++) {
            double at = (double)by[i], now = (double)dn_long[i];
            if (at < low || at >= high || now >= usable)
                continue;
            double b = (ratio * (double)dn_short[i] - now) / (ratio - 1);
            if (before.count > 0 && fabs(b - before.mean) > 5 * before.deviation + 1)
                continue;  // a hot photosite, or something that moved
            zeros += dn_short[i] <= 0;
            count++;
            sum += b;
            sum2 += b * b;
        }
    }
    if (count == 0)
        return (struct intercept){0};
    double mean = sum / count;
    return (struct intercept){count, mean, sqrt(fmax(sum2 / count - mean * mean, 0)),
                              zeros / count};
}

/* Signal in the selector up to which the intercept is not spoiled by times that are off by 2e-4:
 * by 0.005 DN at most. The longer the bracket, the more photosites serve. */
static double reach_of(const struct bracket_sample *sample, int samples, double range)
{
    double reach = INFINITY;
    for (int k = 0; k < samples; k++) {
        const struct bracket_sample *s = &sample[k];
        double longest = s->time[s->frames - 1], ratio = longest / s->time[0];
        double part = s->time[s->frames > 2 ? s->frames - 2 : s->frames - 1] / longest;
        if (ratio >= 2)
            reach = fmin(reach, part * fmin(0.005 / 2e-4 * (ratio - 1), 0.5 * range));
    }
    return isfinite(reach) ? reach : 0;
}

/* NAN: the brackets do not tell. */
static double find_black(const struct bracket_sample *sample, int samples, double usable,
                         uint32_t *histogram)
{
    enum { STEPS = 9, COUNT_MIN = 100 };
    memset(histogram, 0, LEVELS * sizeof *histogram);
    for (int k = 0; k < samples; k++)
        if (sample[k].time[sample[k].frames - 1] >= 2 * sample[k].time[0])
            count_values(histogram, selector(&sample[k]), sample[k].photosites);
    for (int v = (int)fmin(usable, LEVELS); v < LEVELS; v++)
        histogram[v] = 0;  // saturated
    double low = 0, found = NAN;
    struct intercept last = {0};
    for (int step = 1; step <= STEPS; step++) {
        double high = quantile(histogram, 0.1 * step) + 1;
        struct intercept b = {0};
        for (int clip = 0; clip < 3; clip++)
            b = mean_intercept(sample, samples, low, high, usable, b);
        if (b.count >= COUNT_MIN) {
            found = fmax(b.mean, 0);
            last = b;
        }
        if (b.count >= COUNT_MIN && b.at_zero < 1e-3) {
            double wide = reach_of(sample, samples, usable - found);
            if (found + wide > high)
                last = mean_intercept(sample, samples, low, found + wide, usable, last);
            return last.count >= COUNT_MIN ? fmax(last.mean, 0) : found;
        }
        low = high;
    }
    return found;
}

void sensor_find_levels(struct sensor *sensor, int c, const struct bracket_sample *sample,
                        int samples, const struct sensor_known *known, struct sensor_doubts *doubts)
{
    uint32_t *histogram = calloc(LEVELS, sizeof *histogram);
    double black = known->encoded || known->real ? 0 : known->black[c];
    if (!histogram) {  // the whole format, then
        sensor->black[c] = isnan(black) ? 0 : black;
        sensor->white[c] = sensor->usable[c] = LEVELS - 1;
        doubts->black = true;
        return;
    }
    double rough = isnan(black) ? rough_black(sample, samples, histogram) : black;
    set_white(sensor, c, sample, samples, known, rough, histogram);
    if (isnan(black))
        black = find_black(sample, samples, sensor->usable[c], histogram);
    doubts->black = doubts->black || isnan(black);
    sensor->black[c] = isnan(black) ? 0 : black;
    free(histogram);
}
