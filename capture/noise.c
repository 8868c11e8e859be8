/* noise.c -- gain and read noise of a sensor by photon transfer between frames of a bracket.
 *
 * For a photosite in two frames whose times have the ratio R, the difference d = v_long - R v_short
 * (both less black) is free of the scene, and
 *
 *     var d / (1 + R^2) = read^2 + z / gain,   z = s_long (1 + R) / (1 + R^2),
 *
 * in DN and electrons a DN: a line, fitted through bins of z. A photosite's bin must not depend on
 * the noise in d, or bins would be chosen by d: it is told by v_long + k v_short with
 * k = var v_long / (R var v_short), which makes both uncorrelated, from the line found before
 * (k = 1, photon noise alone, at first). d's mean in a bin is taken off, so that wrong times and a
 * non-linear sensor do no harm. Read noise holds the converter's rounding as well.
 *
 * J. Janesick, "Photon Transfer", SPIE, 2007.
 */
#include "sensor.h"

#include <stdlib.h>
#include <string.h>

enum { BINS = 72, BIN_MIN = 50 };  // quarters of an octave; a variance of 50 is good to 20 %

struct bin {
    double count, zeros, sum_z, sum, sum2;
    double mean, deviation;  // of the pass before; deviation 0: none yet
};

/* variance of DN = offset + slope signal. */
struct line {
    double offset, slope;
};

static int bin_of(double z)
{
    // Quarters of an octave begin at 2^(k/4); a number's own bits hold the octave.
    uint64_t bits;
    if (!(z >= 1))
        return 0;
    memcpy(&bits, &z, sizeof bits);
    const int octave = (int)(bits >> 52) - 1023;
    bits = (bits & ((UINT64_C(1) << 52) - 1)) | UINT64_C(1023) << 52;
    double m;  // in [1, 2)
    memcpy(&m, &bits, sizeof m);
    int bin = 4 * octave + 1 + (m >= 1.189207115002721) + (m >= 1.4142135623730951)
              + (m >= 1.681792830507429);
    return bin < BINS ? bin : BINS - 1;
}

/* The ratio of two exposures as the photosites see it: EXIF times are nominal, 1/30 s is 1/32 s. */
static double seen_ratio(const struct sensor *sensor, int c, const struct bracket_sample *s, int f)
{
    double nominal = s->time[f] / s->time[f - 1], sum_short = 0, sum_long = 0;
    double high = 0.9 * (sensor->usable[c] - sensor->black[c]);
    for (size_t i = 0; i < s->photosites; i++) {
        double a = (double)s->dn[f - 1][i] - sensor->black[c];
        double b = (double)s->dn[f][i] - sensor->black[c];
        if (b + a > high || b > sensor->usable[c] - sensor->black[c])
            continue;
        sum_short += a;
        sum_long += b;
    }
    double ratio = sum_long / sum_short;
    return ratio > 0.8 * nominal && ratio < 1.25 * nominal ? ratio : nominal;
}

static void add_pair(struct bin *bin, struct line noise, const struct sensor *sensor, int c,
                     const struct bracket_sample *s, int f, double ratio, size_t stride,
                     double reach)
{
    double black = sensor->black[c];
    double to_z = (1 + ratio) / (1 + ratio * ratio);
    double scale = 1 / sqrt(1 + ratio * ratio);
    // Photon noise must not reach into saturation: 10 % are 4 standard deviations and more for
    // every sensor that holds 1600 electrons.
    double high = 0.9 * (sensor->usable[c] - black);
    const float *dn_short = s->dn[f - 1], *dn_long = s->dn[f];
    for (size_t i = 0; i < s->photosites; i += stride) {
        double a = (double)dn_short[i] - black, b = (double)dn_long[i] - black;
        double photons = b > 0 ? noise.slope * b : 0;
        double k = noise.offset + photons <= 0
                       ? 1
                       : (noise.offset + photons) / (ratio * noise.offset + photons);
        double signal = (b + k * a) / (1 + k / ratio);
        if (signal > high || b > sensor->usable[c] - black)
            continue;
        struct bin *to = &bin[bin_of(signal * to_z)];
        double d = (b - ratio * a) * scale;
        if (to->deviation > 0 && fabs(d - to->mean) > reach * to->deviation)
            continue;
        to->count++;
        to->zeros += dn_short[i] <= 0 || dn_long[i] <= 0;
        to->sum_z += signal * to_z;
        to->sum += d;
        to->sum2 += d * d;
    }
}

/* Ratios of the exposures of all pairs of frames, in the order of fill_bins(); 0: too near to 1. */
static double *seen_ratios(const struct sensor *sensor, int c, const struct bracket_sample *sample,
                           int samples)
{
    size_t pairs = 0;
    for (int k = 0; k < samples; k++)
        pairs += (size_t)sample[k].frames;
    double *ratio = calloc(pairs + 1, sizeof *ratio), *next = ratio;
    for (int k = 0; ratio && k < samples; k++)
        for (int f = 1; f < sample[k].frames; f++)
            *next++ = sample[k].time[f] > 1.2 * sample[k].time[f - 1]
                          ? seen_ratio(sensor, c, &sample[k], f)
                          : 0;
    return ratio;
}

