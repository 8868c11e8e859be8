/* scene_board.h -- the flat things of SCENE.yaml: sheet, tags, patches. */
#ifndef GONIOCAM_SAMPLES_SCENE_BOARD_H
#define GONIOCAM_SAMPLES_SCENE_BOARD_H

#include "doc.h"
#include "scene.h"

/** Read the mapping `board`. false: out of memory; other errors are kept by the document. */
bool sam_read_board(struct scene_board *board, struct doc *doc, doc_node node);
/** Read `patch`: one patch, or a list of them, or 0 for none. */
bool sam_read_patches(struct scene *scene, struct doc *doc, doc_node node);
#endif
