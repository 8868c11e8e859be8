/* exr_library.h -- what the files that call OpenEXRCore share. */
#ifndef GONIOCAM_EXR_LIBRARY_H
#define GONIOCAM_EXR_LIBRARY_H

#include "exr.h"

#include <openexr.h>

/** OpenEXR's settings, with its messages going to story->text, which has to live as long. */
exr_context_initializer_t exr_initializer(
    struct error *story); /** Can a file be long enough for so many bytes of pixels? */
bool exr_can_hold(const char *path, size_t bytes);
#endif
