/* tether.h -- a camera at the cable: brackets go straight into a capture folder. */
#ifndef GONIOCAM_TETHER_H
#define GONIOCAM_TETHER_H

#include "program.h"

/** What a bracket needs of a camera. `self` is the camera's own. */
struct tether {
    void *self;
    /** Exposure times as the camera names them ("1/125", "0.5s", "bulb"): [*count], the camera's.
     */
    enum status (*times)(void *self, const char *const **name, int *count, struct error *err);
    /** Set one of them. */
    enum status (*set_time)(void *self, const char *name, struct error *err);
    /** Take a photograph, and put it at `path` with the camera's own extension added, complete or
     *  not at all. */
    enum status (*take)(void *self, const char *path, struct error *err);
};

/** Seconds of a camera's name for an exposure time: "1/125", "1/125s", "0.5", "0,5", "2 s", "30\"".
 *  0: it is none (bulb, auto). */
double cap_tether_seconds(const char *name);

/** Take one photograph for each of seconds [count], at the camera's nearest time, as
 * FOLDER/NAME_exp0, _exp1, ... A step of 5 % is as near as cameras come; a time that is farther off
 * is told. STATUS_DATA: the camera lets nobody set its time, or two times fall on one. */
enum status cap_tether_bracket(const struct tether *camera, const char *folder, const char *name,
                               const double *seconds, int count, struct run *run,
                               struct error *err);

/** The first of shot00, shot01, ... that begins no file of the folder. */
void cap_tether_next_name(char name[16], const char *folder);

/** Open the camera that libgphoto2 finds, or the one of this model and port (both may be NULL).
 *  On success release with cap_tether_close(). STATUS_IO: there is none, or it does not answer, or
 *  this goniocam was built without libgphoto2. */
enum status cap_tether_open(struct tether *camera, const char *model, const char *port,
                            struct error *err);
void cap_tether_close(struct tether *camera);

#endif
