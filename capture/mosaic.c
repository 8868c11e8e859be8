/* mosaic.c -- maps of one channel a photosite, for those who look at three.
 *
 * The channel that a photosite measured keeps its value and variance. The other two hold the mean
 * of their nearest photosites, for the eye and for edges, and variance +inf: they are no
 * measurement, and whoever weights by variance leaves them out.
 */
#include "exr.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

int cap_radiance_channel(const struct radiance *map, int x, int y)
{
    if (!*map->cfa)
        return -1;
    return cap_cfa_channel(map->cfa, x, y);
}

bool cap_cfa_is_valid(const char *cfa)
{
    size_t size = strlen(cfa);
    return (size == 4 || size == 16 || size == 36 || size == 64) && strspn(cfa, "RGB") == size;
}

/* Mean of channel c over the photosites next to (x, y): those of Bayer's and of X-Trans cells have
 * all channels among them, but not always at the image's border. */
static float nearby(const struct radiance *mosaic, int x, int y, int c)
{
    float sum = 0, count = 0;
    for (int reach = 1; count == 0 && reach <= cap_cfa_side(mosaic->cfa); reach++)
        for (int v = y > reach ? y - reach : 0; v <= y + reach && v < mosaic->height; v++)
            for (int u = x > reach ? x - reach : 0; u <= x + reach && u < mosaic->width; u++)
                if (cap_radiance_channel(mosaic, u, v) == c) {
                    sum += mosaic->value[(size_t)v * mosaic->width + u];
                    count++;
                }
    return count > 0 ? sum / count : 0;
}

static void spread_row(struct radiance *map, const struct radiance *mosaic, int y)
{
    for (int x = 0; x < map->width; x++) {
        size_t from = (size_t)y * map->width + x;
        int own = cap_radiance_channel(mosaic, x, y);
        for (int c = 0; c < 3; c++) {
            map->value[3 * from + c] = c == own ? mosaic->value[from] : nearby(mosaic, x, y, c);
            map->variance[3 * from + c] = c == own ? mosaic->variance[from] : INFINITY;
        }
    }
}

enum status cap_radiance_read(struct radiance *map, const char *path, struct error *err)
{
    struct radiance stored = {0};
    enum status status = cap_radiance_read_stored(&stored, path, err);
    if (status)
        return status;
    if (stored.channels == 3) {
        *map = stored;
        return STATUS_OK;
    }
    struct radiance made = {.width = stored.width, .height = stored.height, .channels = 3};
    memcpy(made.cfa, stored.cfa, sizeof made.cfa);
    size_t count = 3 * (size_t)made.width * (size_t)made.height;
    made.value = malloc(count * sizeof *made.value);
    made.variance = malloc(count * sizeof *made.variance);
    if (!made.value || !made.variance) {
        status = cap_fail(err, STATUS_MEMORY, "%s: %zu values", path, 2 * count);
    } else {
        for (int y = 0; y < made.height; y++)
            spread_row(&made, &stored, y);
        *map = made;
        made = (struct radiance){0};  // the caller's now
    }
    cap_radiance_free(&made);
    cap_radiance_free(&stored);
    return status;
}
