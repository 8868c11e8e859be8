/* scene_material.h -- materials of SCENE.yaml. */
#ifndef GONIOCAM_SAMPLES_SCENE_MATERIAL_H
#define GONIOCAM_SAMPLES_SCENE_MATERIAL_H

#include "doc.h"
#include "material.h"

/** Read a material: one of
 *
 *      {model: NAME, PARAMETER: ...}           a reflectance model of goniocam
 *      {sgd: NAME}, {abc: NAME}                published parameters, from the file `materials`
 *      {table: FILE}                           a MERL table
 *      {mirror: REFLECTANCE}                   an ideal mirror, where that is allowed
 *
 *  or a list of these, which are summed; each may have a `scale`. Files are named from the
 *  scene's folder. Errors are kept by the document. */
void sam_read_material(struct material *material, struct doc *doc, doc_node node, bool may_mirror);
#endif
