/* goniometer.c -- a virtual gonioreflectometer: rays onto a patch, counted where they leave.
 *
 * Method.   Parallel light from a random direction crosses the patch's mean plane at an even place;
 *           each ray is followed from bounce to bounce, with the micro-BRDF's own samples, until it
 *           leaves. By definition f cos(theta_o) dw_o is the part of the light that leaves into
 * dw_o, so that over a bin of pairs of directions
 *
 *               f = E[weight / p(wi); pair in bin] / (integral of cos(theta_o) dw_i dw_o over the
 * bin)
 *
 *           Bins are even in theta_h, theta_d and phi_d, which is folded by reciprocity and about
 * the plane of incidence; in between f is linear. Bins that no ray met take what their neighbours
 * have. Accuracy. One over the root of the rays in a bin; and a bin's width, 2 x 3 x 10 degrees:
 * lobes are to be wider than that. Source.   S. Westin, J. Arvo, K. Torrance, "Predicting
 * Reflectance Functions from Complex Surfaces", SIGGRAPH 1992.
 */
#include "goniometer.h"

#include "calib.h"
#include "random.h"
#include "shapes.h"

#include <stdlib.h>
#include <string.h>

enum { TH = 45, TD = 30, PD = 9, BINS = TH * TD * PD, CHUNKS = 64 };
static const double quarter = CAP_PI / 2;
static const double steepest = 89 * CAP_PI / 180;  // of the light

// What one part of the rays brought.
struct tally {
    double weight[BINS][3];
    double out, absorbed, lost;
};

/** phi_d folded to [0, pi/2]: wi and wo swapped is pi further, the mirror image is its negative. */
static double folded(double phi_d)
{
    return acos(fmin(1, fabs(cos(phi_d))));
}

static int bin_of(half_diff a)
{
    int h = (int)fmin(a.theta_h / quarter * TH, TH - 1);
    int d = (int)fmin(a.theta_d / quarter * TD, TD - 1);
    int p = (int)fmin(folded(a.phi_d) / quarter * PD, PD - 1);
    return (h * TD + d) * PD + p;
}

/* ---- rays ---------------------------------------------------------------------------------------
 */

// A ray leaves in a direction drawn from the micro-BRDF; its weight changes. false: absorbed.
static bool scatter(const struct material *material, vec3 normal, vec3 *direction, double weight[3],
                    struct random *random)
{
    vec3 x, y, back = vec3_scale(*direction, -1);
    sam_frame(normal, &x, &y);
    vec3 wi = {vec3_dot(back, x), vec3_dot(back, y), vec3_dot(back, normal)};
    if (wi.z <= 0)
        return false;
    if (sam_material_mirrors(material)) {
        for (int c = 0; c < 3; c++)
            weight[c] *= material->mirror[c];
        *direction = vec3_add(*direction, vec3_scale(normal, 2 * wi.z));
        return true;
    }
    const struct material_part *part = &material->part[0];
    struct brdf brdf = {.model = part->model};
    memcpy(brdf.value, part->parameter, sizeof brdf.value);
    double u[3] = {sam_uniform(random), sam_uniform(random), sam_uniform(random)}, f[3];
    vec3 wo;
    double pdf = rec_brdf_sample(&brdf, wi, u, &wo);
    if (!(pdf > 0) || wo.z <= 0)
        return false;
    rec_brdf_eval(&brdf, wi, wo, f);
    for (int c = 0; c < 3; c++)
        weight[c] *= part->scale[c] * f[c] * wo.z / pdf;
    *direction =
        vec3_add(vec3_add(vec3_scale(x, wo.x), vec3_scale(y, wo.y)), vec3_scale(normal, wo.z));
    return true;
}

static double mean(const double w[3])
{
    return (w[0] + w[1] + w[2]) / 3;
}

