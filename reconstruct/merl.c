/* merl.c -- the table of the MERL database: its bins, and its files.
 *
 * Layout.   int32 {90, 90, 180}, then double [3][90][90][180], little-endian, all red before all
 *           green before all blue, each divided by its channel's scale. Negative: no value.
 * Accuracy. f / scale * scale is within one rounding of f.
 */
#include "brdf.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

// File units to 1/sr, for red, green, blue: BRDFRead.cpp, published with the data.
static const double scale[3] = {1.00 / 1500, 1.15 / 1500, 1.66 / 1500};

// The whole part of x, kept to the bins 0 .. bins - 1.
static int bin_of(double x, int bins)
{
    return x < 0 ? 0 : x < bins ? (int)x : bins - 1;
}

const struct grid rec_merl_grid = {MERL_THETA_H, MERL_THETA_D, MERL_PHI_D};

int rec_grid_index(struct grid g, half_diff angles)
{
    double phi_d = angles.phi_d < 0 ? angles.phi_d + CAP_PI : angles.phi_d;
    int h = bin_of(sqrt(fmax(0, angles.theta_h) / (CAP_PI / 2)) * g.theta_h, g.theta_h);
    int d = bin_of(angles.theta_d / (CAP_PI / 2) * g.theta_d, g.theta_d);
    int p = bin_of(phi_d / CAP_PI * g.phi_d, g.phi_d);
    return p + g.phi_d * (d + g.theta_d * h);
}

int rec_merl_index(half_diff angles)
{
    return rec_grid_index(rec_merl_grid, angles);
}

void rec_grid_ranges(struct grid g, int bin, half_diff *low, half_diff *high)
{
    int p = bin % g.phi_d, d = bin / g.phi_d % g.theta_d, h = bin / (g.phi_d * g.theta_d);
    double r0 = (double)h / g.theta_h, r1 = (h + 1.0) / g.theta_h, quarter = CAP_PI / 2;
    *low = (half_diff){r0 * r0 * quarter, quarter * d / g.theta_d, CAP_PI * p / g.phi_d};
    *high =
        (half_diff){r1 * r1 * quarter, quarter * (d + 1) / g.theta_d, CAP_PI * (p + 1) / g.phi_d};
}

half_diff rec_merl_center(int bin)
{
    assert(bin >= 0 && bin < MERL_BINS);
    int p = bin % MERL_PHI_D, d = bin / MERL_PHI_D % MERL_THETA_D;
    int h = bin / (MERL_PHI_D * MERL_THETA_D);
    double root = (h + 0.5) / MERL_THETA_H;
    return (half_diff){
        .theta_h = root * root * CAP_PI / 2,
        .theta_d = (d + 0.5) / MERL_THETA_D * CAP_PI / 2,
        .phi_d = (p + 0.5) / MERL_PHI_D * CAP_PI,
    };
}

bool rec_merl_above(int bin)
{
    vec3 wi, wo;
    rec_directions(rec_merl_center(bin), &wi, &wo);
    return wi.z > 0 && wo.z > 0;
}

int rec_merl_mirror(int bin)
{
    int p = bin % MERL_PHI_D;
    return bin - p + (MERL_PHI_D - 1 - p);
}

// What follows the header: every value, and nothing after the last.
static enum status read_values(double *value, FILE *file, const char *path, struct error *err)
{
    const size_t count = 3 * (size_t)MERL_BINS;
    if (fread(value, sizeof *value, count, file) != count)
        return cap_fail(err, STATUS_FORMAT, "%s: cut short: a MERL table is %zu bytes", path,
                        3 * sizeof(int32_t) + count * sizeof *value);
    if (fgetc(file) != EOF)
        return cap_fail(err, STATUS_FORMAT, "%s: bytes follow the table's last value", path);
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(value[i]))
            return cap_fail(err, STATUS_FORMAT, "%s: value %zu is not a number", path, i);
        value[i] *= scale[i / MERL_BINS];
    }
    return STATUS_OK;
}

enum status rec_merl_read(struct merl *merl, const char *path, struct error *err)
{
    enum status status = STATUS_OK;
    double *value = malloc(3 * (size_t)MERL_BINS * sizeof *value);
    FILE *file = fopen(path, "rb");
    int32_t n[3];
    if (!file) {
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    } else if (!value) {
        status = cap_fail(err, STATUS_MEMORY, "%s: no memory for the table", path);
    } else if (fread(n, sizeof n, 1, file) != 1 || n[0] != MERL_THETA_H || n[1] != MERL_THETA_D
               || n[2] != MERL_PHI_D) {
        status = cap_fail(err, STATUS_FORMAT,
                          "%s: not a MERL table: its first numbers are not 90, 90, 180", path);
    } else {
        status = read_values(value, file, path, err);
    }
    if (!status) {
        merl->value = value;
        value = NULL;  // the caller's now
    }
    free(value);
    if (file)
        fclose(file);
    return status;
}

// One theta_h at a time, so that the file's units need no second table.
static bool write_values(const double *value, FILE *stream)
{
    enum { SLAB = MERL_THETA_D * MERL_PHI_D };
    static _Thread_local double slab[SLAB];
    const int32_t n[3] = {MERL_THETA_H, MERL_THETA_D, MERL_PHI_D};
    bool ok = fwrite(n, sizeof n, 1, stream) == 1;
    for (int c = 0; c < 3; c++)
        for (int h = 0; ok && h < MERL_THETA_H; h++) {
            const double *from = value + (size_t)c * MERL_BINS + (size_t)h * SLAB;
            for (int i = 0; i < SLAB; i++)
                slab[i] = from[i] < 0 ? -1 : from[i] / scale[c];
            ok = fwrite(slab, sizeof *slab, SLAB, stream) == SLAB;
        }
    return ok;
}

enum status rec_merl_write(const struct merl *merl, const char *path, struct error *err)
{
    assert(merl->value);
    struct atomic_file file;
    enum status status = cap_file_begin(&file, path, true, err);
    if (status)
        return status;
    if (!write_values(merl->value, file.stream)) {
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
        cap_file_abandon(&file);
        return status;
    }
    return cap_file_commit(&file, err);
}

void rec_merl_free(struct merl *merl)
{
    free(merl->value);
    *merl = (struct merl){0};
}
