/* times.c -- exposure times as the photosites saw them.
 *
 * Stated times are nominal: 1/30 s means 1/32 s, and shutters are off by some per cent. The ratio
 * of two frames of a bracket is seen by all photosites that are well exposed in both,
 *
 *     l = ln(sum d_long / sum d_short) - ln(stated ratio),
 *
 * over those whose d_short + d_long lies in a range: for photon noise that sum is independent of
 * how the two differ from their ratio, so that noise does not choose. Photosites further than 5
 * standard deviations off (something moved) are left out. A bright million photosites tell l to
 * 10^-5.
 *
 * A camera does the same at the same setting: l of frames j and k is c_j - c_k, one number a stated
 * time for the whole capture, found by robust least squares over all shots; sum c = 0 over the
 * settings, since one common factor is no business of ratios. So shots with different brackets, and
 * single photographs, keep their scale to each other: each gets the c of its own setting. What then
 * is left in a shot beyond noise is the jitter of the shutter (or of the lamp) e: it is estimated
 * with the prior of its own size, mean 0 over the shot, so that it cannot change the shot's scale
 * more than it changed in fact.
 *
 * Of photographs whose curve was recovered from the same brackets, a common power of all times is
 * left as it is stated.
 *
 * Accuracy. Noise, and non-linearity of the sensor (10^-4 is assumed). Where c = 0 explains the
 *           photographs as well, c is 0.
 */
#include "times.h"
#include "solve.h"

#include <stdlib.h>
#include <string.h>

enum { SETTINGS_MAX = 128 };

// What no sensor does better than, in ln of a ratio.
static const double floor_sigma = 1e-4;
static const double CURVE_SIGMAS = 3;  // of a recovered curve, which c has to be off to be real

/* What one pair of neighbouring frames tells. */
struct pair {
    int sample, frame;  // frame and the one before it
    int setting[2];     // of the one before, and of frame
    double l, sigma;
};

struct ratio_sums {
    double a, b, square, count;
};

/* Sums over the photosites whose a + b lies in [low, high]; reach2 is 25 times the variance of a
 * photosite's residual over its signal. */
static void add_photosites(struct ratio_sums *sums, const struct bracket_sample *s, int f,
                           double black, double low, double high, double ratio, double reach2)
{
    for (size_t i = 0; i < s->photosites; i++) {
        double a = (double)s->dn[f - 1][i] - black, b = (double)s->dn[f][i] - black;
        double rest = b - ratio * a, signal = a + b;
        if (!(signal > low && signal < high) || rest * rest > reach2 * signal)
            continue;
        sums->a += a;
        sums->b += b;
        sums->square += rest * rest / signal;
        sums->count++;
    }
}

/* false: too few photosites are bright in both. */
static bool measure_pair(struct pair *pair, const struct sample_set *set,
                         const struct sensor *sensor)
{
    enum { PASSES = 3, COUNT_MIN = 500 };
    const struct bracket_sample *any = &set->channel[0][pair->sample];
    int f = pair->frame;
    double stated = any->time[f] / any->time[f - 1], ratio = stated, reach2 = INFINITY;
    struct ratio_sums sums = {0};
    for (int pass = 0; pass < PASSES; pass++) {
        sums = (struct ratio_sums){0};
        for (int c = 0; c < 3; c++) {
            double range = fmin(sensor->usable[c], sensor->white[c]) - sensor->black[c];
            add_photosites(&sums, &set->channel[c][pair->sample], f, sensor->black[c], 0.1 * range,
                           0.9 * range, ratio, reach2);
        }
        if (sums.count < COUNT_MIN || !(sums.a > 0) || !(sums.b > 0))
            return false;
        ratio = sums.b / sums.a;
        reach2 = 25 * sums.square / sums.count;
    }
    if (!(ratio > 0.7 * stated && ratio < 1.4 * stated))
        return false;  // no shutter is that wrong: another lamp, another scene
    // The residuals' own scatter is the noise: var(b - r a) = square / count times the signal.
    double noise = sqrt(sums.square / sums.count * (sums.a + sums.b)) / sums.b;
    pair->l = log(ratio / stated);
    pair->sigma = hypot(noise, floor_sigma);
    return true;
}

/* The settings that occur. */
struct settings {
    double time[SETTINGS_MAX], c[SETTINGS_MAX];
    int count;
};

static int setting_of(struct settings *settings, double stated)
{
    for (int k = 0; k < settings->count; k++)
        if (fabs(settings->time[k] - stated) < 0.001 * stated)
            return k;
    if (settings->count == SETTINGS_MAX)
        return -1;
    settings->time[settings->count] = stated;
    return settings->count++;
}

static double residual(const struct pair *pair, const double *c)
{
    return pair->l - (c[pair->setting[1]] - c[pair->setting[0]]);
}

