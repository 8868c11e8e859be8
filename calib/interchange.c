/* interchange.c -- calibrations for other programs: OpenCV's YAML and COLMAP's text model. */
#include "interchange.h"

#include <stdlib.h>

static void print_numbers(FILE *to, const char *separator, const double *value, int count)
{
    for (int i = 0; i < count; i++)
        fprintf(to, "%s%.17g", i ? separator : "", value[i]);
}

static void print_matrix(FILE *to, const char *key, int rows, int columns, const double *value)
{
    fprintf(to, "%s: !!opencv-matrix\n   rows: %d\n   cols: %d\n   dt: d\n   data: [ ", key, rows,
            columns);
    print_numbers(to, ", ", value, rows * columns);
    fprintf(to, " ]\n");
}

enum status cal_write_opencv(const struct camera *c, const char *path, struct error *err)
{
    struct atomic_file file;
    const double matrix[9] = {c->focal[0], 0, c->center[0], 0, c->focal[1], c->center[1], 0, 0, 1};
    enum status status = cap_file_begin(&file, path, true, err);
    if (status)
        return status;
    fprintf(file.stream, "%%YAML:1.0\n---\nimage_width: %d\nimage_height: %d\n", c->width,
            c->height);
    print_matrix(file.stream, "camera_matrix", 3, 3, matrix);
    print_matrix(file.stream, "distortion_coefficients", 1, 5, c->distortion);
    fprintf(file.stream, "avg_reprojection_error: %.17g\n", c->rms_px);
    return cap_file_commit(&file, err);
}

void cal_quaternion(vec3 rotation, double q[4])
{
    double angle = vec3_length(rotation), half = 0.5 * angle;
    double s = angle < 1e-8 ? 0.5 : sin(half) / angle;  // the next term of the series is 1e-17
    q[0] = cos(half);
    q[1] = s * rotation.x;
    q[2] = s * rotation.y;
    q[3] = s * rotation.z;
    for (int i = 0; i < 4 && cos(half) < 0; i++)  // q and -q are one rotation
        q[i] = -q[i];
}

static void print_cameras(FILE *to, const struct calibration *c)
{
    fprintf(to, "# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6\n");
    for (int i = 0; i < c->cameras; i++) {
        const struct camera *m = c->camera + i;
        const double *d = m->distortion;
        const double all[12] = {m->focal[0],
                                m->focal[1],
                                m->center[0] + 0.5,
                                m->center[1] + 0.5,
                                d[0],
                                d[1],
                                d[2],
                                d[3],
                                d[4],
                                0,
                                0,
                                0};
        fprintf(to, "%d FULL_OPENCV %d %d ", i + 1, m->width, m->height);
        print_numbers(to, " ", all, 12);
        fputc('\n', to);
    }
}

static void print_images(FILE *to, const struct calibration *c)
{
    fprintf(to, "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of points\n");
    for (int i = 0; i < c->views; i++) {
        const struct view *v = c->view + i;
        const vec3 t = v->view_from_world.translation;
        double all[7] = {0, 0, 0, 0, t.x, t.y, t.z};
        cal_quaternion(v->view_from_world.rotation, all);
        fprintf(to, "%d ", i + 1);
        print_numbers(to, " ", all, 7);
        fprintf(to, " %d %s\n\n", v->camera + 1, v->name);
    }
}

static void print_points(FILE *to, const struct calibration *c)
{
    (void)c;
    fprintf(to, "# POINT3D_ID X Y Z R G B ERROR TRACK: none\n");
}

static enum status write_part(const struct calibration *c, const char *folder, const char *name,
                              void (*print)(FILE *to, const struct calibration *c),
                              struct error *err)
{
    struct atomic_file file;
    char *path = cap_path(folder, name);
    enum status status =
        path ? cap_file_begin(&file, path, true, err) : cap_fail(err, STATUS_MEMORY, "%s", folder);
    if (!status) {
        print(file.stream, c);
        status = cap_file_commit(&file, err);
    }
    free(path);
    return status;
}

enum status cal_write_colmap(const struct calibration *c, const char *folder, struct error *err)
{
    enum status status = cap_make_folder(folder, err);
    if (!status)
        status = write_part(c, folder, "cameras.txt", print_cameras, err);
    if (!status)
        status = write_part(c, folder, "images.txt", print_images, err);
    return status ? status : write_part(c, folder, "points3D.txt", print_points, err);
}
