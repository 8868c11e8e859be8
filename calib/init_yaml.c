/* init_yaml.c -- a first capture.yaml, with comments for the person who completes it. */
#include "init.h"

#include <string.h>

static void write_photographs(FILE *to, const struct capture *c)
{
    fprintf(to, "# %d photographs in %d shots (`goniocam merge %s --dry-run` lists them).\n",
            c->photos, c->shots, c->folder);
    for (int k = 0; k < c->cameras; k++) {
        const struct camera_kind *camera = &c->camera[k];
        int shots = 0;
        for (int i = 0; i < c->shots; i++)
            shots += c->shot[i].camera == k;
        fprintf(to, "# camera %s: %d x %d", camera->name, camera->width, camera->height);
        if (camera->focal_length > 0)
            fprintf(to, ", %g mm", camera->focal_length);
        fprintf(to, ", %d shot%s\n", shots, shots == 1 ? "" : "s");
    }
}

static double rounded(double x, int digits)
{
    double unit = pow(10, digits);
    return round(x * unit) / unit + 0.0;  // never -0
}

static void write_vector(FILE *to, const char *key, vec3 v, int digits)
{
    fprintf(to, "%s: [%.*f, %.*f, %.*f]", key, digits, rounded(v.x, digits), digits,
            rounded(v.y, digits), digits, rounded(v.z, digits));
}

// Along the board's own axes to a quarter of a milliradian, which is what files say without axes.
static bool is_along(const struct tag_place *p)
{
    const vec3 x = {1, 0, 0}, y = {0, 1, 0};
    return vec3_length(vec3_sub(p->x_axis, x)) < 2.5e-4
           && vec3_length(vec3_sub(p->y_axis, y)) < 2.5e-4;
}

static double largest_sigma(const struct calibration *c)
{
    double largest = 0;
    for (int i = 0; i < c->tags; i++)
        for (int k = 0; k < 3; k++)
            largest = fmax(largest, c->tag[i].sigma_center[k]);
    return largest;
}

static void write_board(FILE *to, const struct init_finding *f, double size)
{
    const struct calibration *c = &f->found;
    fprintf(
        to,
        "\n# Origin: the middle of the tags. x: the right of tag %d; z: out of the board. All mm."
        "\n# Lengths are as good as the %g mm of --tag-size: measure a printed square's black side."
        "\nboard:\n  family: %s\n  place_sigma: %.4f   # how well the photographs place the tags\n"
        "  tags:\n",
        c->tags ? c->tag[0].place.id : 0, size, f->family, fmax(largest_sigma(c), 1e-3));
    for (int i = 0; i < c->tags; i++) {
        const struct tag_place *p = &c->tag[i].place;
        fprintf(to, "  - {id: %d, size: %g, ", p->id, p->size);
        write_vector(to, "center", p->center, 3);
        if (!is_along(p)) {
            fprintf(to, ", ");
            write_vector(to, "x_axis", p->x_axis, 6);
            fprintf(to, ", ");
            write_vector(to, "y_axis", p->y_axis, 6);
        }
        fprintf(to, "}   # seen in %d shots\n", c->tag[i].views);
    }
}

static void write_frames(FILE *to, const char *key, const struct frame_names *frames)
{
    for (int i = 0; i < frames->count; i++)
        fprintf(to, "%s%s", i ? ", " : "", i ? "" : key);
    for (int i = 0; i < frames->count; i++)
        fprintf(to, "%s\"%s\"%s", i ? ", " : ": [", frames->name[i],
                i == frames->count - 1 ? "]\n" : "");
}

static void write_rest(FILE *to, const struct capture *c)
{
    fputs(
        "\n# FILL IN: the sample, where it stands, to a tenth of its size.\n"
        "# sample: {shape: sphere, radius: 25, center: [0, 0, 45]}\n"
        "# sample: {shape: cylinder, radius: 18, height: 70, center: [0, 0, 45], axis: [1, 0, 0]}\n"
        "# sample: {shape: mesh, file: vase.ply, pose: [0, 0, 0.3, 10, 0, 40]}\n"
        "\n# FILL IN: the white patch; corners bottom left, bottom right, top right, top left.\n"
        "# reference:\n#   albedo: 0.99\n"
        "#   corners: [[55, -20, 2], [95, -20, 2], [95, 20, 2], [55, 20, 2]]\n"
        "\n# FILL IN only if the lamp was moved, or sat on the camera (frame: camera):\n"
        "# lights:\n# - {name: low, photos: \"low_*\"}\n# - {name: high, photos: \"high_*\"}\n\n",
        to);
    write_frames(to, "flat", &c->flat_frames);
    write_frames(to, "dark", &c->dark_frames);
    write_frames(to, "ambient", &c->ambient_frames);
}

enum status init_write(const struct init_finding *finding, double size, const char *path,
                       struct error *err)
{
    struct atomic_file file;
    enum status status = cap_file_begin(&file, path, true, err);
    if (status)
        return status;
    fputs("goniocam: 1\n", file.stream);
    write_photographs(file.stream, &finding->capture);
    write_board(file.stream, finding, size);
    write_rest(file.stream, &finding->capture);
    return cap_file_commit(&file, err);
}
