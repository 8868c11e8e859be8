/* recover.h -- the response curve of encoded photographs, from brackets. */
#ifndef GONIOCAM_RECOVER_H
#define GONIOCAM_RECOVER_H

#include "sample.h"

/** Recover the curve from a sample of codes; method: recover.c. false: no bracket tells. */
bool response_recover(struct curve *curve, const struct sample_set *set);

/** A curve's file: "code red green blue" lines. STATUS_IO, STATUS_FORMAT. */
enum status response_read(struct curve *curve, const char *path, struct error *err);
enum status response_write(const struct curve *curve, const char *path, struct error *err);
#endif
