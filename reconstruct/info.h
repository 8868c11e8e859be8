/* info.h -- what a file of reconstruct/ holds. */
#ifndef GONIOCAM_INFO_H
#define GONIOCAM_INFO_H

#include "reconstruct.h"

/** Tell, as lines "key: value" or one JSON object, what is in a MERL table, fits.yaml, bins.h5,
 *  samples.h5, or (through capture/) a photograph or radiance map. STATUS_IO, STATUS_FORMAT. */
enum status rec_info(const char *path, bool json, FILE *to, struct error *err);

#endif
