/* tether_none.c -- where goniocam was built without libgphoto2. */
#include "tether.h"

enum status cap_tether_open(struct tether *camera, const char *model, const char *port,
                            struct error *err)
{
    (void)camera;
    (void)model;
    (void)port;
    return cap_fail(err, STATUS_IO,
                    "this goniocam was built without libgphoto2: install libgphoto2-dev and build "
                    "it again");
}

void cap_tether_close(struct tether *camera)
{
    *camera = (struct tether){0};
}
