/* bins_hdf5.c -- bins.h5: the measured bins with their errors.
 *
 * Layout.   Datasets [90][90][180] and [90][90][180][3], one chunk a theta_h, deflated. Where
 *           nothing was measured mean, stderr and centroid are NaN and count is 0. mean and stderr
 *           are float, whose rounding (6e-8) no measurement reaches; the centroid is double, so
 *           that it cannot be rounded out of its bin.
 */
#include "bins_hdf5.h"

#include <hdf5.h>

#include <stdlib.h>
#include <unistd.h>

static int slab_of(struct grid grid)
{
    return grid.theta_d * grid.phi_d;
}

enum number { AS_INT, AS_FLOAT, AS_DOUBLE };

// One dataset: its name, unit, and how a bin's numbers get in and out.
struct layer {
    const char *name, *units, *what;
    int values;          // 1 or 3
    enum number number;  // in the file
    bool needed;         // to read the file
    void (*get)(const struct bin *b, double *value);
    void (*set)(struct bin *b, const double *value);
};

static void get_mean(const struct bin *b, double *v)
{
    for (int c = 0; c < 3; c++)
        v[c] = b->mean[c];
}

static void set_mean(struct bin *b, const double *v)
{
    for (int c = 0; c < 3; c++)
        b->mean[c] = v[c];
}

static void get_sigma(const struct bin *b, double *v)
{
    for (int c = 0; c < 3; c++)
        v[c] = b->sigma[c];
}

static void set_sigma(struct bin *b, const double *v)
{
    for (int c = 0; c < 3; c++)
        b->sigma[c] = b->noise[c] = v[c];
}

static void get_centroid(const struct bin *b, double *v)
{
    v[0] = b->centroid.theta_h;
    v[1] = b->centroid.theta_d;
    v[2] = b->centroid.phi_d;
}

static void set_centroid(struct bin *b, const double *v)
{
    b->centroid = (half_diff){v[0], v[1], v[2]};
}

static void get_count(const struct bin *b, double *v)
{
    *v = b->count;
}

static void set_count(struct bin *b, const double *v)
{
    b->count = (int32_t)*v;
}

static void get_systematic(const struct bin *b, double *v)
{
    *v = b->systematic;
}

// After sigma is set: what is not shared is noise.
static void set_systematic(struct bin *b, const double *v)
{
    b->systematic = *v;
    for (int c = 0; c < 3; c++) {
        double shared = b->mean[c] * *v;
        b->noise[c] = sqrt(fmax(0, b->sigma[c] * b->sigma[c] - shared * shared));
    }
}

static void get_tilt(const struct bin *b, double *v)
{
    *v = b->tilt;
}

static void set_tilt(struct bin *b, const double *v)
{
    b->tilt = *v;
}

static const struct layer layers[] = {
    {"mean", "1/sr", "f at the centroid", 3, AS_FLOAT, true, get_mean, set_mean},
    {"stderr", "1/sr", "1 sigma of the mean, without that of the reference's albedo", 3, AS_FLOAT,
     true, get_sigma, set_sigma},
    {"centroid", "radians", "theta_h, theta_d, phi_d of the samples", 3, AS_DOUBLE, true,
     get_centroid, set_centroid},
    {"count", "photosites", "samples in the bin", 1, AS_INT, true, get_count, set_count},
    {"systematic", "1", "the part of stderr/mean that bins share: geometry and lamp", 1, AS_FLOAT,
     false, get_systematic, set_systematic},
    {"tilt", "radians", "1 sigma of theta_h", 1, AS_FLOAT, false, get_tilt, set_tilt},
};
enum { LAYERS = sizeof layers / sizeof *layers };

static bool put_text(hid_t to, const char *name, const char *text)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    hid_t attribute = H5Acreate2(to, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, type, &text) >= 0;
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
    return ok;
}

static bool put_number(hid_t to, const char *name, double value)
{
    hid_t space = H5Screate(H5S_SCALAR);
    hid_t attribute = H5Acreate2(to, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, H5T_NATIVE_DOUBLE, &value) >= 0;
    H5Aclose(attribute);
    H5Sclose(space);
    return ok;
}

// A chunked, deflated dataset of the table's shape; what is never written reads as `fill`.
static hid_t create(hid_t file, const char *name, struct grid grid, int values, hid_t type,
                    double fill)
{
    hsize_t size[4] = {(hsize_t)grid.theta_h, (hsize_t)grid.theta_d, (hsize_t)grid.phi_d,
                       (hsize_t)values};
    hsize_t chunk[4] = {1, size[1], size[2], size[3]};
    int rank = values > 1 ? 4 : 3;
    hid_t space = H5Screate_simple(rank, size, NULL), how = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(how, rank, chunk);
    H5Pset_shuffle(how);
    H5Pset_obj_track_times(how, false);  // the same bins give the same bytes, whenever
    H5Pset_deflate(how, 1);
    H5Pset_fill_value(how, H5T_NATIVE_DOUBLE, &fill);
    hid_t set = H5Dcreate2(file, name, type, space, H5P_DEFAULT, how, H5P_DEFAULT);
    H5Pclose(how);
    H5Sclose(space);
    return set;
}