// Follow one ray of light from wi (towards the light) until it leaves; true: along *wo.
static bool follow(const struct patch_mesh *patch, const struct surface *surface, vec3 wi,
                   struct random *random, double weight[3], vec3 *wo)
{
    vec3 target = {(2 * sam_uniform(random) - 1) * patch->core,
                   (2 * sam_uniform(random) - 1) * patch->core, 0};
    struct ray ray = {vec3_add(target, vec3_scale(wi, patch->top / wi.z)), vec3_scale(wi, -1)};
    for (int bounce = 0; bounce <= surface->bounces; bounce++) {
        mesh_hit hit = cal_mesh_meet(patch->mesh, ray.origin, ray.direction);
        if (hit.s == INFINITY) {
            *wo = ray.direction;
            return bounce > 0 && ray.direction.z > 0;
        }
        ray.origin = sam_at(ray, hit.s);
        if (bounce == surface->bounces
            || !scatter(&surface->material, hit.normal, &ray.direction, weight, random))
            return false;
    }
    return false;
}

// Light comes from angles that are even in theta_i: grazing bins get their share.
static void shoot(struct tally *tally, const struct patch_mesh *patch,
                  const struct surface *surface, uint64_t index)
{
    struct random random = sam_random_at(surface->seed, 3, index);
    double theta = sam_uniform(&random) * steepest, phi = 2 * CAP_PI * sam_uniform(&random);
    double density = 1 / (steepest * 2 * CAP_PI * sin(theta)), weight[3] = {1, 1, 1};
    vec3 wi = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)}, wo;
    if (!follow(patch, surface, wi, &random, weight, &wo)) {
        tally->lost += mean(weight);
        tally->absorbed += 1 - mean(weight);
        return;
    }
    tally->out += mean(weight);
    tally->absorbed += 1 - mean(weight);
    double *bin = tally->weight[bin_of(rec_half_diff(wi, wo))];
    for (int c = 0; c < 3; c++)
        bin[c] += weight[c] / density;
}

/* ---- bins ---------------------------------------------------------------------------------------
 */

/** Integral of cos(theta_o) dw_i dw_o over a bin's pairs above the horizon (light no steeper than
 * it comes), by midpoints; dw_i dw_o = 4 cos(theta_d) dw_h dw_d (Rusinkiewicz's change of
 * variables). */
static double extent(int bin)
{
    enum { PARTS = 6 };
    const double step_h = quarter / TH / PARTS, step_d = quarter / TD / PARTS;
    const double step_p = quarter / PD / PARTS, limit = cos(steepest);
    int h = bin / (TD * PD), d = bin / PD % TD, p = bin % PD;
    double sum = 0;
    for (int i = 0; i < PARTS * PARTS * PARTS; i++) {
        half_diff a = {(h * PARTS + i % PARTS + 0.5) * step_h,
                       (d * PARTS + i / PARTS % PARTS + 0.5) * step_d,
                       (p * PARTS + i / (PARTS * PARTS) + 0.5) * step_p};
        vec3 w[2];
        rec_directions(a, &w[0], &w[1]);
        double solid = 4 * cos(a.theta_d) * sin(a.theta_h) * sin(a.theta_d) * step_h * step_d
                       * step_p * 2 * CAP_PI;
        // phi_d and -phi_d with the light at w[0], and both with it at w[1].
        for (int k = 0; k < 2; k++)
            if (w[k].z > limit && w[1 - k].z > 0)
                sum += 2 * solid * w[1 - k].z;
    }
    return sum;
}

// Empty bins take the mean of those around them that are not, from ring to ring.
static void fill_gaps(double f[BINS][3], bool filled[BINS])
{
    static const int step[3] = {TD * PD, PD, 1}, size[3] = {TH, TD, PD};
    for (bool empty = true, any = true; empty && any;) {
        bool now[BINS];
        memcpy(now, filled, sizeof now);
        empty = any = false;
        for (int bin = 0; bin < BINS; bin++) {
            double sum[3] = {0, 0, 0};
            int at[3] = {bin / (TD * PD), bin / PD % TD, bin % PD}, n = 0;
            for (int k = 0; k < 6 && !now[bin]; k++) {
                int axis = k / 2, to = at[axis] + (k & 1 ? 1 : -1);
                int other = bin + (k & 1 ? 1 : -1) * step[axis];
                if (to < 0 || to >= size[axis] || !now[other])
                    continue;
                n++;
                for (int c = 0; c < 3; c++)
                    sum[c] += f[other][c];
            }
            empty |= !now[bin];
            for (int c = 0; n && c < 3; c++)
                f[bin][c] = sum[c] / n;
            filled[bin] |= n > 0;
            any |= n > 0;
        }
    }
}

