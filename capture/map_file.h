/* map_file.h -- radiance maps that stay in their files. */
#ifndef GONIOCAM_MAP_FILE_H
#define GONIOCAM_MAP_FILE_H

#include "glare.h"

/** Light that a lens spread over a map: `field` of what is seen is not true, of which `left` is
 *  left, and `doubt` the veil's relative standard deviation. */
struct map_veil {
    struct glare_field field;
    float left, doubt;
};
/** Whoever looks at the map sees it without this veil from now on, whose field the file owns. */
void map_file_veil(struct radiance_file *file, const struct map_veil *veil);

/** The file as it was when it was opened. */
struct stat;
const struct stat *map_file_about(const struct radiance_file *file);

/** NULL is allowed. */
void map_file_close(struct radiance_file *file);
/** Is path an uncompressed map, a line a chunk, of our channels in float and no others? Then size,
 *  channels (1 or 3) and cfa of *map are set, and *first is where the numbers of row 0 begin. */
bool exr_is_plain(struct radiance *map, size_t *first, const char *path);
#endif