// Read or write the slab of one theta_h.
static bool transfer(hid_t set, struct grid grid, int h, int values, hid_t memory_type, void *slab,
                     bool write)
{
    hsize_t start[4] = {(hsize_t)h, 0, 0, 0};
    hsize_t size[4] = {1, (hsize_t)grid.theta_d, (hsize_t)grid.phi_d, (hsize_t)values};
    int rank = values > 1 ? 4 : 3;
    hid_t memory = H5Screate_simple(rank, size, NULL), space = H5Dget_space(set);
    bool ok = space >= 0 && H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, size, NULL) >= 0
              && (write ? H5Dwrite(set, memory_type, memory, space, H5P_DEFAULT, slab)
                        : H5Dread(set, memory_type, memory, space, H5P_DEFAULT, slab))
                     >= 0;
    H5Sclose(space);
    H5Sclose(memory);
    return ok;
}

static hid_t file_type(const struct layer *layer)
{
    return layer->number == AS_INT     ? H5T_STD_I32LE
           : layer->number == AS_FLOAT ? H5T_IEEE_F32LE
                                       : H5T_IEEE_F64LE;
}

// The bins of theta_h index h are bin[first .. return value - 1].
static int end_of_slab(const struct bins *bins, int first, int h)
{
    while (first < bins->count && bins->bin[first].index / slab_of(rec_grid_of(bins)) == h)
        first++;
    return first;
}

static bool write_layer(hid_t file, const struct layer *layer, const struct bins *bins,
                        double *slab)
{
    double empty = layer->number == AS_INT ? 0 : NAN;
    const int slab_bins = slab_of(rec_grid_of(bins));
    hid_t set =
        create(file, layer->name, rec_grid_of(bins), layer->values, file_type(layer), empty);
    bool ok = set >= 0 && put_text(set, "units", layer->units)
              && put_text(set, "description", layer->what);
    for (int h = 0, first = 0; ok && h < rec_grid_of(bins).theta_h; h++) {
        int end = end_of_slab(bins, first, h);
        if (end == first)
            continue;  // reads as empty
        for (int i = 0; i < slab_bins * layer->values; i++)
            slab[i] = empty;
        for (; first < end; first++)
            layer->get(&bins->bin[first],
                       slab + bins->bin[first].index % slab_bins * layer->values);
        ok = transfer(set, rec_grid_of(bins), h, layer->values, H5T_NATIVE_DOUBLE, slab, true);
    }
    H5Dclose(set);
    return ok;
}

static bool write_status(hid_t file, struct grid grid, const uint8_t *status)
{
    hid_t set = create(file, "status", grid, 1, H5T_STD_U8LE, 0);
    bool ok = set >= 0
              && put_text(set, "description",
                          "0 impossible, 1 measured, 2 interpolated, 3 extrapolated; "
                          "the values of 2 and 3 are in brdf.binary")
              && H5Dwrite(set, H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, status) >= 0;
    H5Dclose(set);
    return ok;
}

static bool write_about(hid_t file, const struct bins_about *a)
{
    bool ok = put_text(file, "axes", "theta_h (by its square root), theta_d, phi_d as in MERL");
    if (a->version)
        ok = ok && put_text(file, "software", a->version);
    if (a->input_hash)
        ok = ok && put_text(file, "input_xxh3", a->input_hash);
    if (a->reference_albedo > 0)
        ok = ok && put_number(file, "reference_albedo", a->reference_albedo);
    if (a->lamp_solid_angle > 0)
        ok = ok && put_number(file, "lamp_solid_angle_sr", a->lamp_solid_angle);
    if (a->detector_solid_angle > 0)
        ok = ok && put_number(file, "detector_solid_angle_sr", a->detector_solid_angle);
    return ok;
}

static bool write_all(const char *path, const struct bins *bins, const uint8_t *status,
                      const struct bins_about *about, double *slab)
{
    hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    bool ok =
        file >= 0 && write_about(file, about) && write_status(file, rec_grid_of(bins), status);
    for (int k = 0; ok && k < LAYERS; k++)
        ok = write_layer(file, &layers[k], bins, slab);
    if (file >= 0)
        ok = H5Fclose(file) >= 0 && ok;  // a full disk may show only here
    return ok;
}

enum status rec_bins_write(const struct bins *bins, const uint8_t *status,
                           const struct bins_about *about, const char *path, struct error *err)
{
    struct atomic_file aside;
    double *slab = malloc(3 * (size_t)slab_of(rec_grid_of(bins)) * sizeof *slab);
    if (!slab)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory to write it", path);
    enum status result = cap_file_begin(&aside, path, false, err);
    if (!result) {
        H5Eset_auto2(H5E_DEFAULT, NULL, NULL);  // the story is ours to tell
        if (write_all(aside.aside, bins, status, about, slab)) {
            result = cap_file_commit(&aside, err);
        } else {
            result = cap_fail(err, STATUS_IO, "%s: cannot be written: is the disk full?", path);
            cap_file_abandon(&aside);
        }
    }
    free(slab);
    return result;
}

