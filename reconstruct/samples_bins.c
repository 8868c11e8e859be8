/* samples_bins.c -- samples.h5 read back into bins.
 *
 * Method.   A block of rows is a row of strips, and goes the way that photosites go (shot_bins.c,
 *           bins.c), a shot after the other. A first fit brings the channels to one centroid and
 *           tells what the bins' widths hide.
 */
#include "samples_bins.h"

#include "shot_bins.h"

#include <hdf5.h>

#include <stdlib.h>
#include <unistd.h>

enum { ROWS = 128 * LANES };

// What is read of a sample, and in how many columns.
enum field {
    WI,
    WO,
    NORMAL,
    F,
    VARIANCE,
    BOUNCED,
    SPREAD,
    SYSTEMATIC,
    TILT,
    DISC,
    WEIGHT,
    CHANNEL
};
static const struct {
    const char *name;
    int columns;
} fields[] = {
    {"wi", 3},     {"wo", 3},         {"normal", 3}, {"f", 3},    {"variance", 3}, {"bounced", 3},
    {"spread", 2}, {"systematic", 1}, {"tilt", 1},   {"disc", 1}, {"weight", 1},   {"channel", 1},
};
enum { FIELDS = sizeof fields / sizeof *fields };

// A shot's datasets, and some of their rows.
struct rows {
    hid_t set[FIELDS];
    hsize_t samples;  // of the shot
    float (*value)[ROWS * 3];
};

bool rec_is_hdf5(const char *path)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);  // the story is ours to tell
    return access(path, R_OK) == 0 && H5Fis_hdf5(path) > 0;
}

bool rec_has_samples(const char *path)
{
    hid_t file = rec_is_hdf5(path) ? H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT) : -1;
    bool bins = file >= 0 && H5Lexists(file, "mean", H5P_DEFAULT) > 0;
    if (file >= 0)
        H5Fclose(file);
    return file >= 0 && !bins;
}

static void close_rows(struct rows *rows)
{
    for (int k = 0; k < FIELDS; k++)
        if (rows->set[k] >= 0)
            H5Dclose(rows->set[k]);
}

// The shape [samples] or [samples][columns], the samples as in the first field.
static bool fits_others(struct rows *rows, int k)
{
    hsize_t size[2] = {0, 1};
    hid_t space = H5Dget_space(rows->set[k]);
    bool ok = H5Sget_simple_extent_ndims(space) == (fields[k].columns > 1 ? 2 : 1);
    ok = ok && H5Sget_simple_extent_dims(space, size, NULL) >= 0;
    H5Sclose(space);
    if (k == 0)
        rows->samples = size[0];
    return ok && size[0] == rows->samples && size[1] == (hsize_t)fields[k].columns;
}

static bool open_rows(struct rows *rows, hid_t group)
{
    bool ok = true;
    for (int k = 0; k < FIELDS; k++) {
        rows->set[k] = ok ? H5Dopen2(group, fields[k].name, H5P_DEFAULT) : -1;
        ok = rows->set[k] >= 0 && fits_others(rows, k);
    }
    return ok;
}

static bool read_rows(const struct rows *rows, hsize_t start, hsize_t count)
{
    bool ok = true;
    for (int k = 0; k < FIELDS && ok; k++) {
        int rank = fields[k].columns > 1 ? 2 : 1;
        hsize_t from[2] = {start, 0}, size[2] = {count, (hsize_t)fields[k].columns};
        hid_t space = H5Dget_space(rows->set[k]), memory = H5Screate_simple(rank, size, NULL);
        ok = H5Sselect_hyperslab(space, H5S_SELECT_SET, from, NULL, size, NULL) >= 0
             && H5Dread(rows->set[k], H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT, rows->value[k])
                    >= 0;
        H5Sclose(memory);
        H5Sclose(space);
    }
    return ok;
}

static vec3 vector_at(const struct rows *rows, enum field field, int row)
{
    const float *v = &rows->value[field][3 * row];
    return (vec3){v[0], v[1], v[2]};
}

// Directions that reflect, and numbers that can be summed.
static bool sound(const struct rows *rows, int row)
{
    vec3 n = vector_at(rows, NORMAL, row), wi = vector_at(rows, WI, row);
    vec3 wo = vector_at(rows, WO, row);
    const double off = 1e-3;  // from unit length
    float weight = rows->value[WEIGHT][row], channel = rows->value[CHANNEL][row];
    bool ok = fabs(vec3_dot(n, n) - 1) < off && fabs(vec3_dot(wi, wi) - 1) < off
              && fabs(vec3_dot(wo, wo) - 1) < off && vec3_dot(n, wi) > 0 && vec3_dot(n, wo) > 0;
    ok = ok && weight > 0 && weight <= 1 && channel >= -1 && channel <= 2;
    for (int c = 0; c < 3 && ok; c++) {
        float f = rows->value[F][3 * row + c], variance = rows->value[VARIANCE][3 * row + c];
        bool measured = channel < 0 || (int)channel == c;
        ok = !measured || (fabsf(f) < 1e9f && variance >= 0 && variance < 1e18f);
    }
    return ok && rows->value[SYSTEMATIC][row] >= 0 && rows->value[TILT][row] >= 0;
}

