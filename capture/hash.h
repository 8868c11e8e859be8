/* hash.h -- identity of files: XXH3, 128 bits. */
#ifndef GONIOCAM_HASH_H
#define GONIOCAM_HASH_H

#include "capture.h"

/** A hash under construction. On success the caller owns it: end with hash_end(). */
struct hash;
struct hash *hash_begin(void);
void hash_bytes(struct hash *hash, const void *bytes, size_t size);
/** A file of a folder: its name and its contents. STATUS_IO. */
enum status hash_file(struct hash *hash, const char *folder, const char *name, struct error *err);
/** 32 hex digits; frees hash (may be NULL). */
void hash_end(struct hash *hash, char text[33]);
#endif
