/* tether_gphoto.c -- a camera at the cable by libgphoto2. */
#include "tether.h"

#include <gphoto2/gphoto2-camera.h>
#include <stdlib.h>
#include <string.h>

/** A camera that libgphoto2 holds open. */
struct gphoto {
    GPContext *context;
    Camera *camera;
    CameraWidget *config, *time;  // the tree of settings, and the exposure time in it
    const char **name;            // [names], the config's
    int names;
};

static enum status failed(struct error *err, const char *what, int code)
{
    return cap_fail(err, STATUS_IO, "camera: %s: %s", what, gp_result_as_string(code));
}

// Read the settings, and find the exposure time among them: its name differs from maker to maker.
static enum status find_times(struct gphoto *g, struct error *err)
{
    static const char *const names[] = {"shutterspeed", "shutterspeed2", "exptime", "d031"};
    int code = gp_camera_get_config(g->camera, &g->config, g->context);
    if (code < GP_OK)
        return cap_fail(err, STATUS_IO,
                        "camera: its settings cannot be read (%s): this one cannot be controlled "
                        "over the cable; copy its photographs into a folder instead",
                        gp_result_as_string(code));
    for (size_t i = 0; i < sizeof names / sizeof *names && !g->time; i++)
        if (gp_widget_get_child_by_name(g->config, names[i], &g->time) < GP_OK)
            g->time = NULL;
    g->names = g->time ? gp_widget_count_choices(g->time) : 0;
    if (g->names <= 0)
        return cap_fail(err, STATUS_DATA,
                        "camera: its exposure time cannot be set: turn it to M (manual)");
    g->name = calloc((size_t)g->names, sizeof *g->name);
    if (!g->name)
        return cap_fail(err, STATUS_MEMORY, "no memory for the camera's times");
    for (int i = 0; i < g->names; i++)
        if (gp_widget_get_choice(g->time, i, &g->name[i]) < GP_OK)
            g->name[i] = "";
    return STATUS_OK;
}

static enum status times(void *self, const char *const **name, int *count, struct error *err)
{
    struct gphoto *g = self;
    enum status status = g->name ? STATUS_OK : find_times(g, err);
    *name = g->name;
    *count = g->names;
    return status;
}

static enum status set_time(void *self, const char *name, struct error *err)
{
    struct gphoto *g = self;
    int code = gp_widget_set_value(g->time, name);
    if (code >= GP_OK)
        code = gp_camera_set_config(g->camera, g->config, g->context);
    return code < GP_OK ? failed(err, name, code) : STATUS_OK;
}

// What is in the camera's file goes to `path`, complete or not at all.
static enum status keep(CameraFile *file, const char *path, struct error *err)
{
    const char *data;
    unsigned long size;
    int code = gp_file_get_data_and_size(file, &data, &size);
    if (code < GP_OK)
        return failed(err, path, code);
    struct atomic_file to;
    enum status status = cap_file_begin(&to, path, true, err);
    if (status)
        return status;
    if (fwrite(data, 1, size, to.stream) == size)
        return cap_file_commit(&to, err);
    cap_file_abandon(&to);
    return cap_fail(err, STATUS_IO, "%s: cannot be written: is the disk full?", path);
}

static enum status fetch(struct gphoto *g, const CameraFilePath *at, const char *path,
                         struct error *err)
{
    const char *dot = strrchr(at->name, '.');
    CameraFile *file = NULL;
    char *whole = NULL;
    int code = gp_file_new(&file);
    if (code >= GP_OK)
        code = gp_camera_file_get(g->camera, at->folder, at->name, GP_FILE_TYPE_NORMAL, file,
                                  g->context);
    enum status status = code < GP_OK ? failed(err, at->name, code) : STATUS_OK;
    if (!status && asprintf(&whole, "%s%s", path, dot ? dot : "") < 0)
        status = cap_fail(err, STATUS_MEMORY, "no memory for a path");
    else if (!status)
        status = keep(file, whole, err);
    // What was not kept stays in the camera.
    if (!status)
        gp_camera_file_delete(g->camera, at->folder, at->name, g->context);
    free(whole);
    if (file)
        gp_file_unref(file);
    return status;
}

static enum status take(void *self, const char *path, struct error *err)
{
    struct gphoto *g = self;
    CameraFilePath at;
    int code = gp_camera_capture(g->camera, GP_CAPTURE_IMAGE, &at, g->context);
    return code < GP_OK ? failed(err, "no photograph was taken", code) : fetch(g, &at, path, err);
}

/* ---- opening ----------------------------------------------------------------------------------
 */

static int choose_model(Camera *camera, const char *model, GPContext *context)
{
    CameraAbilitiesList *list = NULL;
    CameraAbilities abilities;
    int code = gp_abilities_list_new(&list);
    if (code >= GP_OK)
        code = gp_abilities_list_load(list, context);
    if (code >= GP_OK)
        code = gp_abilities_list_lookup_model(list, model);
    if (code >= GP_OK)
        code = gp_abilities_list_get_abilities(list, code, &abilities);
    if (code >= GP_OK)
        code = gp_camera_set_abilities(camera, abilities);
    if (list)
        gp_abilities_list_free(list);
    return code;
}

static int choose_port(Camera *camera, const char *port)
{
    GPPortInfoList *list = NULL;
    GPPortInfo info;
    int code = gp_port_info_list_new(&list);
    if (code >= GP_OK)
        code = gp_port_info_list_load(list);
    if (code >= GP_OK)
        code = gp_port_info_list_lookup_path(list, port);
    if (code >= GP_OK)
        code = gp_port_info_list_get_info(list, code, &info);
    if (code >= GP_OK)
        code = gp_camera_set_port_info(camera, info);
    if (list)
        gp_port_info_list_free(list);
    return code;
}

static enum status open_camera(struct gphoto *g, const char *model, const char *port,
                               struct error *err)
{
    int code = g->context ? gp_camera_new(&g->camera) : GP_ERROR_NO_MEMORY;
    if (code < GP_OK)
        return failed(err, "libgphoto2 does not start", code);
    if (model && (code = choose_model(g->camera, model, g->context)) < GP_OK)
        return failed(err, model, code);
    if (port && (code = choose_port(g->camera, port)) < GP_OK)
        return failed(err, port, code);
    code = gp_camera_init(g->camera, g->context);
    if (code == GP_ERROR_MODEL_NOT_FOUND)
        return cap_fail(err, STATUS_IO,
                        "no camera is found: connect it by USB, switch it on, and close programs "
                        "that hold it (a desktop's file manager does)");
    return code < GP_OK ? failed(err, "it does not answer", code) : STATUS_OK;
}

void cap_tether_close(struct tether *camera)
{
    struct gphoto *g = camera->self;
    if (!g)
        return;
    free(g->name);
    if (g->config)
        gp_widget_free(g->config);
    if (g->camera) {
        gp_camera_exit(g->camera, g->context);
        gp_camera_unref(g->camera);
    }
    if (g->context)
        gp_context_unref(g->context);
    free(g);
    *camera = (struct tether){0};
}

enum status cap_tether_open(struct tether *camera, const char *model, const char *port,
                            struct error *err)
{
    struct gphoto *g = calloc(1, sizeof *g);
    if (!g)
        return cap_fail(err, STATUS_MEMORY, "no memory for a camera");
    *camera = (struct tether){g, times, set_time, take};
    g->context = gp_context_new();
    enum status status = open_camera(g, model, port, err);
    if (status)
        cap_tether_close(camera);
    return status;
}
