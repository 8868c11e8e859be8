/* capture.c -- a capture folder: capture.yaml, the photographs it selects, and their metadata. */
#include "photo.h"
#include "shots.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Without `photos`, these are photographs. */
static bool is_image_name(const char *name)
{
    static const char *const endings[] = {
        ".tif", ".tiff", ".jpg", ".jpeg", ".png", ".exr", ".dng", ".cr2", ".cr3", ".crw", ".nef",
        ".nrw", ".arw",  ".raf", ".rw2",  ".orf", ".pef", ".srw", ".raw", ".iiq", ".3fr", ".erf"};
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; dot && i < sizeof endings / sizeof *endings; i++)
        if (strcasecmp(dot, endings[i]) == 0)
            return true;
    return false;
}

static bool is_selected(const struct capture_yaml_root *root, const char *name)
{
    if (name[0] == '.' || strcmp(name, "capture.yaml") == 0
        || capture_yaml_matches(root->dark, root->darks, name)
        || capture_yaml_matches(root->flat, root->flats, name)
        || capture_yaml_matches(root->ambient, root->ambients, name))
        return false;
    return root->photos ? capture_yaml_matches(root->photos->pattern, root->photos->patterns, name)
                        : is_image_name(name);
}

static int by_name(const void *a, const void *b)
{
    return natural_order(((const struct photo *)a)->name, ((const struct photo *)b)->name);
}

static enum status add_photo(struct capture *capture, const char *name, struct error *err)
{
    struct photo *grown = realloc(capture->photo, (size_t)(capture->photos + 1) * sizeof *grown);
    if (grown)
        capture->photo = grown;
    char *copy = grown ? strdup(name) : NULL;
    if (!copy)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    capture->photo[capture->photos++] = photo_unknown();
    capture->photo[capture->photos - 1].name = copy;
    return STATUS_OK;
}

static int by_text(const void *a, const void *b)
{
    return natural_order(*(char *const *)a, *(char *const *)b);
}

/* A calibration frame, if the name says so. */
static enum status take_frame(struct frame_names *frames, const char *name, char *const *glob,
                              unsigned globs, struct error *err)
{
    if (!capture_yaml_matches(glob, globs, name))
        return STATUS_OK;
    char **grown = realloc(frames->name, (size_t)(frames->count + 1) * sizeof *grown);
    if (grown)
        frames->name = grown;
    char *copy = grown ? strdup(name) : NULL;
    if (!copy)
        return cap_fail(err, STATUS_MEMORY, "%s", name);
    frames->name[frames->count++] = copy;
    return STATUS_OK;
}

static enum status take_name(struct capture *capture, const struct capture_yaml_root *root,
                             const char *name, struct error *err)
{
    enum status status = take_frame(&capture->flat_frames, name, root->flat, root->flats, err);
    if (!status)
        status = take_frame(&capture->dark_frames, name, root->dark, root->darks, err);
    if (!status)
        status = take_frame(&capture->ambient_frames, name, root->ambient, root->ambients, err);
    if (!status && is_selected(root, name))
        status = add_photo(capture, name, err);
    return status;
}

/* In order, whatever order the folder lists them in; *first is NULL where there is none. */
static enum status end_frames(struct frame_names *frames, char **first, unsigned globs,
                              const char *key, const char *folder, struct error *err)
{
    if (globs > 0 && frames->count == 0)
        return cap_fail(err, STATUS_IO, "%s: no file matches `%s` of capture.yaml", folder, key);
    if (frames->count > 0) {
        qsort(frames->name, (size_t)frames->count, sizeof *frames->name, by_text);
        *first = frames->name[0];
    }
    return STATUS_OK;
}