static void put_sample(struct strip *s, int lane, const struct rows *rows, int row)
{
    s->fate[lane] = FATE_USED;
    rec_lane_narrow(&s->normal, lane, vec3_normalize(vector_at(rows, NORMAL, row)));
    rec_lane_narrow(&s->wi, lane, vec3_normalize(vector_at(rows, WI, row)));
    rec_lane_narrow(&s->wo, lane, vec3_normalize(vector_at(rows, WO, row)));
    s->channel[lane] = (int)rows->value[CHANNEL][row];
    for (int c = 0; c < 3; c++) {
        bool measured = s->channel[lane] < 0 || s->channel[lane] == c;
        s->f[c][lane] = measured ? rows->value[F][3 * row + c] : 0;
        s->noise[c][lane] = measured ? rows->value[VARIANCE][3 * row + c] : 0;
        s->bounced[c][lane] = measured ? rows->value[BOUNCED][3 * row + c] : 0;
    }
    s->spread[0][lane] = rows->value[SPREAD][2 * row];
    s->spread[1][lane] = rows->value[SPREAD][2 * row + 1];
    s->systematic[lane] = rows->value[SYSTEMATIC][row];
    s->tilt[lane] = rows->value[TILT][row];
    s->disc[lane] = rows->value[DISC][row];
    s->weight[lane] = rows->value[WEIGHT][row];
}

static enum status add_rows(struct shot_bins *shot, const struct rows *rows, int count,
                            const char *path, struct error *err)
{
    enum status status = STATUS_OK;
    for (int first = 0; first < count && !status; first += LANES) {
        struct strip s = {.to = LANES, .use = ALL_LANES};
        for (int i = 0; i < LANES; i++) {
            s.fate[i] = FATE_UNUSABLE;
            if (first + i >= count)
                continue;
            if (!sound(rows, first + i))
                return cap_fail(err, STATUS_FORMAT,
                                "%s: a sample is no measurement: directions that are no "
                                "unit vectors above the surface, or no number",
                                path);
            put_sample(&s, i, rows, first + i);
        }
        rec_strip_angles(&s);
        status = rec_shot_add(shot, &s, err);
    }
    return status;
}

// What goes through all shots.
struct reading {
    struct tally tally;
    struct shot_bins shot;
    float (*value)[ROWS * 3];
    const char *path;
    enum status status;
    struct error *err;
};

// One shot; H5Literate goes on where 0 is returned.
static herr_t add_shot(hid_t file, const char *name, const H5L_info_t *info, void *context)
{
    (void)info;
    struct reading *r = context;
    struct rows rows = {.value = r->value};
    hid_t group = H5Gopen2(file, name, H5P_DEFAULT);
    bool ok = open_rows(&rows, group);
    for (hsize_t start = 0; start < rows.samples && ok && !r->status; start += ROWS) {
        hsize_t count = rows.samples - start < ROWS ? rows.samples - start : ROWS;
        ok = read_rows(&rows, start, count);
        if (ok)
            r->status = add_rows(&r->shot, &rows, (int)count, r->path, r->err);
    }
    close_rows(&rows);
    if (group >= 0)
        H5Gclose(group);
    enum status ended = rec_shot_end(&r->shot, &r->tally, r->err);
    if (!ok)
        r->status = cap_fail(r->err, STATUS_FORMAT, "%s: shot %s: not the datasets of samples.h5",
                             r->path, name);
    else if (!r->status)
        r->status = ended;
    return r->status ? -1 : 0;
}

static enum status read_all(struct bins *bins, struct reading *r, struct error *err)
{
    hid_t file = H5Fopen(r->path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0)
        return cap_fail(err, STATUS_IO, "%s: it cannot be read", r->path);
    H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, NULL, add_shot, r);
    H5Fclose(file);
    if (!r->status && r->tally.count == 0)
        r->status = cap_fail(err, STATUS_FORMAT, "%s: no shots with samples", r->path);
    return r->status ? r->status : rec_tally_finish(bins, &r->tally, err);
}

enum status rec_samples_bins(struct bins *bins, const char *path, struct run *run,
                             struct error *err)
{
    struct reading r = {.path = path, .err = err, .shot.grid = rec_merl_grid};
    struct bins made = {0};
    struct fits fits = {0};
    r.value = malloc(FIELDS * sizeof *r.value);
    enum status status = r.value ? rec_tally_begin(&r.tally, rec_merl_grid, err)
                                 : cap_fail(err, STATUS_MEMORY, "%s: no memory to read it", path);
    if (!status)
        status = read_all(&made, &r, err);
    if (!status)
        status = rec_fit(&fits, &made, NULL, 0, run, err);
    if (!status) {
        rec_bins_align(&made, &fits.fit[0]);
        rec_bins_widen(&made, &fits.fit[0]);
        *bins = made;
        made = (struct bins){0};  // the caller's now
    }
    rec_fits_free(&fits);
    rec_bins_free(&made);
    rec_tally_free(&r.tally);
    rec_shot_free(&r.shot);
    free(r.value);
    return status;
}
