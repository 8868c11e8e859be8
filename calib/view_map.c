/* view_map.c -- the radiance map of a view. */
#include "view_map.h"

#include <stdlib.h>

enum status cal_view_map(struct radiance *map, const char *out, const struct view *view,
                         struct error *err)
{
    char name[512];
    snprintf(name, sizeof name, "radiance/%s.exr", view->name);
    char *path = cap_path(out, name);
    enum status status =
        path ? cap_radiance_read(map, path, err) : cap_fail(err, STATUS_MEMORY, "%s", name);
    free(path);
    return status;
}