// Is the dataset there, with the table's shape?
static bool has_shape(hid_t set, int values)
{
    hsize_t size[4] = {0};
    hid_t space = H5Dget_space(set);
    int rank = space >= 0 ? H5Sget_simple_extent_ndims(space) : -1;
    bool ok = rank == (values > 1 ? 4 : 3);
    ok = ok && H5Sget_simple_extent_dims(space, size, NULL) == rank && size[0] == MERL_THETA_H
         && size[1] == MERL_THETA_D && size[2] == MERL_PHI_D
         && (values == 1 || size[3] == (hsize_t)values);
    H5Sclose(space);
    return ok;
}

static bool read_layer(hid_t file, const struct layer *layer, struct bins *bins, double *slab)
{
    if (!layer->needed && H5Lexists(file, layer->name, H5P_DEFAULT) <= 0)
        return true;
    hid_t set = H5Dopen2(file, layer->name, H5P_DEFAULT);
    bool ok = set >= 0 && has_shape(set, layer->values);
    for (int h = 0, first = 0; ok && h < MERL_THETA_H; h++) {
        int end = end_of_slab(bins, first, h);
        if (end == first)
            continue;
        ok = transfer(set, rec_grid_of(bins), h, layer->values, H5T_NATIVE_DOUBLE, slab, false);
        for (; ok && first < end; first++)
            layer->set(&bins->bin[first],
                       slab + bins->bin[first].index % slab_of(rec_grid_of(bins)) * layer->values);
    }
    H5Dclose(set);
    return ok;
}

static bool read_status(hid_t file, uint8_t *status)
{
    hid_t set = H5Dopen2(file, "status", H5P_DEFAULT);
    bool ok = set >= 0 && has_shape(set, 1)
              && H5Dread(set, H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, status) >= 0;
    H5Dclose(set);
    return ok;
}

// The measured bins' indices.
static bool read_indices(hid_t file, struct bins *bins)
{
    uint8_t *status = malloc(MERL_BINS);
    bool ok = status && read_status(file, status);
    int count = 0;
    for (int i = 0; ok && i < MERL_BINS; i++)
        count += status[i] == BIN_MEASURED;
    bins->bin = ok ? calloc((size_t)count + 1, sizeof *bins->bin) : NULL;
    ok = bins->bin != NULL;
    for (int i = 0; ok && i < MERL_BINS; i++)
        if (status[i] == BIN_MEASURED)
            bins->bin[bins->count++].index = i;
    free(status);
    return ok;
}

// Numbers that a file may hold and a bin may not.
static bool sound(const struct bins *bins)
{
    for (int i = 0; i < bins->count; i++) {
        const struct bin *b = &bins->bin[i];
        if (b->count < 1 || !isfinite(b->centroid.theta_h + b->centroid.theta_d)
            || !(b->systematic >= 0) || !(b->tilt >= 0) || rec_merl_index(b->centroid) != b->index)
            return false;
        for (int c = 0; c < 3; c++)
            if (!isfinite(b->mean[c]) || !(b->sigma[c] >= 0))
                return false;
    }
    return true;
}

enum status rec_bins_read(struct bins *bins, const char *path, struct error *err)
{
    if (access(path, R_OK) != 0)
        return cap_fail(err, STATUS_IO, "%s: there is no such file, or it may not be read", path);
    double *slab = malloc(3 * (size_t)slab_of(rec_merl_grid) * sizeof *slab);
    if (!slab)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory to read it", path);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);  // the story is ours to tell
    struct bins found = {.grid = rec_merl_grid};
    enum status result = STATUS_OK;
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    bool ok = file >= 0 && read_indices(file, &found);
    for (int k = 0; ok && k < LAYERS; k++)
        ok = read_layer(file, &layers[k], &found, slab);
    if (!ok) {
        result = cap_fail(err, STATUS_FORMAT,
                          "%s: not a bins.h5: mean, stderr, centroid, count and status "
                          "[90][90][180] are wanted",
                          path);
    } else if (!sound(&found)) {
        result = cap_fail(err, STATUS_FORMAT,
                          "%s: a measured bin holds no number, or a centroid "
                          "outside of it",
                          path);
    } else {
        *bins = found;
        found = (struct bins){0};  // the caller's now
    }
    if (file >= 0)
        H5Fclose(file);
    rec_bins_free(&found);
    free(slab);
    return result;
}

enum status rec_bins_read_status(uint8_t *status, const char *path, struct error *err)
{
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    bool ok = file >= 0 && read_status(file, status);
    if (file >= 0)
        H5Fclose(file);
    return ok ? STATUS_OK
              : cap_fail(err, STATUS_FORMAT, "%s: it holds no status [90][90][180]", path);
}
