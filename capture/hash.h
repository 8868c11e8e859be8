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
/** Of a file alone, name and contents. A file that has not changed since it was asked for is not
 *  read again. Any thread. STATUS_IO, STATUS_MEMORY. */
enum status file_digest(char digest[33], const char *folder, const char *name, struct error *err);
/** 32 hex digits; frees hash (may be NULL). */
void hash_end(struct hash *hash, char text[33]);
#endif
