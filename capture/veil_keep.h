/* veil_keep.h -- veils of maps in files, kept for whoever opens the same map again. */
#ifndef GONIOCAM_VEIL_KEEP_H
#define GONIOCAM_VEIL_KEEP_H

#include "map_file.h"

#include <sys/types.h>
#include <time.h>

/** What a veil depends on: a file as it was, and the lens's shares with their deviation. */
struct veil_key {
    dev_t device;
    ino_t node;
    off_t size;
    struct timespec changed;
    double share[GLARE_TERMS], sigma;
};

/** The veil kept for a key, whose field is then the caller's; false: none is, or no memory. Any
 *  thread. */
bool veil_recall(struct map_veil *veil, const struct veil_key *key);
/** Keep a copy, in the place of the oldest. Any thread. */
void veil_keep(const struct veil_key *key, const struct map_veil *veil);

#endif
