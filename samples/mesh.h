/* mesh.h -- a scanned object: triangles with smooth normals. */
#ifndef GONIOCAM_SAMPLES_MESH_H
#define GONIOCAM_SAMPLES_MESH_H

#include "shapes.h"

struct mesh;
/** Read PLY or OBJ (or what else Assimp reads), all of its meshes as one. Normals that the file
 * does not give are made, smooth over edges below 60 degrees. Lengths are multiplied by `scale`,
 * the result is turned by `rotation` and moved so that the middle of its box comes to `center`. On
 * success the caller owns *mesh. STATUS_IO, STATUS_FORMAT (no triangles), STATUS_MEMORY. */
enum status sam_mesh_read(struct mesh **mesh, const char *path, double scale, vec3 rotation,
                          vec3 center, struct error *err);
/** From arrays: point and normal [points], triangle [triangles] of indices, counter-clockwise from
 *  outside. */
enum status sam_mesh_make(struct mesh **mesh, const vec3 *point, const vec3 *normal, int points,
                          const unsigned (*triangle)[3], int triangles, struct error *err);
void sam_mesh_free(struct mesh *mesh);
/** A ball about the mesh. */
void sam_mesh_reach(const struct mesh *mesh, vec3 *center, double *radius);
int sam_mesh_triangles(const struct mesh *mesh);
/** The first crossing with s > 0, far enough from the start not to meet the surface it starts from:
 *  1e-4 of the mesh's radius. The normal is the smooth one, turned to the side of the ray's origin
 *  where it would show its back. face tells nothing: all is one smooth surface. */
struct crossing sam_cross_mesh(struct ray ray, const struct mesh *mesh);
#endif
