/* truth_table.h -- truth.binary: the sample's material as a MERL table. */
#ifndef GONIOCAM_SAMPLES_TRUTH_TABLE_H
#define GONIOCAM_SAMPLES_TRUTH_TABLE_H

#include "scene.h"

/** Every bin whose middle is above the horizon holds f there; the others -1. STATUS_IO,
 *  STATUS_MEMORY. */
enum status sam_truth_table_write(const struct scene_sample *sample, const char *path,
                                  struct error *err);
#endif
