/* fuzz_photo.c -- any bytes as a photograph: TIFF, JPEG, PNG, EXR or raw, by what they begin with.
 */
#include "file.h"
#include "photo.h"

/** Read it to its end in pieces of a few rows, unless it claims to be huge. */
static void read_all(struct photo_file *file)
{
    enum { ROWS = 8, VALUES_MAX = 1 << 22 };
    size_t row = (size_t)file->info.width * (size_t)file->info.channels;
    if (row > VALUES_MAX || row * (size_t)file->info.height > VALUES_MAX)
        return;
    float *dn = malloc(ROWS * row * sizeof *dn);
    for (int y = 0; dn && y < file->info.height; y += ROWS) {
        int rows = file->info.height - y < ROWS ? file->info.height - y : ROWS;
        if (photo_read(file, dn, rows, NULL))
            break;
    }
    free(dn);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *name = fuzz_file(data, size, "photo");
    struct photo_file *file = NULL;
    if (!photo_open(&file, name, NULL)) {
        read_all(file);
        photo_close(file);
    }
    unlink(name);
    return 0;
}
