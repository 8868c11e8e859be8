/* fuzz_exr.c -- any bytes as a radiance map. */
#include "file.h"
#include "capture.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *name = fuzz_file(data, size, "exr");
    struct radiance map = {0};
    cap_radiance_read(&map, name, NULL);
    cap_radiance_free(&map);
    unlink(name);
    return 0;
}
