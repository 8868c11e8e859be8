/* defects.h -- photosites that are hot, dead or stuck, and how unequal the others are, from the
 * photographs themselves. */
#ifndef GONIOCAM_DEFECTS_H
#define GONIOCAM_DEFECTS_H

#include "evenness.h"
#include "sensor.h"

/** What shots of different views tell of single photosites. Owns defect; {0} is empty;
 *  defects_free(). */
struct defects {
    struct evenness sites;  // relative: 0 where not told (told is false)
    int hot, dead;          // of sites.defects: brighter, darker than the photosites around them
    int views;              // that were looked at
    bool told;              // sites.relative is measured
};
/** Look at up to 8 shots of a camera whose levels and noise are known; method and significance:
 *  defects.c. Encoded photographs and fewer than 3 views tell of no defects. Photographs that
 *  cannot be read are passed over. STATUS_MEMORY. */
enum status defects_find(struct defects *defects, const struct capture *capture, int camera,
                         const struct sensor *sensor, const bool *left_out, const struct run *run,
                         struct error *err);
void defects_free(struct defects *defects);
#endif
