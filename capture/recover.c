/* recover.c -- the response curve of encoded photographs, recovered from brackets.
 *
 * Method.   With g(z) the logarithm of the exposure that code z stands for, a photosite of radiance
 *           e^L shows codes z_f in frames of t_f seconds, g(z_f) = L + ln t_f. All photosites of
 * all shots together are a linear least-squares problem in g, a channel at a time, once each
 *           photosite's L is eliminated (Debevec and Malik 1997, who took some hundred pixels; the
 *           normal equations have 256 unknowns for any number). What is solved for is h, the
 *           difference from sRGB's logarithm: its second difference is what the smoothness prior
 *           holds down, so that codes without data follow the usual shape. Weights are those of a
 *           code's noise, (dg/dz)^-2 of the curve found before; codes at the ends are not used.
 *           Pool-adjacent-violators makes the result increase.
 * Scale.    One factor a channel is free; the mean of h over the data is 0, so the curve stays near
 *           that of sRGB, and the same for all shots.
 * Accuracy. Even and odd shots are also solved for by themselves: half of their rms difference is
 *           the curve's standard deviation. Exposure times are taken as stated: a curve and times
 *           raised to the same power explain brackets as well.
 *
 * P. Debevec and J. Malik, "Recovering High Dynamic Range Radiance Maps from Photographs", SIGGRAPH
 * 1997; M. Robertson, S. Borman and R. Stevenson, "Dynamic Range Improvement through Multiple
 * Exposures", ICIP 1999.
 */
#include "recover.h"
#include "solve.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { CODES = 256, LOWEST = 4, HIGHEST = 235 };  // codes beyond: cut off, or rings of JPEG there

// Frames whose times have the ratio R say nothing of a ripple of h that repeats when the exposure
// grows by R: at R = 4, every 120 codes near white, every 15 near code 16. Its second difference,
// 0.003 and 0.2 of its height, has to cost more than it gains by fitting the noise of the data,
// some 10^-4 of their sum of squares; a curve of another make (h changes by 0.3 over 100 codes, h''
// is 10^-4; more in the toe) must cost less than the 10^-1 that it gains.
static const double smoothness = 30;

/* Normal equations of one channel. */
struct normal {
    double a[CODES][CODES], b[CODES], data[CODES];
};

static void add_photosite(struct normal *n, const struct bracket_sample *s, size_t i,
                          const double *log_time, const double *g0, const double *weight)
{
    int code[64], used = 0;
    double w[64], y[64], total = 0;
    for (int f = 0; f < s->frames && f < 64; f++) {
        int z = (int)s->dn[f][i];
        if (z < LOWEST || z > HIGHEST)
            continue;
        code[used] = z;
        w[used] = weight[z];
        y[used] = log_time[f] - g0[z];  // what h(z) - L has to be
        total += w[used++];
    }
    if (used < 2)
        return;
    // Minimise sum w (h - L - y)^2 over L: the matrix diag(w) - w w' / total.
    double mean = 0;
    for (int k = 0; k < used; k++)
        mean += w[k] * y[k] / total;
    for (int k = 0; k < used; k++) {
        n->b[code[k]] += w[k] * (y[k] - mean);
        n->a[code[k]][code[k]] += w[k];
        n->data[code[k]] += w[k];
        for (int j = 0; j < used; j++)
            n->a[code[k]][code[j]] -= w[k] * w[j] / total;
    }
}

/* Noise of a code is about constant: the weight of its logarithm is (dg/dz)^-2. */
static void set_weights(double weight[CODES], const double *g)
{
    for (int z = LOWEST; z <= HIGHEST; z++) {
        double slope = fmax((g[z + 2] - g[z - 2]) / 4, 1e-4);
        weight[z] = 1e-4 / (slope * slope);
    }
}

/* part 0: all shots; 1, 2: odd or even ones. false: no data. */
static bool solve_curve(double g[CODES], const struct bracket_sample *sample, int samples, int part,
                        const double *g0, const double *weight, struct normal *n)
{
    memset(n, 0, sizeof *n);
    for (int k = 0; k < samples; k++) {
        double log_time[64];
        const struct bracket_sample *s = &sample[k];
        if (part > 0 && k % 2 != part - 1)
            continue;
        for (int f = 0; f < s->frames && f < 64; f++)
            log_time[f] = log(s->time[f]);
        for (size_t i = 0; i < s->photosites; i++)
            add_photosite(n, s, i, log_time, g0, weight);
    }
    double total = 0;
    for (int z = 0; z < CODES; z++)
        total += n->data[z];
    if (!(total > 0))
        return false;
    for (int z = 1; z < CODES - 1; z++) {
        double stiffness = smoothness * total * pow(fmin(z / 64.0, 1), 4);
        for (int i = -1; i <= 1; i++)
            for (int j = -1; j <= 1; j++)
                n->a[z + i][z + j] += stiffness * (i ? 1 : -2) * (j ? 1 : -2);
    }
    for (int z = 0; z < CODES; z++) {
        n->a[z][z] += 1e-9 * total;
        for (int j = 0; j < CODES; j++)  // the mean of h over the data is 0
            n->a[z][j] += n->data[z] * n->data[j] / total;
    }
    double h[CODES];
    memcpy(h, n->b, sizeof h);
    if (!solve_spd(&n->a[0][0], h, CODES))
        return false;
    for (int z = 0; z < CODES; z++)
        g[z] = g0[z] + h[z];
    return true;
}

