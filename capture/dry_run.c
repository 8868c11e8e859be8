/* dry_run.c -- what a merge would do, told before it is done.
 *
 * Shots are known from the files' metadata alone. Which ambient frames belong to them the pictures
 * tell, and only to who knows the sensor: where there are such frames, it is learnt as for a merge.
 */
#include "dry_run.h"
#include "ambient.h"
#include "photo.h"

#include <stdlib.h>

/* A line a shot. */
static void print_shots(const struct capture *capture)
{
    printf("%-24s %-8s %-10s %6s %8s %6s  %-32s %s\n", "shot", "camera", "lamp", "ISO", "aperture",
           "photos", "seconds", "begins because of");
    for (int k = 0; k < capture->shots; k++) {
        const struct shot *shot = &capture->shot[k];
        const struct photo *first = &capture->photo[shot->photo[0]];
        char times[200] = "";
        size_t length = 0;
        for (int i = 0; i < shot->photos && length < sizeof times - 16; i++)
            length += (size_t)snprintf(times + length, sizeof times - length, "%s%.4g",
                                       i ? " " : "", capture->photo[shot->photo[i]].exposure_time);
        printf("%-24s %-8s %-10s %6.0f %8.1f %6d  %-32s %s\n", shot->name,
               capture->camera[shot->camera].name,
               shot->light >= 0 ? capture->light[shot->light].name : "-", first->iso,
               first->aperture, shot->photos, times, shot->why);
    }
}

static void print_names(const struct frame_names *names)
{
    for (int k = 0; k < names->count; k++)
        printf("%s%s", k ? " " : "", names->name[k]);
    printf("\n");
}

/* Frames that serve all shots of a camera whose photographs have their size. */
static void print_frames(const char *kind, const struct frame_names *names)
{
    if (names->count == 0)
        return;
    printf("\n%s: ", kind);
    print_names(names);
}

static void print_ambients(const struct capture *capture, const struct ambients *ambients)
{
    printf("\n%-24s %-32s %s\n", "shot", "because", "ambient frames");
    for (int s = 0; s < capture->shots; s++) {
        const struct frame_names names = ambients_of(ambients, s);
        const double likeness = ambients_likeness(ambients, s);
        char why[64] = "no frame shows this view";
        if (names.count > 0 && likeness > 0)
            snprintf(why, sizeof why, "same view (alike by %.2f of 1)", likeness);
        else if (names.count > 0)
            snprintf(why, sizeof why, "so dark that it fits any view");
        printf("%-24s %-32s ", capture->shot[s].name, why);
        if (names.count > 0)
            print_names(&names);
        else
            printf("-\n");
    }
}

static enum status list_ambients(const struct capture *capture, struct run *run, struct error *err)
{
    struct learned *learned = calloc((size_t)capture->cameras, sizeof *learned);
    double *seconds = calloc((size_t)capture->photos, sizeof *seconds);
    bool *left_out = calloc((size_t)capture->photos, sizeof *left_out);
    struct ambients *ambients = NULL;
    enum status status = STATUS_OK;
    if (!learned || !seconds || !left_out)
        status = cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    for (int i = 0; i < capture->photos && !status; i++)
        seconds[i] = capture->photo[i].exposure_time;
    for (int k = 0; k < capture->cameras && !status; k++)
        status = sensor_learn(&learned[k], seconds, left_out, capture, k, run, err);
    if (!status)
        status = ambients_find(&ambients, capture, learned, left_out, run, err);
    if (!status)
        print_ambients(capture, ambients);
    ambients_free(ambients);
    photo_forget();
    free(left_out);
    free(seconds);
    free(learned);
    return status;
}

enum status dry_run(const struct capture *capture, struct run *run, struct error *err)
{
    print_shots(capture);
    print_frames("dark", &capture->dark_frames);
    print_frames("flat", &capture->flat_frames);
    return capture->ambient_frames.count > 0 ? list_ambients(capture, run, err) : STATUS_OK;
}
