/* shots.c -- photographs, ordered by name, become shots.
 *
 * A new shot starts when the lamp, the camera, the size or a setting other than exposure time
 * changes, or when an exposure time repeats. Shots named in capture.yaml come before that rule, and
 * lamps that take turns within a bracket after it (shot_turns.c).
 */
#include "shots.h"

#include <assert.h>
#include <ctype.h>
#include <stdlib.h>
#include <string.h>

// EXIF rounds times to a rational; brackets step by a third of a stop (26 %) and more.
static const double same_time = 0.01;

int natural_order(const char *a, const char *b)
{
    const char *const whole_a = a, *const whole_b = b;
    while (*a && *b) {
        if (isdigit((unsigned char)*a) && isdigit((unsigned char)*b)) {
            while (*a == '0')
                a++;
            while (*b == '0')
                b++;
            size_t digits_a = strspn(a, "0123456789"), digits_b = strspn(b, "0123456789");
            if (digits_a != digits_b)
                return digits_a < digits_b ? -1 : 1;
            int order = strncmp(a, b, digits_a);
            if (order)
                return order;
            a += digits_a;
            b += digits_b;
        } else if (*a != *b) {
            return (unsigned char)*a < (unsigned char)*b ? -1 : 1;
        } else {
            a++;
            b++;
        }
    }
    if (*a || *b)
        return *a ? 1 : -1;
    return strcmp(whole_a, whole_b);  // "a1" and "a01"
}

static bool same_camera(const struct photo *a, const struct photo *b)
{
    return a->width == b->width && a->height == b->height && a->bits == b->bits
           && a->channels == b->channels && strcmp(a->cfa, b->cfa) == 0 && a->encoded == b->encoded
           && a->given == b->given && a->focal_length == b->focal_length
           && strcmp(a->make, b->make) == 0 && strcmp(a->model, b->model) == 0;
}

const char *shots_difference(const struct photo *a, const struct photo *b)
{
    return a->light != b->light                             ? "another lamp"
           : a->width != b->width || a->height != b->height ? "another image size"
           : !same_camera(a, b)                             ? "another camera or lens"
           : a->aperture != b->aperture                     ? "another aperture"
           : a->iso != b->iso                               ? "another ISO setting"
                                                            : NULL;
}

static bool same_settings(const struct photo *a, const struct photo *b)
{
    return shots_difference(a, b) == NULL;
}

bool shots_same_times(double a, double b)
{
    return fabs(a - b) < same_time * b;
}

static enum status append(struct shot *shot, struct capture *capture, int photo, struct error *err)
{
    int *grown = realloc(shot->photo, (size_t)(shot->photos + 1) * sizeof *grown);
    if (!grown)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    shot->photo = grown;
    shot->photo[shot->photos++] = photo;
    shot->light = capture->photo[photo].light;
    capture->photo[photo].shot = (int)(shot - capture->shot);
    return STATUS_OK;
}

/* The new shot; NULL: out of memory. There is room for one shot a photograph. */
static struct shot *new_shot(struct capture *capture, const char *name, size_t length)
{
    struct shot *shot = &capture->shot[capture->shots];
    *shot = (struct shot){.name = strndup(name, length)};
    if (!shot->name)
        return NULL;
    capture->shots++;
    return shot;
}

static enum status take_named_shot(struct capture *capture, const struct capture_yaml *yaml,
                                   unsigned index, struct error *err)
{
    const struct yaml_shot *given = &yaml->root->shot[index];
    struct shot *shot = NULL;
    enum status status = STATUS_OK;
    for (int i = 0; i < capture->photos && !status; i++) {
        const struct photo *photo = &capture->photo[i];
        if (!capture_yaml_matches(given->photo, given->photos, photo->name))
            continue;
        if (photo->shot >= 0)
            return cap_fail(err, STATUS_DATA, "%s/%s belongs to the shots %s and %s of `shots`",
                            capture->folder, photo->name, capture->shot[photo->shot].name,
                            given->name);
        if (!shot && (shot = new_shot(capture, given->name, strlen(given->name))))
            shot->why = "named in capture.yaml";
        if (!shot)
            return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
        if (shot->photos > 0 && !same_settings(&capture->photo[shot->photo[0]], photo))
            return cap_fail(err, STATUS_DATA,
                            "%s/%s: lamp, camera or settings differ from the rest of shot %s",
                            capture->folder, photo->name, given->name);
        status = append(shot, capture, i, err);
    }
    return status;
}

