/* looks.h -- the photosites of all shots become bins, as often as it takes. */
#ifndef GONIOCAM_LOOKS_H
#define GONIOCAM_LOOKS_H

#include "job.h"

/** Fill j->bins (and fine, where asked for), census and fits from a calibrated job; samples.h5 too
 *  where it keeps them. All members of a team take part. Statuses of rec_gather and rec_fit. */
enum status rec_looks(struct job *j, struct error *err);

#endif