static enum status list_photos(struct capture *capture, const struct capture_yaml_root *root,
                               struct error *err)
{
    DIR *folder = opendir(capture->folder);
    if (!folder)
        return cap_fail(err, STATUS_IO, "%s: %s", capture->folder, strerror(errno));
    enum status status = STATUS_OK;
    for (struct dirent *entry; !status && (entry = readdir(folder));)
        status = take_name(capture, root, entry->d_name, err);
    closedir(folder);
    if (status)
        return status;
    if (capture->photos == 0)
        return cap_fail(err, STATUS_IO, "%s: no photographs here%s", capture->folder,
                        root->photos ? " match `photos` of capture.yaml"
                                     : " (raw, TIFF, PNG, JPEG or EXR)");
    const char *where = capture->folder;
    status = end_frames(&capture->flat_frames, &capture->flat, root->flats, "flat", where, err);
    if (!status)
        status = end_frames(&capture->dark_frames, &capture->dark, root->darks, "dark", where, err);
    if (!status)
        status = end_frames(&capture->ambient_frames, &capture->ambient, root->ambients, "ambient",
                            where, err);
    if (status)
        return status;
    qsort(capture->photo, (size_t)capture->photos, sizeof *capture->photo, by_name);
    return STATUS_OK;
}

/* What the file says; false: it cannot be read, and *err tells why. */
static bool read_metadata(struct photo *photo, const char *folder, struct error *err)
{
    struct photo_file *file = NULL;
    char *path = cap_path(folder, photo->name);
    if (!path) {
        cap_fail(err, STATUS_MEMORY, "%s", photo->name);
        return false;
    }
    enum status status = photo_open(&file, path, err);
    if (!status) {
        char *name = photo->name;
        *photo = file->info;
        photo->name = name;
    }
    photo_close(file);
    free(path);
    return status == STATUS_OK;
}

/* Photographs that cannot be read are left out, and named in their order. */
static enum status read_photos(struct capture *capture, struct run *run, struct error *err)
{
    int count = capture->photos, kept = 0, missing = 0;
    struct error *story = calloc((size_t)count, sizeof *story);
    if (!story)
        return cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
#pragma omp parallel for schedule(dynamic) num_threads(run->threads)
    for (int i = 0; i < count; i++)
        read_metadata(&capture->photo[i], capture->folder, &story[i]);
    for (int i = 0; i < count; i++) {
        if (story[i].status) {
            cap_warn(run, "%s: this photograph is left out", story[i].text);
            free(capture->photo[i].name);
            missing++;
        } else {
            if (capture->photo[i].decoded)
                cap_warn(run,
                         "%s: a file of 16 bits that says it is gamma encoded (a chunk gAMA or "
                         "sRGB): it is made linear by that; take the chunk out if it is not true",
                         capture->photo[i].name);
            capture->photo[kept] = capture->photo[i];
            capture->photo[kept++].missing = missing;
            missing = 0;
        }
    }
    free(story);
    capture->photos = kept;
    return kept > 0 ? STATUS_OK
                    : cap_fail(err, STATUS_IO, "%s: none of %d photographs can be read",
                               capture->folder, count);
}

/* Seconds of "0.033" or "1/30"; 0: neither. */
static double read_time(const char *text)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text)
        return 0;
    if (*end == '/') {
        const char *below = end + 1;
        value /= strtod(below, &end);
        if (end == below)
            return 0;
    }
    return *end == '\0' && isfinite(value) && value > 0 ? value : 0;
}

static void override_photo(struct photo *photo, const struct yaml_override *o, double seconds)
{
    photo->exposure_time = seconds > 0 ? seconds : photo->exposure_time;
    photo->aperture = o->aperture > 0 ? o->aperture : photo->aperture;
    photo->iso = o->iso > 0 ? o->iso : photo->iso;
    photo->focal_length = o->focal_length > 0 ? o->focal_length : photo->focal_length;
}