static void fill_bins(struct bin *bin, struct line noise, const struct sensor *sensor, int c,
                      const struct bracket_sample *sample, int samples, const double *ratio,
                      double reach, size_t enough)
{
    enum { PASSES = 3 };
    size_t total = 0;
    for (int k = 0; k < samples; k++)
        total += sample[k].photosites * (size_t)sample[k].frames;
    size_t stride = 1 + total / enough;
    memset(bin, 0, BINS * sizeof *bin);
    for (int pass = 0; pass < PASSES; pass++) {
        for (int b = 0; b < BINS; b++)
            bin[b] = (struct bin){.mean = bin[b].mean, .deviation = bin[b].deviation};
        const double *next = ratio;
        for (int k = 0; k < samples; k++)
            for (int f = 1; f < sample[k].frames; f++, next++)
                if (*next > 0)
                    add_pair(bin, noise, sensor, c, &sample[k], f, *next, stride, reach);
        for (int b = 0; b < BINS; b++) {
            if (bin[b].count == 0)
                continue;
            bin[b].mean = bin[b].sum / bin[b].count;
            double variance = bin[b].sum2 / bin[b].count - bin[b].mean * bin[b].mean;
            bin[b].deviation = sqrt(fmax(variance, 1e-6));
        }
    }
}

/* variance = offset + slope z, each bin weighted by the variance of its variance: 2 v^2 / n, and
 * 3 % for what no line describes (rounding of a noise below 1 DN, compression). */
static bool fit_line(const struct bin *bin, double floor, struct line *line)
{
    double a = 0, b = 0;
    for (int round = 0; round < 4; round++) {
        double s = 0, sz = 0, szz = 0, sv = 0, szv = 0;
        int used = 0;
        for (int k = 0; k < BINS; k++) {
            double v = bin[k].deviation * bin[k].deviation;
            if (bin[k].count < BIN_MIN || bin[k].zeros > 0.01 * bin[k].count || v < floor)
                continue;
            double z = bin[k].sum_z / bin[k].count;
            double model = round == 0 ? v : fmax(a + b * z, floor);
            double w = 1 / ((2 / bin[k].count + 0.03 * 0.03) * model * model);
            s += w;
            sz += w * z;
            szz += w * z * z;
            sv += w * v;
            szv += w * z * v;
            used++;
        }
        double determinant = s * szz - sz * sz;
        if (used < 3 || !(determinant > 0))
            return false;
        b = (s * szv - sz * sv) / determinant;
        a = (sv - b * sz) / s;
    }
    *line = (struct line){fmax(a, floor), b};
    return b > 0;
}

/* Rounding alone, in DN^2: that of the converter, or of the lowest sRGB codes. */
static double rounding(const struct sensor_known *known)
{
    double step = known->encoded ? 65535 / 255.0 / 12.92 : known->real ? 1e-3 : 1;
    return step * step / 12;
}

void sensor_find_noise(struct sensor *sensor, int c, const struct bracket_sample *sample,
                       int samples, const struct sensor_known *known, struct sensor_doubts *doubts)
{
    enum { ROUNDS = 3, ENOUGH = 300000 };  // photosites, all frames together
    struct bin bin[BINS];
    struct line noise = {0, 1};
    double *ratio = seen_ratios(sensor, c, sample, samples);
    bool found = ratio != NULL;
    // What is 5 standard deviations off moved; but the errors of JPEG have long tails themselves.
    double reach = known->encoded ? 20 : 5;
    for (int round = 0; round < ROUNDS && found; round++) {
        // The line before the last is only to choose bins by: a few per cent off is near enough.
        fill_bins(bin, noise, sensor, c, sample, samples, ratio, reach,
                  round < ROUNDS - 1 ? ENOUGH / 4 : ENOUGH);
        found = fit_line(bin, rounding(known), &noise);
    }
    free(ratio);
    if (!found) {
        // The middle of the road: a full well of 20000 electrons, and read noise of 5.
        sensor->gain[c] = 20000 / (sensor->white[c] - sensor->black[c]);
        sensor->read_noise[c] = hypot(5 / sensor->gain[c], sqrt(rounding(known)));
        doubts->noise = doubts->noise || isnan(known->gain);
    } else {
        sensor->gain[c] = 1 / noise.slope;
        sensor->read_noise[c] = sqrt(noise.offset);
    }
    if (!isnan(known->gain))
        sensor->gain[c] = known->gain;
    if (!isnan(known->read_noise))
        sensor->read_noise[c] = hypot(known->read_noise / sensor->gain[c], sqrt(rounding(known)));
}
