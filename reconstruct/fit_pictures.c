/* fit_pictures.c -- fits beside the table that they stand for, as pictures of a sphere.
 *
 * Method.   The lamp's picture is sphere.h's. The room's is seen as that one is, 48 x 48 pixels,
 *           under a window of 30 x 30 degrees and a dim sky, together about as bright on a white
 *           surface; 64 directions each. Linear values are clipped to [0, 1], as a display does;
 *           only the sphere's pixels count. PSNR with peak 1; CIEDE2000 takes the channels for
 *           linear sRGB's.
 */
#include "sphere.h"

#include <stdlib.h>

enum { SIZE = 48, PART = 8, LIGHTS = 2 * PART * PART };

static const double most_psnr = 120;  // of pictures that are alike

// Light from some directions.
struct lighting {
    vec3 to[LIGHTS];
    double irradiance[LIGHTS];  // on a surface that faces it
};

// The window, over the viewer's left shoulder; and the sky, which is up.
static struct lighting room(void)
{
    struct lighting l;
    int n = 0;
    for (int k = 0; k < PART * PART; k++) {
        double x = (k % PART + 0.5) / PART, y = ((double)(k / PART) + 0.5) / PART;
        double across = (x - 0.5) * CAP_PI / 6 - 0.6, height = (y - 0.5) * CAP_PI / 6 + 0.5;
        l.to[n] = (vec3){sin(across) * cos(height), sin(height), cos(across) * cos(height)};
        l.irradiance[n++] = 0.8 * CAP_PI / (PART * PART);
        double phi = 2 * CAP_PI * x, sine = sqrt(1 - y * y);
        l.to[n] = (vec3){sine * cos(phi), y, sine * sin(phi)};
        l.irradiance[n++] = 0.4 * CAP_PI / (PART * PART);  // half of it on a flat roof
    }
    return l;
}

// One pixel of the sphere whose normal is n.
static void shade(const struct brdf *brdf, const struct lighting *l, vec3 n, double pixel[3])
{
    vec3 wi[LIGHTS], wo[LIGHTS];
    double f[LIGHTS][3];
    vec3 t = vec3_normalize(vec3_cross(n, fabs(n.x) < 0.7 ? (vec3){1, 0, 0} : (vec3){0, 1, 0}));
    vec3 b = vec3_cross(n, t);
    for (int k = 0; k < LIGHTS; k++) {
        wi[k] = (vec3){vec3_dot(l->to[k], t), vec3_dot(l->to[k], b), vec3_dot(l->to[k], n)};
        wo[k] = (vec3){t.z, b.z, n.z};
    }
    rec_brdf_eval_many(brdf, wi, wo, f, LIGHTS);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int k = 0; k < LIGHTS; k++)
            sum += f[k][c] * fmax(0, wi[k].z) * l->irradiance[k];
        pixel[c] = fmin(1, fmax(0, sum));
    }
}

// All pixels of the sphere, row by row; returns how many.
static int draw(const struct brdf *brdf, const struct lighting *l, double (*pixel)[3])
{
    int count = 0;
    for (int j = 0; j < SIZE; j++)
        for (int i = 0; i < SIZE; i++) {
            double x = (2 * i + 1.0) / SIZE - 1, y = 1 - (2 * j + 1.0) / SIZE;
            double z2 = 1 - x * x - y * y;
            if (z2 > 0)
                shade(brdf, l, (vec3){x, y, sqrt(z2)}, pixel[count++]);
        }
    return count;
}

static void compare(const double (*a)[3], const double (*b)[3], int count, double *psnr,
                    double *delta_e)
{
    double square = 0, difference = 0;
    for (int i = 0; i < count; i++) {
        for (int c = 0; c < 3; c++)
            square += (a[i][c] - b[i][c]) * (a[i][c] - b[i][c]);
        difference += rec_delta_e(a[i], b[i]);
    }
    *psnr = fmin(most_psnr, 10 * log10(3.0 * count / square));
    *delta_e = difference / count;
}

// The table's pictures, and room for a fit's.
struct pictures {
    float lamp[SPHERE_SIZE * SPHERE_SIZE * 3];
    double room[SIZE * SIZE][3];
};

static enum status look(struct fit *fit, struct pictures *own, const struct pictures *table,
                        const struct lighting *l, struct error *err)
{
    struct brdf brdf = {.model = fit->model};
    struct picture_errors errors;
    for (int k = 0; k < MODEL_PARAMETERS_MAX; k++)
        brdf.value[k] = fit->value[k];
    rec_lit_sphere(own->lamp, &brdf, 1);
    enum status status = rec_sphere_compare(&errors, own->lamp, table->lamp, err);
    if (status)
        return status;
    fit->psnr[0] = fmin(most_psnr, errors.psnr);
    fit->delta_e[0] = errors.delta_e;
    int count = draw(&brdf, l, own->room);
    compare((const double(*)[3])own->room, table->room, count, &fit->psnr[1], &fit->delta_e[1]);
    return STATUS_OK;
}

enum status rec_fit_pictures(struct fits *fits, const struct brdf *table, struct run *run,
                             struct error *err)
{
    struct pictures *p = malloc((size_t)(fits->count + 1) * sizeof *p);
    if (!p)
        return cap_fail(err, STATUS_MEMORY, "no memory for pictures of fits");
    const struct lighting l = room();
    enum status status = STATUS_OK;
    rec_lit_sphere(p[0].lamp, table, run->threads);
    draw(table, &l, p[0].room);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int i = 0; i < fits->count; i++)
        if (look(&fits->fit[i], &p[i + 1], &p[0], &l, NULL)) {
#pragma omp critical(fit)
            status = STATUS_MEMORY;
        }
    free(p);
    return status ? cap_fail(err, status, "no memory for pictures of fits") : STATUS_OK;
}