static enum status apply_overrides(struct capture *capture, const struct capture_yaml *yaml,
                                   struct error *err)
{
    for (unsigned k = 0; k < yaml->root->overrides; k++) {
        const struct yaml_override *o = &yaml->root->override[k];
        double seconds = o->exposure_time ? read_time(o->exposure_time) : 0;
        char path[64];
        snprintf(path, sizeof path, "overrides[%u].exposure_time", k);
        if (o->exposure_time && seconds <= 0)
            return yaml_source_fail(&yaml->source, err, path,
                                    "'%s' is no time in seconds, like 0.033 or 1/30",
                                    o->exposure_time);
        for (int i = 0; i < capture->photos; i++)
            if (capture_yaml_matches(o->photo, o->photos, capture->photo[i].name))
                override_photo(&capture->photo[i], o, seconds);
    }
    return STATUS_OK;
}

static enum status assign_lights(struct capture *capture, const struct capture_yaml *yaml,
                                 struct error *err)
{
    const struct capture_yaml_root *root = yaml->root;
    for (int i = 0; i < capture->photos; i++) {
        struct photo *photo = &capture->photo[i];
        photo->light = root->lights == 0 ? 0 : -1;
        for (unsigned k = 0; k < root->lights; k++) {
            if (!capture_yaml_matches(root->light[k].photo, root->light[k].photos, photo->name))
                continue;
            if (photo->light >= 0)
                return cap_fail(err, STATUS_DATA, "%s/%s belongs to two lamps, %s and %s",
                                capture->folder, photo->name, root->light[photo->light].name,
                                root->light[k].name);
            photo->light = (int)k;
        }
        if (photo->light < 0)
            return cap_fail(err, STATUS_DATA,
                            "%s/%s belongs to no lamp: add it to one under `lights` in "
                            "capture.yaml, or leave it out of `photos`",
                            capture->folder, photo->name);
    }
    return STATUS_OK;
}

/* Which photographs are those of which camera of capture.yaml: the first that selects them. */
static void assign_cameras(struct capture *capture, const struct capture_yaml_root *root)
{
    for (int i = 0; i < capture->photos; i++) {
        struct photo *photo = &capture->photo[i];
        photo->given = -1;
        for (unsigned k = 0; k < root->cameras && photo->given < 0; k++)
            if (root->camera[k].photos == 0
                || capture_yaml_matches(root->camera[k].photo, root->camera[k].photos, photo->name))
                photo->given = (int)k;
    }
}

static enum status fill(struct capture *capture, const struct capture_yaml *yaml, struct run *run,
                        struct error *err)
{
    enum status status = capture_check(capture, yaml, err);
    if (!status)
        status = list_photos(capture, yaml->root, err);
    if (!status)
        status = read_photos(capture, run, err);
    if (!status)
        status = apply_overrides(capture, yaml, err);
    if (!status)
        status = assign_lights(capture, yaml, err);
    if (!status)
        assign_cameras(capture, yaml->root);
    if (!status)
        status = shots_group(capture, yaml, err);
    if (!status)
        shots_warn(capture, run);
    return status;
}

/** Is there a folder, and a capture.yaml in it? What is missing is what people trip over first. */
static enum status check_folder(const char *folder, const char *yaml, struct error *err)
{
    struct stat info;
    if (stat(folder, &info) != 0)
        return cap_fail(err, STATUS_IO, "%s: there is no such folder", folder);
    if (!S_ISDIR(info.st_mode))
        return cap_fail(err, STATUS_IO, "%s: is a file; name the folder of the photographs",
                        folder);
    if (access(yaml, F_OK) != 0)
        return cap_fail(err, STATUS_IO,
                        "%s: there is no capture.yaml in this folder: `goniocam init %s --tag-size "
                        "MM` writes one from the photographs, with what is to be filled in marked",
                        folder, folder);
    return STATUS_OK;
}

