/* lookup.h -- a table made ready to be evaluated between the middles of its bins. */
#ifndef GONIOCAM_LOOKUP_H
#define GONIOCAM_LOOKUP_H

#include "brdf.h"

struct lookup;

/** On success the caller owns *lookup, which does not refer to the table. STATUS_MEMORY. */
enum status rec_lookup_make(struct lookup **lookup, const struct merl *table, struct error *err);
/** Bytes of a lookup, which holds no addresses: it can be told to other processes as it is. */
size_t rec_lookup_size(void);
/** NULL is empty. */
void rec_lookup_free(struct lookup *lookup);
/** f [count][3] of pairs of directions [count]; 0 where one is below the horizon. */
void rec_lookup_eval(const struct lookup *lookup, const vec3 *wi, const vec3 *wo, double (*f)[3],
                     size_t count);

#endif
