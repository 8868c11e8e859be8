/* truth_table.c -- truth.binary: the sample's material as a MERL table, at the middles of bins. */
#include "truth_table.h"

#include <stdlib.h>

enum status sam_truth_table_write(const struct scene_sample *sample, const char *path,
                                  struct error *err)
{
    struct merl table = {malloc(3 * (size_t)MERL_BINS * sizeof(double))};
    if (!table.value)
        return cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
    for (int bin = 0; bin < MERL_BINS; bin++) {
        double f[3] = {-1, -1, -1};
        if (rec_merl_above(bin)) {
            vec3 wi, wo;
            rec_directions(rec_merl_center(bin), &wi, &wo);
            sam_material_eval(&sample->material, wi, wo, f);
        }
        for (size_t c = 0; c < 3; c++)
            table.value[c * MERL_BINS + (size_t)bin] = f[c];
    }
    enum status status = rec_merl_write(&table, path, err);
    rec_merl_free(&table);
    return status;
}
