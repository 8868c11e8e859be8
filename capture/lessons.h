/* lessons.h -- what a merge learns of the cameras before it starts. */
#ifndef GONIOCAM_LESSONS_H
#define GONIOCAM_LESSONS_H

#include "ambient.h"
#include "frames.h"
#include "sensor.h"

/** [cameras], but for seconds [photos]. Owns all; {0} is empty; lessons_free(). */
struct lessons {
    struct learned *learned;
    struct frames *frames;
    double *seconds;
    struct ambients *ambients;  // of the shots; borrows learned
};
/** Learn from the photographs of a capture; left_out[photos] become true where one moved against
 *  its shot. Recovered curves are written into `out`. Where several processes share the run, the
 *  one that leads looks at the photographs, with the cores of all, and tells the others: all of
 *  them have to call this, also one that has failed before, with its status. The result is `failed`
 *  where that is no success; else as sensor_learn(), frames_make(), ambients_find(). */
enum status lessons_learn(struct lessons *lessons, bool *left_out, const struct capture *capture,
                          const char *out, enum status failed, struct run *run, struct error *err);
void lessons_free(struct lessons *lessons, int cameras);
#endif
