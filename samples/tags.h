/* tags.h -- the bit patterns of the AprilTag library's families. */
#ifndef GONIOCAM_SAMPLES_TAGS_H
#define GONIOCAM_SAMPLES_TAGS_H

#include <stdbool.h>

/** A family's patterns. Owns bit; {0} is empty; release with sam_tag_family_free(). */
struct tag_family {
    int tags;    // how many ids it has
    int border;  // side of the black square's outer border, in bits
    int total;   // side of the whole pattern, in bits; it reaches beyond the border
    bool *bit;   // [tags][total][total], true: white; row 0 is the printed tag's top
};

/** A family by name, "tag36h11". false: there is none, or no memory; *family is untouched. */
bool sam_tag_family(struct tag_family *family, const char *name);
void sam_tag_family_free(struct tag_family *family);
/** Is a tag white at (x, y), in bits from its middle, x to the right and y up? What lies beyond
 *  the pattern is white paper. */
bool sam_tag_white(const struct tag_family *family, int id, double x, double y);
#endif
