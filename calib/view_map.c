/* view_map.c -- the radiance map of a view. */
#include "view_map.h"

#include <math.h>
#include <stdlib.h>

enum status cal_view_map(struct radiance *map, const char *out, const struct view *view,
                         struct error *err)
{
    char name[512];
    snprintf(name, sizeof name, "radiance/%s.exr", view->name);
    char *path = cap_path(out, name);
    enum status status =
        path ? cap_radiance_open(map, path, err) : cap_fail(err, STATUS_MEMORY, "%s", name);
    free(path);
    if (!status && (status = cap_glare_remove(map, view->glare, view->sigma_glare, err)))
        cap_radiance_free(map);
    return status;
}

int cal_measured(const struct radiance *map, const float variance[3], bool measured[3])
{
    int count = 0;
    for (int c = 0; c < 3; c++)
        count += measured[c] = isfinite(variance[c]);
    return *map->cfa || count == 3 ? count : 0;
}

struct lattice cal_lattice(const struct radiance *map, double region)
{
    const double wanted = 16384;
    int step = (int)sqrt(region / wanted);
    return (struct lattice){*map->cfa ? 2 : 1, step > 1 ? step : 1};
}

// Photosites that share their colour have a lightness of their own: JPEG's (ITU-R BT.601), in which
// what colour an edge has does not show.
static const double MEAN[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3}, LIGHTNESS[3] = {0.299, 0.587, 0.114};

bool cal_gray(const struct radiance *map, int x, int y, double *value, double *variance)
{
    const double *w = map->chroma[0] > 1 || map->chroma[1] > 1 ? LIGHTNESS : MEAN;
    bool measured[3];
    float v[3], var[3];
    cap_radiance_at(map, x, y, v, var);
    int count = cal_measured(map, var, measured);
    double sum = 0;
    *value = 0;
    for (int c = 0; c < 3; c++) {
        sum += measured[c] ? w[c] * w[c] * (double)var[c] : 0;
        *value += w[c] * (double)v[c];
    }
    // A channel that was not measured here is as noisy as the one that was.
    *variance = count ? sum * 3 / count : INFINITY;
    return count > 0;
}
