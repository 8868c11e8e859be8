/* mit_read.c -- the anisotropic tables of MIT, as isotropic BRDFs: their mean over the turns of the
 * sample.
 *
 * Layout.   16 int32: [0..3] how many theta_in, theta_out, phi_diff, phi_in; [6] = 1; [7] = 0, even
 *           steps; [9] = 1: phi_diff spans [0, pi], else [0, 2 pi]; [10] channels, 3. Then float32
 *           [3][theta_in][theta_out][phi_diff][phi_in], negative where nothing was measured; values
 *           belong to the middles of their steps.
 * Source.   A. Ngan, F. Durand, W. Matusik, "Experimental Analysis of BRDF Models", EGSR 2005, and
 *           the tables published with it.
 */
#include "formats.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER = 16, STEPS_MAX = 2048 };

struct mit {
    int size[3];   // theta_in, theta_out, phi_diff
    bool half;     // phi_diff spans half a turn
    float *value;  // [3][theta_in][theta_out][phi_diff], < 0: not measured
};

static void mit_free(void *data)
{
    struct mit *mit = data;
    if (mit)
        free(mit->value);
    free(mit);
}

// The two middles about a place along an axis of `count` steps, and their weights.
static void about(double place, int count, bool around, int index[2], double weight[2])
{
    double x = place - 0.5;
    if (!around)
        x = fmin(fmax(x, 0), count - 1);
    int low = (int)floor(x);
    weight[1] = x - low;
    weight[0] = 1 - weight[1];
    for (int k = 0; k < 2; k++)
        index[k] = around ? (low + k + count) % count : low + k < count ? low + k : count - 1;
}

static void mit_eval(const void *data, vec3 wi, vec3 wo, double f[3])
{
    const struct mit *mit = data;
    double phi = fabs(atan2(wi.x * wo.y - wi.y * wo.x, wi.x * wo.x + wi.y * wo.y));
    double span = mit->half ? CAP_PI : 2 * CAP_PI, weights[3] = {0, 0, 0};
    int index[3][2];
    double weight[3][2];
    about(atan2(hypot(wi.x, wi.y), wi.z) / (CAP_PI / 2) * mit->size[0], mit->size[0], false,
          index[0], weight[0]);
    about(atan2(hypot(wo.x, wo.y), wo.z) / (CAP_PI / 2) * mit->size[1], mit->size[1], false,
          index[1], weight[1]);
    about(phi / span * mit->size[2], mit->size[2], !mit->half, index[2], weight[2]);
    f[0] = f[1] = f[2] = 0;
    for (int k = 0; k < 8; k++)
        for (int c = 0; c < 3; c++) {
            int i = k >> 2, j = k >> 1 & 1, l = k & 1;
            size_t at =
                (((size_t)c * (size_t)mit->size[0] + (size_t)index[0][i]) * (size_t)mit->size[1]
                 + (size_t)index[1][j])
                    * (size_t)mit->size[2]
                + (size_t)index[2][l];
            double w = weight[0][i] * weight[1][j] * weight[2][l];
            if (mit->value[at] < 0 || w <= 0)
                continue;
            f[c] += w * (double)mit->value[at];
            weights[c] += w;
        }
    for (int c = 0; c < 3; c++)
        f[c] = weights[c] > 0 ? f[c] / weights[c] : 0;
}

static const struct brdf_kind mit_kind = {"MIT table", mit_eval, mit_free};

// The mean of the measured ones; -1: none is.
static float mean_of(const float *value, int count)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < count; i++)
        if (value[i] >= 0) {
            sum += (double)value[i];
            n++;
        }
    return n ? (float)(sum / n) : -1;
}

static enum status read_values(struct mit *mit, int turns, FILE *file, const char *path,
                               struct error *err)
{
    size_t count = 3 * (size_t)mit->size[0] * (size_t)mit->size[1] * (size_t)mit->size[2];
    float *row = malloc((size_t)turns * sizeof *row);
    mit->value = malloc(count * sizeof *mit->value);
    enum status status =
        row && mit->value ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    for (size_t i = 0; i < count && !status; i++) {
        if (fread(row, sizeof *row, (size_t)turns, file) != (size_t)turns)
            status = cap_fail(err, STATUS_FORMAT, "%s: cut short: its header promises more", path);
        else
            mit->value[i] = mean_of(row, turns);
        if (!status && !isfinite(mit->value[i]))
            status = cap_fail(err, STATUS_FORMAT, "%s: value %zu is not a number", path, i);
    }
    if (!status && fgetc(file) != EOF)
        status = cap_fail(err, STATUS_FORMAT, "%s: bytes follow the table's last value", path);
    free(row);
    return status;
}

// The file is as long as its header promises: nothing is allocated for a header of lies.
static bool long_enough(const int32_t header[HEADER], FILE *file)
{
    double wanted = sizeof(int32_t) * HEADER;
    double numbers = 3;
    for (int i = 0; i < 4; i++)
        numbers *= header[i];
    wanted += numbers * sizeof(float);
    bool enough = fseek(file, 0, SEEK_END) == 0 && (double)ftell(file) >= wanted;
    return fseek(file, sizeof(int32_t) * HEADER, SEEK_SET) == 0 && enough;
}

static enum status mit_read(struct brdf *brdf, const char *path, struct error *err)
{
    int32_t header[HEADER];
    FILE *file = fopen(path, "rb");
    if (!file)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    struct mit *mit = calloc(1, sizeof *mit);
    enum status status = STATUS_OK;
    if (!mit)
        status = cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    else if (fread(header, sizeof header, 1, file) != 1 || !long_enough(header, file))
        status = cap_fail(err, STATUS_FORMAT, "%s: cut short: its header promises more", path);
    else {
        *mit = (struct mit){.size = {header[0], header[1], header[2]}, .half = header[9] == 1};
        status = read_values(mit, header[3], file, path, err);
    }
    fclose(file);
    if (status)
        mit_free(mit);
    else
        *brdf = (struct brdf){.kind = &mit_kind, .data = mit};
    return status;
}

static bool mit_probe(const char *start, size_t size)
{
    int32_t h[HEADER];
    if (size < sizeof h)
        return false;
    memcpy(h, start, sizeof h);
    for (int i = 0; i < 4; i++)
        if (h[i] < 1 || h[i] > STEPS_MAX)
            return false;
    return h[6] == 1 && h[7] == 0 && (h[9] == 0 || h[9] == 1) && h[10] == 3;
}

const struct format rec_format_mit = {"MIT anisotropic table, its isotropic part", mit_probe,
                                      mit_read};