/* The exposure time that most often comes right before this one; 0: none does. */
static double usual_before(const struct capture *capture, double time)
{
    double usual = 0;
    int most = 0;
    for (int i = 1; i < capture->photos; i++) {
        double before = capture->photo[i - 1].exposure_time;
        if (capture->photo[i].missing || !shots_same_times(capture->photo[i].exposure_time, time))
            continue;
        int times = 0;
        for (int k = 1; k < capture->photos; k++)
            times += !capture->photo[k].missing
                     && shots_same_times(capture->photo[k].exposure_time, time)
                     && shots_same_times(capture->photo[k - 1].exposure_time, before);
        if (times > most) {
            most = times;
            usual = before;
        }
    }
    return usual;
}

/* The exposure times of a shot as far as it goes. */
struct bracket {
    double *time;
    int times;
};

/* Take one more time; true: it is there already, and begins the next bracket. */
static bool next_time(struct bracket *bracket, double time)
{
    bool repeats = false;
    for (int k = 0; k < bracket->times; k++)
        repeats = repeats || shots_same_times(bracket->time[k], time);
    if (repeats)
        bracket->times = 0;
    bracket->time[bracket->times++] = time;
    return repeats;
}

/* A photograph that cannot be read still had its turn: it is taken to have had the time that
 * usually comes before the next one's. true: one of those before `photo` begins a bracket. */
static bool next_missing(struct bracket *bracket, const struct capture *capture,
                         const struct photo *photo)
{
    bool begins = false;
    for (int k = photo->missing; k > 0; k--) {
        double time = photo->exposure_time;
        for (int back = 0; back < k && time > 0; back++)
            time = usual_before(capture, time);
        if (time > 0)
            begins = next_time(bracket, time) || begins;
    }
    return begins;
}

/* A new shot that begins with a photograph. */
static struct shot *begin_shot(struct capture *capture, const struct photo *photo, const char *why)
{
    const char *dot = strrchr(photo->name, '.');
    size_t length = dot ? (size_t)(dot - photo->name) : strlen(photo->name);
    struct shot *shot = new_shot(capture, photo->name, length);
    if (shot)
        shot->why = why;
    return shot;
}

static enum status take_brackets(struct capture *capture, struct error *err)
{
    struct shot *shot = NULL;
    enum status status = STATUS_OK;
    size_t most = (size_t)capture->photos;
    for (int i = 0; i < capture->photos; i++)
        most += (size_t)capture->photo[i].missing;
    struct bracket bracket = {.time = calloc(most, sizeof *bracket.time)};
    if (!bracket.time)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    for (int i = 0; i < capture->photos && !status; i++) {
        const struct photo *photo = &capture->photo[i];
        if (photo->shot >= 0) {
            shot = NULL;
            continue;
        }
        const char *why =
            shot ? shots_difference(&capture->photo[shot->photo[0]], photo) : "the first";
        if (why) {
            shot = NULL;
            bracket.times = 0;
        }
        bool begins = next_missing(&bracket, capture, photo);
        begins = next_time(&bracket, photo->exposure_time) || begins;
        if (!shot || begins)
            shot = begin_shot(capture, photo, why ? why : "an exposure time repeats");
        status = shot ? append(shot, capture, i, err)
                      : cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    }
    free(bracket.time);
    return status;
}

static void forget_shots(struct capture *capture)
{
    for (int k = 0; k < capture->shots; k++) {
        free(capture->shot[k].name);
        free(capture->shot[k].photo);
    }
    capture->shots = 0;
    for (int i = 0; i < capture->photos; i++)
        capture->photo[i].shot = -1;
}

