/* long_file.h -- a file of many megabytes, written once from front to end. */
#ifndef GONIOCAM_LONG_FILE_H
#define GONIOCAM_LONG_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A file under construction; one thread at a time. */
struct long_file;
/** Make or overwrite a file that will hold about size bytes; past the page cache, if that is asked
 *  for and the file system can. On success end with long_file_end(). NULL: errno says why. */
struct long_file *long_file_begin(const char *path, uint64_t size, bool past_cache);
/** Bytes from `offset` on, which may lie in the first LONG_FILE_BLOCK bytes, or else where the last
 *  write beyond them ended: headers and tables may be written over, the rest goes forward without a
 *  gap. What fails shows here or later: false, and errno says why. */
bool long_file_write(struct long_file *file, const void *data, size_t size, uint64_t offset);
/** All that is still in memory goes to the file, or (keep false) nothing more. Frees `file`, which
 *  may be NULL. false: the file is not complete; errno says why. */
bool long_file_end(struct long_file *file, bool keep);

enum { LONG_FILE_BLOCK = 4 << 20 };
#endif
