/* file.h -- what all fuzz targets share: the fuzzer's bytes as a file for readers that want a name.
 *
 * Each target hands the file to one reader. A reader may refuse it with a status; it may not crash,
 * leak, or read what is not there (the targets are built with ASan and UBSan).
 */
#ifndef GONIOCAM_FUZZ_FILE_H
#define GONIOCAM_FUZZ_FILE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/** Write the bytes to a file of this process's own in memory and return its name. */
static inline const char *fuzz_file(const uint8_t *data, size_t size, const char *ending)
{
    static char name[64];
    snprintf(name, sizeof name, "/dev/shm/goniocam-fuzz-%d.%s", (int)getpid(), ending);
    FILE *file = fopen(name, "wb");
    if (!file || (size && fwrite(data, 1, size, file) != size) || fclose(file) != 0)
        abort();
    return name;
}
#endif