/* Robust least squares for c; jitter is that of one exposure. */
static bool fit_settings(double *c, int n, const struct pair *pair, int pairs, double jitter)
{
    enum { ROUNDS = 10 };
    double *a = malloc((size_t)n * n * sizeof *a), *b = malloc((size_t)n * sizeof *b);
    bool ok = a && b;
    memset(c, 0, (size_t)n * sizeof *c);
    for (int round = 0; round < ROUNDS && ok; round++) {
        memset(a, 0, (size_t)n * n * sizeof *a);
        memset(b, 0, (size_t)n * sizeof *b);
        for (int k = 0; k < n; k++)  // sum c = 0 of whatever hangs together
            a[k * n + k] = 1;
        for (int p = 0; p < pairs; p++) {
            int i = pair[p].setting[0], j = pair[p].setting[1];
            double variance = pair[p].sigma * pair[p].sigma + 2 * jitter * jitter;
            double rest = residual(&pair[p], c);
            // Cauchy's weights, from the second round on; 2.4 keeps 95 % of the precision.
            double t = rest * rest / (2.4 * 2.4 * variance);
            double w = 1 / (variance * (round > 0 ? 1 + t : 1));
            a[i * n + i] += w;
            a[j * n + j] += w;
            a[i * n + j] -= w;
            a[j * n + i] -= w;
            b[j] += w * pair[p].l;
            b[i] -= w * pair[p].l;
        }
        ok = solve_spd(a, b, n);
        if (ok)
            memcpy(c, b, (size_t)n * sizeof *c);
    }
    free(a);
    free(b);
    return ok;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Standard deviation of one exposure's own error, from what c leaves: robust, noise taken off. */
static double find_jitter(const struct pair *pair, int pairs, const double *c, int settings)
{
    double *rest = malloc((size_t)pairs * sizeof *rest), noise2 = 0;
    if (!rest || pairs < 2 * settings) {
        free(rest);
        return 0;  // c has taken it all
    }
    for (int p = 0; p < pairs; p++) {
        rest[p] = fabs(residual(&pair[p], c));
        noise2 += pair[p].sigma * pair[p].sigma / pairs;
    }
    qsort(rest, (size_t)pairs, sizeof *rest, by_value);
    double spread = 1.4826 * rest[pairs / 2];
    free(rest);
    // With as many parameters as settings, residuals are that much too small.
    double variance = spread * spread * pairs / (pairs - settings + 1) - noise2;
    return variance > noise2 ? sqrt(variance / 2) : 0;  // twice the noise is no accident
}

/* Jitter of the frames of one sample, added to ln seconds. */
static void add_jitter(double *log_time, int frames, int sample, const struct pair *pair, int pairs,
                       const double *c, double jitter)
{
    double a[64 * 64] = {0}, b[64] = {0};
    if (frames > 64 || jitter <= 0)
        return;
    for (int f = 0; f < frames; f++)
        a[f * frames + f] = 1 / (jitter * jitter);
    for (int p = 0; p < pairs; p++) {
        if (pair[p].sample != sample)
            continue;
        int i = pair[p].frame - 1, j = pair[p].frame;
        double w = 1 / (pair[p].sigma * pair[p].sigma), rest = residual(&pair[p], c);
        a[i * frames + i] += w;
        a[j * frames + j] += w;
        a[i * frames + j] -= w;
        a[j * frames + i] -= w;
        b[j] += w * rest;
        b[i] -= w * rest;
    }
    if (solve_spd(a, b, frames))
        for (int f = 0; f < frames; f++)
            log_time[f] += b[f];
}

/* Is c better than 0 by more than noise would make it? Twice chi^2's mean, and 9 for one. */
static bool is_significant(const struct pair *pair, int pairs, const double *c, int n,
                           double jitter)
{
    static const double none[SETTINGS_MAX];
    double gain = 0;
    for (int p = 0; p < pairs; p++) {
        double variance = pair[p].sigma * pair[p].sigma + 2 * jitter * jitter;
        gain += (pow(residual(&pair[p], none), 2) - pow(residual(&pair[p], c), 2)) / variance;
    }
    return gain > 9 + 2 * n;
}

static double largest(const double *c, int n)
{
    double most = 0;
    for (int k = 0; k < n; k++)
        most = fmax(most, fabs(c[k]));
    return most;
}

static int measure_pairs(struct pair *pair, struct settings *settings, const double *stated,
                         const struct sample_set *set, const struct sensor *sensor, int threads)
{
    int candidates = 0, pairs = 0;
    for (int k = 0; k < set->samples; k++) {
        const struct bracket_sample *s = &set->channel[0][k];
        for (int f = 0; f < s->frames; f++)
            setting_of(settings, stated[s->photo[f]]);
        for (int f = 1; f < s->frames; f++) {
            struct pair p = {.sample = k, .frame = f};
            p.setting[0] = setting_of(settings, stated[s->photo[f - 1]]);
            p.setting[1] = setting_of(settings, stated[s->photo[f]]);
            if (p.setting[0] >= 0 && p.setting[1] >= 0 && p.setting[0] != p.setting[1])
                pair[candidates++] = p;
        }
    }
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (int p = 0; p < candidates; p++)
        if (!measure_pair(&pair[p], set, sensor))
            pair[p].sigma = INFINITY;
    for (int p = 0; p < candidates; p++)
        if (isfinite(pair[p].sigma))
            pair[pairs++] = pair[p];
    return pairs;
}

/* Values and times raised to the same power agree as well: what part of c grows with ln t is taken
 * out of it, and out of what the pairs tell. */
static void take_power_out(struct settings *settings, struct pair *pair, int pairs)
{
    double mean = 0, tt = 0, tc = 0;
    for (int k = 0; k < settings->count; k++)
        mean += log(settings->time[k]) / settings->count;
    for (int k = 0; k < settings->count; k++) {
        double t = log(settings->time[k]) - mean;
        tt += t * t;
        tc += t * settings->c[k];
    }
    const double power = tt > 0 ? tc / tt : 0;
    for (int k = 0; k < settings->count; k++)
        settings->c[k] -= power * (log(settings->time[k]) - mean);
    for (int p = 0; p < pairs; p++) {
        const int *at = pair[p].setting;
        pair[p].l -= power * log(settings->time[at[1]] / settings->time[at[0]]);
    }
}

/* The pairs' l are relative to the times before; c and e are to be relative to the stated ones. */
static void refer_to_stated(struct pair *pair, int pairs, const double *stated,
                            const struct sample_set *set)
{
    for (int p = 0; p < pairs; p++) {
        const struct bracket_sample *s = &set->channel[0][pair[p].sample];
        int f = pair[p].frame;
        pair[p].l +=
            log(s->time[f] / s->time[f - 1]) - log(stated[s->photo[f]] / stated[s->photo[f - 1]]);
    }
}

static void apply(double *seconds, const double *stated, int photos, struct settings *settings,
                  const struct pair *pair, int pairs, double jitter, struct sample_set *set)
{
    for (int i = 0; i < photos; i++)  // also photographs that were not sampled, of known settings
        for (int k = 0; k < settings->count; k++)
            if (fabs(settings->time[k] - stated[i]) < 0.001 * stated[i])
                seconds[i] = stated[i] * exp(settings->c[k]);
    for (int k = 0; k < set->samples; k++) {
        const struct bracket_sample *s = &set->channel[0][k];
        double log_time[64] = {0};
        add_jitter(log_time, s->frames, k, pair, pairs, settings->c, jitter);
        for (int f = 0; f < s->frames && f < 64; f++)
            seconds[s->photo[f]] *= exp(log_time[f]);
        for (int c = 0; c < 3; c++)
            for (int f = 0; f < s->frames; f++)
                set->channel[c][k].time[f] = seconds[s->photo[f]];
    }
}

bool times_estimate(double *seconds, const double *stated, int photos, struct sample_set *set,
                    const struct sensor *sensor, double curve_sigma, int threads)
{
    size_t room = 1;
    for (int k = 0; k < set->samples; k++)
        room += (size_t)set->channel[0][k].frames;
    struct settings settings = {0};
    struct pair *pair = calloc(room, sizeof *pair);
    double *before = malloc((size_t)photos * sizeof *before), change = 0;
    int pairs = pair && before ? measure_pairs(pair, &settings, stated, set, sensor, threads) : 0;
    if (pairs > 0) {
        memcpy(before, seconds, (size_t)photos * sizeof *before);
        refer_to_stated(pair, pairs, stated, set);
        double jitter = 0;
        bool ok = fit_settings(settings.c, settings.count, pair, pairs, 0);
        if (ok) {
            jitter = find_jitter(pair, pairs, settings.c, settings.count);
            ok = fit_settings(settings.c, settings.count, pair, pairs, jitter);
        }
        if (ok && curve_sigma > 0)
            take_power_out(&settings, pair, pairs);
        if (!ok || !is_significant(pair, pairs, settings.c, settings.count, jitter)
            || largest(settings.c, settings.count) < CURVE_SIGMAS * curve_sigma)
            memset(settings.c, 0, sizeof settings.c);
        apply(seconds, stated, photos, &settings, pair, pairs, jitter, set);
        for (int i = 0; i < photos; i++)
            change = fmax(change, fabs(seconds[i] / before[i] - 1));
    }
    free(before);
    free(pair);
    return change > 0.1 * floor_sigma;
}
