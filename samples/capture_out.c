/* capture_out.c -- capture.yaml of a rendered capture: what a person with a ruler would write.
 *
 * The lamps' places, the true place of the sample and the sensor's levels stay in truth.json.
 */
#include "capture_out.h"

#include "truth.h"

static void write_point(struct yaml_out *out, const char *key, vec3 p)
{
    cap_yaml_numbers(out, key, (const double[]){p.x, p.y, p.z}, 3);
}

static void write_board(struct yaml_out *out, const struct scene_board *board)
{
    cap_yaml_map(out, "board");
    cap_yaml_text(out, "family", board->family);
    cap_yaml_list(out, "tags");
    for (int i = 0; i < board->tags; i++) {
        const struct tag_place *tag = &board->tag[i];
        cap_yaml_flow_map(out, NULL);
        cap_yaml_int(out, "id", tag->id);
        cap_yaml_number(out, "size", tag->size);
        write_point(out, "center", tag->center);
        if (tag->x_axis.x != 1 || tag->y_axis.y != 1) {
            write_point(out, "x_axis", tag->x_axis);
            write_point(out, "y_axis", tag->y_axis);
        }
        cap_yaml_close(out);
    }
    cap_yaml_close(out);
    cap_yaml_close(out);
}

/** A scanned object is named, and where it stands. */
static void write_mesh(struct yaml_out *out, const struct scene_sample *sample)
{
    cap_yaml_flow_map(out, "sample");
    cap_yaml_text(out, "shape", "mesh");
    cap_yaml_text(out, "file", sam_mesh_name(sample));
    if (sample->scale != 1)
        cap_yaml_number(out, "scale", sample->scale);
    const vec3 r = sample->world_from_file.rotation, t = sample->world_from_file.translation;
    const double place[6] = {r.x, r.y, r.z, t.x, t.y, t.z};
    cap_yaml_numbers(out, "pose", place, 6);
    cap_yaml_close(out);
}

static void write_sample(struct yaml_out *out, const struct sample_place *place)
{
    bool sphere = place->shape == SHAPE_SPHERE;
    cap_yaml_flow_map(out, "sample");
    cap_yaml_text(out, "shape", sphere ? "sphere" : "cylinder");
    cap_yaml_number(out, "radius", place->radius);
    if (!sphere)
        cap_yaml_number(out, "height", place->height);
    write_point(out, "center", place->center);
    if (!sphere)
        write_point(out, "axis", place->axis);
    cap_yaml_close(out);
}

static void write_patch(struct yaml_out *out, const char *key, const struct patch *patch)
{
    cap_yaml_map(out, key);
    cap_yaml_number(out, "albedo", patch->albedo);
    cap_yaml_flow_list(out, "corners");
    for (int k = 0; k < 4; k++)
        write_point(out, NULL, patch->corner[k]);
    cap_yaml_close(out);
    cap_yaml_close(out);
}

static void write_patches(struct yaml_out *out, const struct scene *scene)
{
    if (scene->patches == 1)
        write_patch(out, "reference", &scene->patch[0].patch);
    if (scene->patches < 2)
        return;
    cap_yaml_list(out, "reference");
    for (int i = 0; i < scene->patches; i++)
        write_patch(out, NULL, &scene->patch[i].patch);
    cap_yaml_close(out);
}

/** A lamp that no shot uses is left out: nobody would write it down. */
static void write_lights(struct yaml_out *out, const struct scene *scene)
{
    cap_yaml_list(out, "lights");
    for (int l = 0; l < scene->lamps; l++) {
        bool used = false;
        for (int i = 0; i < scene->shots; i++) {
            if (scene->shot[i].lamp != l)
                continue;
            char name[PHOTO_NAME], glob[PHOTO_NAME + 2];
            sam_shot_name(name, scene, i);
            snprintf(glob, sizeof glob, "%s_*", name);
            if (!used) {
                cap_yaml_map(out, NULL);
                cap_yaml_text(out, "name", scene->lamp[l].name);
                if (scene->lamp[l].on_camera)
                    cap_yaml_text(out, "frame", "camera");
                if (scene->lamp[l].radius > 0)
                    cap_yaml_number(out, "radius", scene->lamp[l].radius);
                cap_yaml_flow_list(out, "photos");
                used = true;
            }
            cap_yaml_text(out, NULL, glob);
        }
        if (used) {
            cap_yaml_close(out);
            cap_yaml_close(out);
        }
    }
    cap_yaml_close(out);
}

static void write_file(struct yaml_out *out, const char *key, const char *name,
                       const struct scene *scene)
{
    char file[32];
    snprintf(file, sizeof file, "%s.%s", name, sam_photo_extension(scene));
    cap_yaml_text(out, key, file);
}

enum status sam_capture_write(const struct scene *scene, const char *path, struct error *err)
{
    struct yaml_out *out;
    enum status status = cap_yaml_begin(&out, path, err);
    if (status)
        return status;
    cap_yaml_int(out, "goniocam", 1);
    write_board(out, &scene->board);
    if (scene->sample.mesh)
        write_mesh(out, &scene->sample);
    else
        write_sample(out, &scene->sample.nominal);
    write_patches(out, scene);
    write_lights(out, scene);
    cap_yaml_flow_map(out, "photos");
    write_file(out, "pattern", "shot*", scene);
    cap_yaml_close(out);
    if (scene->flat)
        write_file(out, "flat", "flat", scene);
    if (scene->dark)
        write_file(out, "dark", "dark", scene);
    if (scene->ambient_frames)
        write_file(out, "ambient", scene->ambient_frames == AMBIENT_EACH ? "ambient*" : "ambient",
                   scene);
    if (scene->format == PHOTO_JPEG && scene->tone.gamma == 0 && scene->tone.values == 0)
        cap_yaml_text(out, "response", "srgb");
    return cap_yaml_end(out, true, err);
}
