/* exr_library.h -- what the files that call OpenEXRCore share. */
#ifndef GONIOCAM_EXR_LIBRARY_H
#define GONIOCAM_EXR_LIBRARY_H

#include "exr.h"

#include <openexr.h>

/** OpenEXR's settings, with its messages going to story->text, which has to live as long. */
exr_context_initializer_t exr_initializer(struct error *story);
#endif
