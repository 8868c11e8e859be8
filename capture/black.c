/* black.c -- the black level by all that brackets know of it.
 *
 * Frame f of a photosite reads black + x t_f, with variance v_f = read^2 + x t_f / gain. Any
 * contrast sum c_f dn_f with sum c_f t_f = 0 is free of x; the best one, of weights w_f = 1 / v_f,
 *
 *     U = sum w_f dn_f - (S1 / S2) sum w_f t_f dn_f,     I = S0 - S1^2 / S2,    Sk = sum w_f t_f^k,
 *
 * tells black = U / I with variance 1 / I, and all photosites together sum U / sum I: that is the
 * Cramer-Rao bound for radiances of which nothing is known. Weights from the frames themselves
 * would share their noise. They are told by one more frame, the longest but one, which is not
 * summed: whatever it says, the contrast is unbiased.
 *
 * Times are good to 2e-4 (times.c), which shows in x t_0: photosites serve up to 25 DN in the
 * shortest frame, where that is 0.005 DN.
 *
 * Channels mostly share one black level, but need not. Each is told by itself and by the others, as
 * far as they differ by no more than noise: the mean of a population whose variance the channels
 * themselves tell.
 *
 * R. DerSimonian and N. Laird, "Meta-analysis in clinical trials", Controlled Clinical Trials 7,
 * 1986.
 */
#include "black.h"

#include <stdlib.h>

enum { FRAMES_MAX = 64 };

static const double REACH = 0.005 / 2e-4;  // DN in the shortest frame

/* A level and the variance of its error; INFINITY: not told. */
struct told {
    double black, variance;
};

/* The frames of a bracket that are summed, and the one that tells the weights. */
struct frames_of {
    const float *dn[FRAMES_MAX], *by;
    double time[FRAMES_MAX], by_time;
    int frames;
};

static struct frames_of choose_frames(const struct bracket_sample *s, const bool *left_out)
{
    struct frames_of chosen = {.frames = 0};
    int used[FRAMES_MAX], n = 0;
    for (int f = 0; f < s->frames && n < FRAMES_MAX; f++)
        if (!left_out || !s->photo || !left_out[s->photo[f]])
            used[n++] = f;
    if (n < 3 || s->time[used[n - 1]] < 2 * s->time[used[0]])
        return chosen;
    for (int k = 0; k < n; k++) {
        if (k == n - 2)
            continue;
        chosen.dn[chosen.frames] = s->dn[used[k]];
        chosen.time[chosen.frames++] = s->time[used[k]];
    }
    chosen.by = s->dn[used[n - 2]];
    chosen.by_time = s->time[used[n - 2]];
    return chosen;
}

/* U and I of one photosite; I is 0 where it does not serve. */
struct contrast {
    double u, information;
};

static struct contrast contrast_of(const struct frames_of *of, size_t i, double black, double range,
                                   double read2, double slope)
{
    double s0 = 0, s1 = 0, s2 = 0, d0 = 0, d1 = 0;
    const double seen = (double)of->by[i] - black, light = seen > 0 ? seen : 0;
    const double rate = light / of->by_time;
    if (seen >= range || rate * of->time[0] > REACH)
        return (struct contrast){0};
    const double by_variance = (read2 + slope * light) / (of->by_time * of->by_time);
    for (int f = 0; f < of->frames; f++) {
        const double t = of->time[f], signal = rate * t, variance = read2 + slope * signal;
        const double room = range - signal;
        // Six standard deviations below saturation, as predicted: its own noise does not choose.
        if (room < 0 || room * room < 36 * (variance + by_variance * t * t))
            continue;
        const double w = 1 / variance, d = (double)of->dn[f][i] - black;
        s0 += w;
        s1 += w * t;
        s2 += w * t * t;
        d0 += w * d;
        d1 += w * t * d;
    }
    if (!(s2 > 0))
        return (struct contrast){0};
    return (struct contrast){d0 - s1 / s2 * d1, s0 - s1 * s1 / s2};
}

/* What one channel tells; what is 5 standard deviations off moved. */
static struct told find_black(const struct sensor *sensor, int c,
                              const struct bracket_sample *sample, int samples,
                              const bool *left_out)
{
    enum { ROUNDS = 2, COUNT_MIN = 1000, THIN = 8 };
    const double read2 = sensor->read_noise[c] * sensor->read_noise[c], slope = 1 / sensor->gain[c];
    struct told told = {sensor->black[c], INFINITY};
    for (int round = 0; round < ROUNDS; round++) {
        const double black = told.black, range = sensor->usable[c] - black;
        double u = 0, information = 0, count = 0;
        for (int k = 0; k < samples; k++) {
            const struct frames_of of = choose_frames(&sample[k], left_out);
            // A first round of some tells around which level to weigh.
            const bool thin = round < ROUNDS - 1 && sample[k].photosites > THIN * THIN * COUNT_MIN;
            const size_t step = thin ? THIN : 1;
            for (size_t i = 0; i < (of.frames > 1 ? sample[k].photosites : 0); i += step) {
                const struct contrast one = contrast_of(&of, i, black, range, read2, slope);
                if (!(one.information > 0)
                    || one.u * one.u > pow(5 + sqrt(one.information), 2) * one.information)
                    continue;
                u += one.u;
                information += one.information;
                count += (double)step;
            }
        }
        if (count < COUNT_MIN)
            return (struct told){sensor->black[c], INFINITY};
        told = (struct told){black + u / information, 1 / information};
    }
    return told;
}

/* Variance of the channels' true levels: what they scatter more than noise. */
static double between(const struct told told[3])
{
    double w = 0, w2 = 0, mean = 0, q = 0;
    for (int c = 0; c < 3; c++) {
        w += 1 / told[c].variance;
        w2 += 1 / (told[c].variance * told[c].variance);
        mean += told[c].black / told[c].variance;
    }
    mean /= w;
    for (int c = 0; c < 3; c++)
        q += (told[c].black - mean) * (told[c].black - mean) / told[c].variance;
    return fmax(q - 2, 0) / (w - w2 / w);
}

/* Each channel's level, drawn towards the mean of all. */
static void pool(double black[3], const struct told told[3])
{
    const double scatter2 = between(told);
    double w = 0, mean = 0;
    for (int c = 0; c < 3; c++) {
        w += 1 / (told[c].variance + scatter2);
        mean += told[c].black / (told[c].variance + scatter2);
    }
    mean /= w;
    for (int c = 0; c < 3; c++)
        black[c] =
            (told[c].black * scatter2 + mean * told[c].variance) / (told[c].variance + scatter2);
}

void sensor_refine_black(struct sensor *sensor, struct bracket_sample *const sample[3], int samples,
                         const struct sensor_known *known, const bool *left_out)
{
    struct told told[3];
    bool all = !known->encoded && !known->real;
    for (int c = 0; c < 3 && all; c++)  // not known, and noise is not cut off at 0
        all = isnan(known->black[c]) && sensor->black[c] > 5 * sensor->read_noise[c];
    if (!all)
        return;
#pragma omp parallel for num_threads(3)
    for (int c = 0; c < 3; c++)
        told[c] = find_black(sensor, c, sample[c], samples, left_out);
    for (int c = 0; c < 3; c++)
        all = all && isfinite(told[c].variance);
    if (all)
        pool(sensor->black, told);
}
