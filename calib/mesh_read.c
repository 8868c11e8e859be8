/* mesh_read.c -- files of meshes, through Assimp's C interface. */
#include "calib.h"

#include <assimp/cimport.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <stdlib.h>

/** All meshes of a file in one list. */
struct soup {
    vec3 *point, *normal;
    unsigned (*triangle)[3];
    int points, triangles;
};

static vec3 as_vec3(struct aiVector3D v)
{
    return (vec3){(double)v.x, (double)v.y, (double)v.z};
}

static void append(struct soup *soup, const struct aiMesh *mesh)
{
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        const struct aiFace *face = &mesh->mFaces[i];
        if (face->mNumIndices != 3)
            continue;  // points and lines
        for (int k = 0; k < 3; k++)
            soup->triangle[soup->triangles][k] = (unsigned)soup->points + face->mIndices[k];
        soup->triangles++;
    }
    for (unsigned i = 0; i < mesh->mNumVertices; i++) {
        soup->point[soup->points] = as_vec3(mesh->mVertices[i]);
        soup->normal[soup->points++] = as_vec3(mesh->mNormals[i]);
    }
}

static bool gather(struct soup *soup, const struct aiScene *scene)
{
    size_t points = 1, faces = 1;  // one more, so that nothing is no failure
    for (unsigned i = 0; i < scene->mNumMeshes; i++) {
        points += scene->mMeshes[i]->mNumVertices;
        faces += scene->mMeshes[i]->mNumFaces;
    }
    soup->point = calloc(points, sizeof *soup->point);
    soup->normal = calloc(points, sizeof *soup->normal);
    soup->triangle = calloc(faces, sizeof *soup->triangle);
    if (!soup->point || !soup->normal || !soup->triangle || points > 1u << 30 || faces > 1u << 30)
        return false;
    for (unsigned i = 0; i < scene->mNumMeshes; i++)
        if (scene->mMeshes[i]->mNormals)
            append(soup, scene->mMeshes[i]);
    return true;
}

static void place(struct soup *soup, double scale, pose world_from_file)
{
    mat3 r = cal_rotation(world_from_file.rotation);
    for (int i = 0; i < soup->points; i++) {
        soup->point[i] =
            vec3_add(mat3_mul(&r, vec3_scale(soup->point[i], scale)), world_from_file.translation);
        soup->normal[i] = mat3_mul(&r, soup->normal[i]);
    }
}

enum status cal_mesh_read(struct mesh **mesh, const char *path, double scale, pose world_from_file,
                          struct error *err)
{
    const unsigned steps = aiProcess_Triangulate | aiProcess_JoinIdenticalVertices
                           | aiProcess_PreTransformVertices | aiProcess_GenSmoothNormals;
    struct aiPropertyStore *options = aiCreatePropertyStore();
    if (options)
        aiSetImportPropertyFloat(options, "PP_GSN_MAX_SMOOTHING_ANGLE", 60);
    const struct aiScene *scene = aiImportFileExWithProperties(path, steps, NULL, options);
    struct soup soup = {0};
    enum status status = STATUS_OK;
    if (!scene)
        status = cap_fail(err, STATUS_IO, "%s: %s", path, aiGetErrorString());
    else if (!gather(&soup, scene))
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
    else if (soup.triangles == 0)
        status = cap_fail(err, STATUS_FORMAT, "%s: holds no triangles", path);
    else {
        place(&soup, scale, world_from_file);
        status = cal_mesh_make(mesh, soup.point, soup.normal, soup.points,
                               (const unsigned(*)[3])soup.triangle, soup.triangles, err);
    }
    free(soup.point);
    free(soup.normal);
    free(soup.triangle);
    aiReleaseImport(scene);
    if (options)
        aiReleasePropertyStore(options);
    return status;
}

enum status cal_sample_load(struct sample *sample, struct error *err)
{
    if (!sample->file)
        return cap_fail(err, STATUS_FORMAT, "sample: a mesh needs its `file`");
    enum status status =
        cal_mesh_read(&sample->mesh, sample->file, sample->scale, sample->world_from_file, err);
    if (!status)
        cal_mesh_reach(sample->mesh, &sample->center, &sample->radius);
    return status;
}
