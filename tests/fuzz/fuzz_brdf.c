/* fuzz_brdf.c -- any bytes as a BRDF of any format: RGL, MIT and text tables, fits, parameters. */
#include "brdf.h"
#include "file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *name = fuzz_file(data, size, "brdf");
    struct brdf brdf = {0};
    if (rec_brdf_read(&brdf, name, NULL) == STATUS_OK) {
        const vec3 wi = {0.6, 0, 0.8}, wo = {-0.48, 0.36, 0.8};
        double f[3];
        rec_brdf_eval(&brdf, wi, wo, f);
    }
    rec_brdf_free(&brdf);
    unlink(name);
    return 0;
}
