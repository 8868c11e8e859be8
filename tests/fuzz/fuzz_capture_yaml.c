/* fuzz_capture_yaml.c -- any bytes as a capture.yaml. */
#include "capture_yaml.h"
#include "file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *name = fuzz_file(data, size, "yaml");
    struct capture_yaml yaml = {0};
    capture_yaml_read(&yaml, name, NULL);
    capture_yaml_free(&yaml);
    unlink(name);
    return 0;
}
