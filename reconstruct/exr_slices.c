/* exr_slices.c -- linear pictures of a BRDF: X_slice.exr, f at phi_d = 90 degrees over theta_h (to
 * the right, by its square root, as in the table) and theta_d (up); X_sphere.exr, a sphere under a
 * lamp. */
#include "export.h"
#include "sphere.h"

#include <stdlib.h>
#include <string.h>

static void fill_slice(float *rgb, const struct brdf *brdf)
{
    for (int d = 0; d < MERL_THETA_D; d++)
        for (int h = 0; h < MERL_THETA_H; h++) {
            half_diff a = rec_merl_center(MERL_PHI_D * (d + MERL_THETA_D * h));
            vec3 wi, wo;
            double f[3];
            a.phi_d = CAP_PI / 2;
            rec_directions(a, &wi, &wo);
            rec_brdf_eval(brdf, wi, wo, f);
            for (int c = 0; c < 3; c++)
                rgb[3 * ((MERL_THETA_D - 1 - d) * MERL_THETA_H + h) + c] = (float)f[c];
        }
}

// base + ending; the caller frees it.
static char *with_ending(const char *path, const char *ending)
{
    size_t length = strlen(path);
    char *name = NULL;
    if (length > 4 && strcmp(path + length - 4, ".exr") == 0)
        length -= 4;
    return asprintf(&name, "%.*s%s", (int)length, path, ending) < 0 ? NULL : name;
}

enum status rec_exr_write(const struct exported *what, const char *path, struct run *run,
                          struct error *err)
{
    float *sphere = malloc(3 * SPHERE_SIZE * SPHERE_SIZE * sizeof *sphere);
    float *slice = malloc(3 * (size_t)MERL_THETA_H * MERL_THETA_D * sizeof *slice);
    char *slice_name = with_ending(path, "_slice.exr"),
         *sphere_name = with_ending(path, "_sphere.exr");
    enum status status = STATUS_OK;
    if (!sphere || !slice || !slice_name || !sphere_name) {
        status = cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    } else {
        fill_slice(slice, what->brdf);
        rec_lit_sphere(sphere, what->brdf, run->threads);
        status = cap_picture_write(slice, MERL_THETA_H, MERL_THETA_D, slice_name, err);
    }
    if (!status)
        status = cap_picture_write(sphere, SPHERE_SIZE, SPHERE_SIZE, sphere_name, err);
    free(sphere);
    free(slice);
    free(slice_name);
    free(sphere_name);
    return status;
}
