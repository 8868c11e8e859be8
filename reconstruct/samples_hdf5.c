/* samples_hdf5.c -- samples.h5: every photosite that was used, as a reflectance measurement.
 *
 * Layout.   A group a shot, by its name; in it a dataset a quantity, [samples] or [samples][n],
 *           float, chunked and deflated, in the order of the photosites, row by row: the data are
 *           the same for any number of threads. Directions are unit vectors in the world.
 */
#include "samples_hdf5.h"

#include <hdf5.h>

#include <stdlib.h>
#include <unistd.h>

// Datasets in the order of a block's columns.
static const struct field {
    const char *name, *units, *what;
    int columns;
} fields[] = {
    {"pixel", "px", "x right, y down; the centre of the first pixel is (0, 0)", 2},
    {"point", "mm", "on the sample, in the world", 3},
    {"normal", "1", "of the surface, mean over the photosite", 3},
    {"wi", "1", "to the lamp", 3},
    {"wo", "1", "to the camera", 3},
    {"f", "1/sr", "the BRDF; NaN: a mosaic's photosite does not measure this channel", 3},
    {"variance", "1/sr^2", "of f, noise alone", 3},
    {"systematic", "1", "1 sigma of ln f that neighbours share: geometry, lamp", 1},
    {"tilt", "radians", "1 sigma of theta_h", 1},
    {"spread", "radians^2", "variance of the normal over the photosite: towards h, across", 2},
    {"disc", "radians^2", "variance of wi over the lamp's disc, each way; 0: a point", 1},
    {"weight", "1", "in the bins' means", 1},
    {"bounced", "1", "light that the lit board brought, taken out of f: over what is left", 3},
    {"channel", "", "that a mosaic's photosite measured: 0 R, 1 G, 2 B; -1: all", 1},
};
enum { FIELDS = sizeof fields / sizeof *fields };

static float *put_vector(float *to, vec3 v)
{
    to[0] = (float)v.x;
    to[1] = (float)v.y;
    to[2] = (float)v.z;
    return to + 3;
}

static float *put_values(float *to, const double *value, int count)
{
    for (int i = 0; i < count; i++)
        to[i] = (float)value[i];
    return to + count;
}

static void fill_row(float *to, const reflectance_sample *s, int x, int y)
{
    double f[3];
    for (int c = 0; c < 3; c++)
        f[c] = s->channel < 0 || s->channel == c ? s->f[c] : NAN;
    to = put_values(to, (double[]){x, y}, 2);
    to = put_vector(to, s->point);
    to = put_vector(to, s->normal);
    to = put_vector(to, s->wi);
    to = put_vector(to, s->wo);
    to = put_values(to, f, 3);
    to = put_values(to, s->noise, 3);
    to = put_values(to, (double[]){s->systematic, s->tilt}, 2);
    to = put_values(to, s->spread, 2);
    to = put_values(to, &s->disc, 1);
    to = put_values(to, &s->weight, 1);
    to = put_values(to, s->bounced, 3);
    put_values(to, (double[]){s->channel}, 1);
}

static bool describe(hid_t set, const char *name, const char *text)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    hid_t attribute = H5Acreate2(set, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = attribute >= 0 && H5Awrite(attribute, type, &text) >= 0;
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
    return ok;
}

// An empty dataset that can grow.
static hid_t create_field(hid_t group, const struct field *field)
{
    int rank = field->columns > 1 ? 2 : 1;
    hsize_t none[2] = {0, (hsize_t)field->columns};
    hsize_t most[2] = {H5S_UNLIMITED, (hsize_t)field->columns};
    hsize_t chunk[2] = {BLOCK_ROWS, (hsize_t)field->columns};
    hid_t space = H5Screate_simple(rank, none, most), how = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(how, rank, chunk);
    H5Pset_shuffle(how);
    H5Pset_deflate(how, 1);
    H5Pset_obj_track_times(how, false);
    hid_t set =
        H5Dcreate2(group, field->name, H5T_IEEE_F32LE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    if (set >= 0 && !(describe(set, "units", field->units) && describe(set, "what", field->what))) {
        H5Dclose(set);
        set = -1;
    }
    H5Pclose(how);
    H5Sclose(space);
    return set;
}

// Append the block's columns from `first` on to a dataset, made where it is not there yet.
static bool append(hid_t group, const struct field *field, const struct sample_block *block,
                   int first, float *scratch)
{
    const int n = field->columns, rank = n > 1 ? 2 : 1;
    bool there = H5Lexists(group, field->name, H5P_DEFAULT) > 0;
    hid_t set = there ? H5Dopen2(group, field->name, H5P_DEFAULT) : create_field(group, field);
    if (set < 0)
        return false;
    for (int i = 0; i < block->count; i++)
        for (int k = 0; k < n; k++)
            scratch[i * n + k] = block->row[i][first + k];
    hid_t old = H5Dget_space(set);
    hsize_t size[2] = {0}, start[2] = {0}, more[2] = {(hsize_t)block->count, (hsize_t)n};
    H5Sget_simple_extent_dims(old, size, NULL);
    H5Sclose(old);
    start[0] = size[0];
    size[0] += more[0];
    bool ok = H5Dset_extent(set, size) >= 0;
    hid_t space = H5Dget_space(set), memory = H5Screate_simple(rank, more, NULL);
    ok = ok && H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, more, NULL) >= 0
         && H5Dwrite(set, H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT, scratch) >= 0;
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(set);
    return ok;
}

