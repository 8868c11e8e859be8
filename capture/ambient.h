/* ambient.h -- photographs without the lamp: which belong to which shot, and taking them off. */
#ifndef GONIOCAM_AMBIENT_H
#define GONIOCAM_AMBIENT_H

#include "merge.h"
#include "sensor.h"
#include "stack.h"

/** The light of a room in one view. Owns stack; {0} is none; ambient_light_free(). */
struct ambient_light {
    struct stack stack;
    double noise2[3], slope[3];  // variance of the mean = noise2 + slope DN
};
/** Read and average frames of a camera. STATUS_DATA: a frame without exposure time; as
 *  stack_read(). */
enum status ambient_light_read(struct ambient_light *light, const struct capture *capture,
                               const struct frame_names *names, int camera,
                               const struct learned *learned, struct error *err);
void ambient_light_free(struct ambient_light *light);
/** After the merge of row y: its light goes, its noise comes. */
void ambient_take(const struct ambient_light *light, const struct merge_row *row, int y,
                  float *value, float *variance);

/** The frames of each shot. */
struct ambients;
/** Find which frames show the view of which shot; a warning names the shots that none shows. On
 *  success end with ambients_free(); *ambients is NULL where the capture has no such frames. The
 *  capture and learned[cameras] are borrowed. STATUS_MEMORY, STATUS_DATA (no exposure time),
 *  STATUS_IO and STATUS_FORMAT of a frame. */
enum status ambients_find(struct ambients **ambients, const struct capture *capture,
                          const struct learned *learned, const bool *left_out, struct run *run,
                          struct error *err);
void ambients_free(struct ambients *ambients);
/** The frames of a shot, in order; borrowed. */
struct frame_names ambients_of(const struct ambients *ambients, int shot);
/** How alike the best of them and the shot are, thumbnail_likeness(); 0: no frame shows the view,
 * and those of the shot, if any, show nothing. */
double ambients_likeness(const struct ambients *ambients, int shot);
/** Have the light of a shot in memory, from any thread, until ambients_done(): that of the shots at
 *  work, and the last one. As ambient_light_read(). */
enum status ambients_begin(struct ambients *ambients, int shot, struct error *err);
void ambients_done(struct ambients *ambients, int shot);
/** The light of a shot that was begun; NULL: none. */
const struct ambient_light *ambients_light(const struct ambients *ambients, int shot);
#endif