enum status cap_capture_read(struct capture *capture, const char *folder, struct run *run,
                             struct error *err)
{
    struct capture made = {.folder = strdup(folder)};
    struct capture_yaml yaml = {0};
    char *path = cap_path(folder, "capture.yaml");
    enum status status = STATUS_OK;
    if (!made.folder || !path)
        status = cap_fail(err, STATUS_MEMORY, "%s", folder);
    if (!status)
        status = check_folder(folder, path, err);
    if (!status)
        status = capture_yaml_read(&yaml, path, err);
    if (!status)
        status = fill(&made, &yaml, run, err);
    if (!status) {
        *capture = made;
        made = (struct capture){0};  // the caller's now
    }
    free(path);
    capture_yaml_free(&yaml);
    cap_capture_free(&made);
    return status;
}

// 1: a photograph of the folder has a name like that; 0: none has.
static unsigned has_match(const char *folder, char *glob)
{
    DIR *entries = opendir(folder);
    bool found = false;
    for (struct dirent *e; entries && !found && (e = readdir(entries));)
        found = is_image_name(e->d_name) && capture_yaml_matches(&glob, 1, e->d_name);
    if (entries)
        closedir(entries);
    return found;
}

enum status cap_capture_of_photos(struct capture *capture, const char *folder, struct run *run,
                                  struct error *err)
{
    static char flat[] = "flat*", dark[] = "dark*", ambient[] = "ambient*";
    char *flats[] = {flat}, *darks[] = {dark}, *ambients[] = {ambient};
    struct capture_yaml_root root = {.goniocam = 1,
                                     .flat = flats,
                                     .dark = darks,
                                     .ambient = ambients,
                                     .flats = has_match(folder, flat),
                                     .darks = has_match(folder, dark),
                                     .ambients = has_match(folder, ambient)};
    struct capture_yaml yaml = {.root = &root};
    struct capture made = {.folder = strdup(folder)};
    enum status status =
        made.folder ? fill(&made, &yaml, run, err) : cap_fail(err, STATUS_MEMORY, "%s", folder);
    if (!status) {
        *capture = made;
        made = (struct capture){0};  // the caller's now
    }
    cap_capture_free(&made);
    return status;
}

void cap_capture_thin(struct capture *capture, int most)
{
    int kept = 0, shots = capture->shots;
    for (int k = 0; k < shots; k++) {
        struct shot *shot = &capture->shot[k];
        bool keep =
            shots <= most || (long)k * most / shots != (long)(k - 1) * most / shots || k == 0;
        for (int i = 0; i < shot->photos; i++)
            capture->photo[shot->photo[i]].shot = keep ? kept : -1;
        if (keep) {
            capture->shot[kept++] = *shot;
        } else {
            free(shot->name);
            free(shot->photo);
        }
    }
    capture->shots = kept;
}

static void free_frames(struct frame_names *frames)
{
    for (int i = 0; i < frames->count; i++)
        free(frames->name[i]);
    free(frames->name);
}

void cap_capture_free(struct capture *capture)
{
    for (int i = 0; i < capture->lights; i++)
        free(capture->light[i].name);
    for (int i = 0; i < capture->photos; i++)
        free(capture->photo[i].name);
    for (int i = 0; i < capture->shots; i++) {
        free(capture->shot[i].name);
        free(capture->shot[i].photo);
    }
    for (int i = 0; i < capture->cameras; i++)
        free(capture->camera[i].name);
    for (int i = 0; i < capture->givens; i++)
        free(capture->given[i].file);
    free(capture->given);
    free(capture->folder);
    free(capture->family);
    free(capture->tag);
    free(capture->patch);
    free(capture->reference);
    free(capture->light);
    free(capture->photo);
    free(capture->shot);
    free(capture->camera);
    free(capture->response_file);
    free(capture->sample.file);
    for (int i = 0; i < capture->occluders; i++)
        free(capture->occluder[i].file);
    free(capture->occluder);
    free_frames(&capture->flat_frames);
    free_frames(&capture->dark_frames);
    free_frames(&capture->ambient_frames);
    *capture = (struct capture){0};
}
