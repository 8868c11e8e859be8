/* fuzz_calibration.c -- any bytes as a calibration.yaml, or another program's YAML. */
#include "file.h"
#include "calib.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *name = fuzz_file(data, size, "yaml");
    struct calibration made = {0};
    cal_calibration_import(&made, name, NULL);
    cal_calibration_free(&made);
    unlink(name);
    return 0;
}