/* The increasing curve nearest to g (pool adjacent violators). */
static void make_monotone(double g[CODES])
{
    double mean[CODES];
    int size[CODES], pools = 0;
    for (int z = 0; z < CODES; z++) {
        mean[pools] = g[z];
        size[pools++] = 1;
        for (; pools > 1 && mean[pools - 2] > mean[pools - 1]; pools--) {
            int a = size[pools - 2], b = size[pools - 1];
            mean[pools - 2] = (a * mean[pools - 2] + b * mean[pools - 1]) / (a + b);
            size[pools - 2] = a + b;
        }
    }
    for (int p = 0, z = 0; p < pools; p++)
        for (int k = 0; k < size[p]; k++)
            g[z++] = mean[p];
}

static bool recover_channel(struct curve *curve, int c, const struct bracket_sample *sample,
                            int samples, struct normal *n)
{
    enum { ROUNDS = 2 };
    double g0[CODES], g[CODES], half[2][CODES], weight[CODES] = {0};
    struct curve srgb;
    response_known(&srgb, RESPONSE_SRGB);
    for (int z = 0; z < CODES; z++)
        g[z] = g0[z] = log(fmax((double)srgb.dn[0][z], 0.25 * (double)srgb.dn[0][1]));
    for (int round = 0; round < ROUNDS; round++) {
        set_weights(weight, g);
        if (!solve_curve(g, sample, samples, 0, g0, weight, n))
            return false;
        make_monotone(g);
    }
    double data[CODES], difference2 = 0, total = 0;
    memcpy(data, n->data, sizeof data);
    bool halves = true;
    for (int part = 1; part <= 2; part++)
        halves = halves && samples > 1
                 && solve_curve(half[part - 1], sample, samples, part, g0, weight, n);
    for (int z = LOWEST; z <= HIGHEST && halves; z++) {
        difference2 += data[z] * pow((half[0][z] - half[1][z]) / 2, 2);
        total += data[z];
    }
    // One shot cannot be halved: 1 %, what such curves are worth in general.
    curve->relative[c] = halves ? sqrt(difference2 / total) : 0.01;
    for (int z = 0; z < CODES; z++)
        curve->dn[c][z] = z == 0 ? 0 : (float)exp(g[z]);
    return true;
}

bool response_recover(struct curve *curve, const struct sample_set *set)
{
    struct curve made = {0};
    bool ok = true;
#pragma omp parallel for num_threads(3)
    for (int c = 0; c < 3; c++) {
        struct normal *n = malloc(sizeof *n);
        bool mine = n && recover_channel(&made, c, set->channel[c], set->samples, n);
        free(n);
#pragma omp critical(response_recovered)
        ok = ok && mine;
    }
    if (ok)
        *curve = made;
    return ok;
}

enum status response_read(struct curve *curve, const char *path, struct error *err)
{
    struct curve made = {0};
    FILE *file = fopen(path, "r");
    if (!file)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    char line[200];
    int codes = 0;
    bool ok = true;
    while (ok && fgets(line, sizeof line, file)) {
        int code;
        float v[3];
        double relative[3];
        if (sscanf(line, "# relative %lf %lf %lf", &relative[0], &relative[1], &relative[2]) == 3)
            memcpy(made.relative, relative, sizeof relative);
        if (line[0] == '#' || line[0] == '\n')
            continue;
        ok = sscanf(line, "%d %f %f %f", &code, &v[0], &v[1], &v[2]) == 4 && code == codes
             && codes < CODES;
        for (int c = 0; c < 3 && ok; c++) {
            ok = v[c] >= 0 && v[c] < 1e6f && (codes == 0 || v[c] >= made.dn[c][codes - 1]);
            made.dn[c][codes] = v[c];
        }
        codes++;
    }
    fclose(file);
    if (!ok || codes != CODES)
        return cap_fail(err, STATUS_FORMAT,
                        "%s: line %d is not `code red green blue` with codes 0 to 255 in order and "
                        "values that do not fall",
                        path, codes);
    *curve = made;
    return STATUS_OK;
}

enum status response_write(const struct curve *curve, const char *path, struct error *err)
{
    struct atomic_file file;
    enum status status = cap_file_begin(&file, path, true, err);
    if (status)
        return status;
    fprintf(file.stream, "# goniocam response: code, linear red, green, blue (65535 is full)\n");
    fprintf(file.stream, "# relative %.3g %.3g %.3g\n", curve->relative[0], curve->relative[1],
            curve->relative[2]);
    for (int z = 0; z < CODES; z++)
        fprintf(file.stream, "%d %.7g %.7g %.7g\n", z, (double)curve->dn[0][z],
                (double)curve->dn[1][z], (double)curve->dn[2][z]);
    return cap_file_commit(&file, err);
}
