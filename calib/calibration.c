/* calibration.c -- what a calibration owns. */
#include "calib.h"

#include <stdlib.h>

void cal_calibration_free(struct calibration *c)
{
    for (int i = 0; i < c->cameras; i++)
        free(c->camera[i].name);
    for (int i = 0; i < c->views; i++) {
        free(c->view[i].name);
        free(c->view[i].tag);
    }
    for (int i = 0; i < c->lamps; i++)
        free(c->lamp[i].name);
    free(c->camera);
    free(c->view);
    free(c->lamp);
    free(c->family);
    free(c->tag);
    free(c->surroundings.glow);
    free(c->sample.file);
    cal_mesh_free(c->sample.mesh);
    *c = (struct calibration){0};
}
