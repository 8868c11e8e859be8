/* bench_samples.c -- samples a second from a radiance map in memory to bins, on one thread: of a
 * ball, and of a mesh of it.
 *
 *     build/release/tests/bench_samples [WIDTH]        a frame WIDTH x 2/3 WIDTH, default 3000
 *
 * A mesh is traced once a view, on all threads of rec_raster_make: here one. Its figure is told
 * with and without that.
 */
#include "raster.h"
#include "shot_bins.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

// Of all threads, so that what else the machine does counts little.
static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void fill(struct radiance *map)
{
    size_t count = 3 * (size_t)map->width * (size_t)map->height;
    map->value = malloc(count * sizeof *map->value);
    map->variance = malloc(count * sizeof *map->variance);
    for (size_t i = 0; map->value && map->variance && i < count; i++) {
        map->value[i] = 0.1F + 1e-4F * (float)(i % 97);
        map->variance[i] = 1e-6F;
    }
}

// One pass over the frame; the samples that were used.
static int64_t pass(struct tally *tally, struct shot_bins *shot, const struct viewing *v,
                    const struct radiance *map)
{
    pixel_box box = rec_sample_box(v);
    int64_t used = 0;
    struct strip s = {.from = 0, .to = LANES};
    for (s.y = box.y0; s.y < box.y1; s.y++)
        for (s.x0 = box.x0 / LANES * LANES; s.x0 < box.x1; s.x0 += LANES) {
            s.to = map->width - s.x0 < LANES ? map->width - s.x0 : LANES;
            rec_strip_make(&s, v, map);
            for (int i = 0; i < LANES; i++)
                used += s.fate[i] == FATE_USED;
            if (rec_strip_narrow(&s) && rec_shot_add(shot, &s, NULL))
                return 0;
        }
    return rec_shot_end(shot, tally, NULL) ? 0 : used;
}

// A ball as a net of triangles.
static struct mesh *make_ball(double radius)
{
    enum { AROUND = 512, UP = 256, POINTS = AROUND * (UP + 1), TRIANGLES = 2 * AROUND * UP };
    vec3 *point = malloc(POINTS * sizeof *point), *normal = malloc(POINTS * sizeof *normal);
    unsigned(*triangle)[3] = malloc(TRIANGLES * sizeof *triangle);
    struct mesh *mesh = NULL;
    for (int k = 0; point && normal && k < POINTS; k++) {
        int up = k / AROUND;
        double theta = CAP_PI * up / UP, phi = 2 * CAP_PI * (k % AROUND) / AROUND;
        normal[k] = (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
        point[k] = vec3_scale(normal[k], radius);
    }
    for (unsigned k = 0; triangle && k < TRIANGLES; k++) {
        unsigned row = k / 2 / AROUND, i = k / 2 % AROUND, next = (i + 1) % AROUND;
        unsigned a = row * AROUND + i, c = row * AROUND + next, b = a + AROUND, d = c + AROUND;
        const unsigned corner[2][3] = {{a, b, d}, {a, d, c}};
        memcpy(triangle[k], corner[k % 2], sizeof corner[0]);
    }
    if (point && normal && triangle)
        cal_mesh_make(&mesh, point, normal, POINTS, (const unsigned(*)[3])triangle, TRIANGLES,
                      NULL);
    free(point);
    free(normal);
    free(triangle);
    return mesh;
}

// The best of PASSES, for machines are shared; seconds a pass of tracing count where `traced`.
static void report(const char *what, struct tally *tally, struct shot_bins *shot,
                   const struct viewing *v, const struct radiance *map, double traced)
{
    enum { PASSES = 20 };
    double best = 1e9;
    int64_t used = 0;
    for (int k = 0; k < PASSES; k++) {
        double began = now();
        used = pass(tally, shot, v, map);
        double seconds = now() - began;
        best = seconds < best ? seconds : best;
    }
    printf("%s: %lld samples in %.3f s: %.2f million a second on one core", what, (long long)used,
           best, 1e-6 * (double)used / best);
    if (traced > 0)
        printf("; %.2f with %.3f s of tracing", 1e-6 * (double)used / (best + traced), traced);
    printf("\n");
}

int main(int argc, char **argv)
{
    int width = argc > 1 ? atoi(argv[1]) : 3000;
    if (width < 300 || width > 20000)
        return 2;
    struct camera camera = {.name = "a",
                            .width = width,
                            .height = 2 * width / 3,
                            .focal = {2.0 * width, 2.0 * width},
                            .center = {0.5 * width, width / 3.0}};
    struct view view = {.name = "v", .power = 1, .view_from_world = {{0, 0, 0}, {0, 0, 300}}};
    struct lamp lamp = {.name = "l", .position = {200, -100, -300}, .intensity = {1e5, 1e5, 1e5}};
    struct calibration calibration = {.camera = &camera,
                                      .view = &view,
                                      .lamp = &lamp,
                                      .sample = {.shape = SHAPE_SPHERE, .radius = 40},
                                      .cameras = 1,
                                      .views = 1,
                                      .lamps = 1};
    struct radiance map = {.width = camera.width, .height = camera.height, .channels = 3};
    struct lens_table lens;
    struct tally tally;
    struct shot_bins shot = {.grid = rec_merl_grid};
    fill(&map);
    if (!map.value || !map.variance || rec_lens_make(&lens, &camera, NULL)
        || rec_tally_begin(&tally, rec_merl_grid, NULL))
        return 1;
    struct viewing v = rec_viewing(&calibration, 0, &lens, NULL);
    report("ball", &tally, &shot, &v, &map, 0);
    struct raster raster = {0};
    calibration.sample.shape = SHAPE_MESH;
    calibration.sample.mesh = make_ball(calibration.sample.radius);
    v = rec_viewing(&calibration, 0, &lens, NULL);
    double began = now();
    if (!calibration.sample.mesh || rec_raster_make(&raster, &v, rec_sample_box(&v), NULL))
        return 1;
    double traced = now() - began;
    v.raster = &raster;
    report("mesh", &tally, &shot, &v, &map, traced);
    rec_raster_free(&raster);
    cal_mesh_free(calibration.sample.mesh);
    rec_shot_free(&shot);
    rec_tally_free(&tally);
    rec_lens_free(&lens);
    cap_radiance_free(&map);
    return 0;
}
