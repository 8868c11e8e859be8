/* moved.h -- frames of a bracket that moved against each other. */
#ifndef GONIOCAM_MOVED_H
#define GONIOCAM_MOVED_H

#include "sample.h"

/** Set left_out[] ([capture->photos]) of photographs that are displaced against the rest of their
 *  shot, and warn with their names. The set holds linear values. */
void moved_find(bool *left_out, const struct capture *capture, const struct sample_set *set,
                const struct sensor *sensor, struct run *run);
#endif
