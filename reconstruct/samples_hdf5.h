/* samples_hdf5.h -- samples.h5: every photosite that was used, as a reflectance measurement. */
#ifndef GONIOCAM_SAMPLES_HDF5_H
#define GONIOCAM_SAMPLES_HDF5_H

#include "samples.h"

/** samples.h5 under construction. Any thread may write, one at a time. */
struct samples_file {
    struct atomic_file aside;
    int64_t file;  // of HDF5
};

enum { SAMPLE_COLUMNS = 30, BLOCK_ROWS = 8192 };
/** Samples of one shot on their way to the file. Owns row; {0} is empty; free(row). */
struct sample_block {
    float (*row)[SAMPLE_COLUMNS];  // [BLOCK_ROWS]
    int count;
};

/** STATUS_IO. End with rec_samples_end, which frees *file. */
enum status rec_samples_begin(struct samples_file *file, const char *path, struct error *err);
/** Add the sample of pixel (x, y) of a shot. STATUS_IO, STATUS_MEMORY. */
enum status rec_samples_put(struct samples_file *file, struct sample_block *block, const char *shot,
                            const reflectance_sample *sample, int x, int y, struct error *err);
/** Write what is left in a block. STATUS_IO. */
enum status rec_samples_flush(struct samples_file *file, struct sample_block *block,
                              const char *shot, struct error *err);
/** Take the shots of another process's file, and remove that. STATUS_IO. */
enum status rec_samples_adopt(struct samples_file *file, const char *path, struct error *err);
/** The file under its name, complete; keep false: none. STATUS_IO. */
enum status rec_samples_end(struct samples_file *file, bool keep, struct error *err);

#endif