// The two bins about a place, in bins, and the share of the second.
static void about(double place, int size, int bin[2], double share[2])
{
    double x = fmin(fmax(place - 0.5, 0), size - 1);
    bin[0] = (int)fmin(x, size - 2);
    bin[1] = bin[0] + 1;
    share[1] = x - bin[0];
    share[0] = 1 - share[1];
}

static void interpolate(double value[3], double f[BINS][3], half_diff a)
{
    int bin[3][2];
    double share[3][2];
    about(a.theta_h / quarter * TH, TH, bin[0], share[0]);
    about(a.theta_d / quarter * TD, TD, bin[1], share[1]);
    about(folded(a.phi_d) / quarter * PD, PD, bin[2], share[2]);
    value[0] = value[1] = value[2] = 0;
    for (int k = 0; k < 8; k++) {
        int i = k & 1, j = k >> 1 & 1, l = k >> 2;
        const double *from = f[(bin[0][i] * TD + bin[1][j]) * PD + bin[2][l]];
        for (int c = 0; c < 3; c++)
            value[c] += share[0][i] * share[1][j] * share[2][l] * from[c];
    }
}

static void tabulate(double *value, const struct tally *all, long long rays)
{
    static double f[BINS][3];
    static bool filled[BINS];
    for (int bin = 0; bin < BINS; bin++) {
        double whole = extent(bin);
        filled[bin] =
            whole > 0 && all->weight[bin][0] + all->weight[bin][1] + all->weight[bin][2] > 0;
        for (int c = 0; c < 3; c++)
            f[bin][c] = filled[bin] ? all->weight[bin][c] / (double)rays / whole : 0;
    }
    fill_gaps(f, filled);
    for (int bin = 0; bin < MERL_BINS; bin++) {
        double rgb[3] = {-1, -1, -1};
        if (rec_merl_above(bin))
            interpolate(rgb, f, rec_merl_center(bin));
        for (size_t c = 0; c < 3; c++)
            value[c * MERL_BINS + (size_t)bin] = rgb[c];
    }
}

/* ---- all ----------------------------------------------------------------------------------------
 */

static void add_up(struct tally *all, const struct tally *part)
{
    for (int bin = 0; bin < BINS; bin++)
        for (int c = 0; c < 3; c++)
            all->weight[bin][c] += part->weight[bin][c];
    all->out += part->out;
    all->absorbed += part->absorbed;
    all->lost += part->lost;
}

// Chunks are the same at any number of threads, and are added in order.
static void measure(struct tally *part, const struct patch_mesh *patch,
                    const struct surface *surface, struct run *run)
{
    cap_stage(run, "goniometer", CHUNKS);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int k = 0; k < CHUNKS; k++) {
        for (long long i = surface->rays * k / CHUNKS; i < surface->rays * (k + 1) / CHUNKS; i++)
            shoot(&part[k], patch, surface, (uint64_t)i);
        cap_step(run);
    }
    for (int k = 1; k < CHUNKS; k++)
        add_up(&part[0], &part[k]);
}

enum status sam_goniometer(struct merl *table, struct light_balance *balance,
                           const struct surface *surface, struct run *run, struct error *err)
{
    struct patch_mesh patch = {0};
    struct tally *part = calloc(CHUNKS, sizeof *part);
    double *value = malloc(3 * (size_t)MERL_BINS * sizeof *value);
    enum status status = part && value ? sam_surface_make(&patch, surface, run->threads, err)
                                       : cap_fail(err, STATUS_MEMORY, "no memory for a table");
    if (!status) {
        double rays = (double)surface->rays;
        measure(part, &patch, surface, run);
        tabulate(value, &part[0], surface->rays);
        *balance = (struct light_balance){part[0].out / rays, part[0].absorbed / rays,
                                          part[0].lost / rays};
        table->value = value;
        value = NULL;
    }
    cal_mesh_free(patch.mesh);
    free(part);
    free(value);
    return status;
}