/* Group anew, by shot_of[photos]. */
static enum status regroup(struct capture *capture, const int *shot_of, const char *why,
                           struct error *err)
{
    enum status status = STATUS_OK;
    forget_shots(capture);
    for (int i = 0; i < capture->photos && !status; i++) {
        struct shot *shot = shot_of[i] < capture->shots
                                ? &capture->shot[shot_of[i]]
                                : begin_shot(capture, &capture->photo[i], why);
        status = shot ? append(shot, capture, i, err)
                      : cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    }
    return status;
}

/* Where no bracket was found, lamps or cameras may have taken turns; else an exposure too many or
 * too few may have shifted them. */
static enum status take_turns(struct capture *capture, struct error *err)
{
    int brackets = 0;
    for (int k = 0; k < capture->shots; k++)
        brackets += capture->shot[k].photos > 1;
    int *shot_of = calloc((size_t)capture->photos, sizeof *shot_of);
    enum status status = STATUS_OK;
    if (!shot_of)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    if (4 * brackets <= capture->shots && shots_take_turns(shot_of, capture))
        status = regroup(capture, shot_of, "lamps or cameras take turns", err);
    else if (shots_fall_back(shot_of, capture))
        status = regroup(capture, shot_of, "the order of exposures begins anew", err);
    free(shot_of);
    return status;
}

static enum status check_names(const struct capture *capture, struct error *err)
{
    for (int i = 0; i < capture->shots; i++) {
        if (strchr(capture->shot[i].name, '/'))
            return cap_fail(err, STATUS_DATA, "%s: the name of shot %s may hold no '/'",
                            capture->folder, capture->shot[i].name);
        for (int k = 0; k < i; k++)
            if (strcmp(capture->shot[i].name, capture->shot[k].name) == 0)
                return cap_fail(err, STATUS_DATA, "%s: two shots are called %s: rename one",
                                capture->folder, capture->shot[i].name);
    }
    return STATUS_OK;
}

static enum status find_cameras(struct capture *capture, struct error *err)
{
    assert(capture->shots > 0);
    capture->camera = calloc((size_t)capture->shots, sizeof *capture->camera);
    if (!capture->camera)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    for (int s = 0; s < capture->shots; s++) {
        const struct photo *photo = &capture->photo[capture->shot[s].photo[0]];
        int known = -1;
        for (int k = 0; k < s && known < 0; k++)
            if (same_camera(&capture->photo[capture->shot[k].photo[0]], photo))
                known = capture->shot[k].camera;
        if (known < 0) {
            struct camera_kind *camera = &capture->camera[capture->cameras];
            camera->width = photo->width;
            camera->height = photo->height;
            camera->focal_length = photo->focal_length;
            camera->given = photo->given;
            if (asprintf(&camera->name, "camera%d", capture->cameras) < 0) {
                camera->name = NULL;
                return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
            }
            known = capture->cameras++;
        }
        capture->shot[s].camera = known;
    }
    return STATUS_OK;
}

enum status shots_group(struct capture *capture, const struct capture_yaml *yaml, struct error *err)
{
    assert(capture->photos > 0);
    for (int i = 0; i < capture->photos; i++)
        if (!(capture->photo[i].exposure_time > 0))
            return cap_fail(err, STATUS_DATA,
                            "%s/%s: no exposure time in its EXIF data; give one under `overrides` "
                            "in capture.yaml",
                            capture->folder, capture->photo[i].name);
    capture->shot = calloc((size_t)capture->photos, sizeof *capture->shot);
    if (!capture->shot)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    enum status status = STATUS_OK;
    for (unsigned k = 0; k < yaml->root->shots && !status; k++)
        status = take_named_shot(capture, yaml, k, err);
    if (!status)
        status = take_brackets(capture, err);
    if (!status && yaml->root->shots == 0)
        status = take_turns(capture, err);
    if (!status)
        status = check_names(capture, err);
    return status ? status : find_cameras(capture, err);
}