static bool append_all(hid_t file, const char *shot, const struct sample_block *block)
{
    static float scratch[3 * BLOCK_ROWS];  // one thread at a time is here
    bool there = H5Lexists(file, shot, H5P_DEFAULT) > 0;
    hid_t group = there ? H5Gopen2(file, shot, H5P_DEFAULT)
                        : H5Gcreate2(file, shot, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    bool ok = group >= 0;
    for (int k = 0, first = 0; ok && k < FIELDS; first += fields[k].columns, k++)
        ok = append(group, &fields[k], block, first, scratch);
    if (group >= 0)
        H5Gclose(group);
    return ok;
}

enum status rec_samples_begin(struct samples_file *file, const char *path, struct error *err)
{
    struct samples_file made = {0};
    enum status status = cap_file_begin(&made.aside, path, false, err);
    if (status)
        return status;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);  // the story is ours to tell
    made.file = H5Fcreate(made.aside.aside, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    if (made.file < 0) {
        cap_file_abandon(&made.aside);
        return cap_fail(err, STATUS_IO, "%s: cannot be written", path);
    }
    *file = made;
    return STATUS_OK;
}

enum status rec_samples_flush(struct samples_file *file, struct sample_block *block,
                              const char *shot, struct error *err)
{
    bool ok = true;
#pragma omp critical(samples_file)
    if (block->count > 0)
        ok = append_all(file->file, shot, block);
    block->count = 0;
    return ok ? STATUS_OK
              : cap_fail(err, STATUS_IO, "%s: cannot be written: is the disk full?",
                         file->aside.name);
}

enum status rec_samples_put(struct samples_file *file, struct sample_block *block, const char *shot,
                            const reflectance_sample *sample, int x, int y, struct error *err)
{
    if (!block->row)
        block->row = malloc(BLOCK_ROWS * sizeof *block->row);
    if (!block->row)
        return cap_fail(err, STATUS_MEMORY, "no memory for samples.h5");
    fill_row(block->row[block->count++], sample, x, y);
    return block->count < BLOCK_ROWS ? STATUS_OK : rec_samples_flush(file, block, shot, err);
}

// One shot of the other file; H5Literate goes on where 0 is returned.
static herr_t copy_shot(hid_t from, const char *name, const H5L_info_t *info, void *to)
{
    (void)info;
    return H5Ocopy(from, name, *(const hid_t *)to, name, H5P_DEFAULT, H5P_DEFAULT) < 0 ? -1 : 0;
}

enum status rec_samples_adopt(struct samples_file *file, const char *path, struct error *err)
{
    hid_t from = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    bool ok = from >= 0
              && H5Literate(from, H5_INDEX_NAME, H5_ITER_INC, NULL, copy_shot, &file->file) >= 0;
    if (from >= 0)
        H5Fclose(from);
    if (!ok)
        return cap_fail(err, STATUS_IO, "%s: cannot be joined to %s: is the disk full?", path,
                        file->aside.name);
    unlink(path);
    return STATUS_OK;
}

enum status rec_samples_end(struct samples_file *file, bool keep, struct error *err)
{
    bool ok = H5Fclose(file->file) >= 0;  // a full disk may show only here
    if (keep && ok)
        return cap_file_commit(&file->aside, err);
    enum status status = STATUS_OK;
    if (keep)
        status =
            cap_fail(err, STATUS_IO, "%s: cannot be written: is the disk full?", file->aside.name);
    cap_file_abandon(&file->aside);
    return status;
}
