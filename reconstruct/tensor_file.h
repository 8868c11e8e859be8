/* tensor_file.h -- the container of RGL's .bsdf files: named arrays of numbers. */
#ifndef GONIOCAM_TENSOR_FILE_H
#define GONIOCAM_TENSOR_FILE_H

#include "capture.h"

enum { TENSOR_DIMS = 8 };
enum tensor_type { TENSOR_U8 = 1, TENSOR_F32 = 10 };

/** One array, row-major. */
struct tensor {
    const char *name;
    int type, dims;
    size_t shape[TENSOR_DIMS];
    const void *data;
};
/** All arrays of a file. Owns bytes, where the names and arrays of one that was read stand; {0} is
 *  empty; release with rec_tensors_free(). */
struct tensors {
    struct tensor *tensor;  // [count]
    int count;
    unsigned char *bytes;
};

/** How many numbers an array holds. */
size_t rec_tensor_numbers(const struct tensor *tensor);
/** By name; NULL: there is none. */
const struct tensor *rec_tensor_find(const struct tensors *tensors, const char *name);
/** Read a file whose every array lies inside it. On success the caller owns *tensors. STATUS_IO,
 *  STATUS_FORMAT, STATUS_MEMORY. */
enum status rec_tensors_read(struct tensors *tensors, const char *path, struct error *err);
/** Write arrays of the types above, complete or not at all. STATUS_IO. */
enum status rec_tensors_write(const struct tensor *tensor, int count, const char *path,
                              struct error *err);
void rec_tensors_free(struct tensors *tensors);
#endif
