/* exr_photo.c -- EXR images as photographs: linear already, half or float, scan lines or tiles; R,
 * G and B of a layer, gray, or a mosaic Y with its attribute cfa.
 *
 * The image is the display window; what of it the data window does not hold reads as saturated,
 * which is no measurement. Chunks are decoded whole, into a band of rows. Of several parts the
 * first that holds an image counts. The standard attributes expTime, aperture, isoSpeed,
 * focalLength and the texts of the camera are taken for EXIF.
 */
#include "exr_library.h"
#include "photo.h"

#include <stdlib.h>
#include <string.h>

enum { NAME_MAX_LENGTH = 256 };  // of a channel: OpenEXR allows 255

struct exr_file {
    struct photo_file base;
    exr_context_t file;
    exr_decode_pipeline_t pipe;
    struct error story;
    int part;
    char name[3][NAME_MAX_LENGTH];  // of R, G, B; or of the one channel
    exr_attr_box2i_t data, shown;   // windows; shown is the image
    int tile[2];                    // width and height of tiles; 0: scan lines
    float *band;                    // [rows_at_once][width of data][channels as stored]
    int stored;                     // channels of the band: 3, or 1
    int band_top;                   // the first row of the data that band holds, -1: none
};

static enum status fail(struct exr_file *file, struct error *err, const char *what)
{
    return cap_fail(err, STATUS_FORMAT, "%s: %s", file->base.path, what);
}

static double number_attribute(exr_context_t file, int part, const char *name)
{
    float value = 0;
    return exr_attr_get_float(file, part, name, &value) == EXR_ERR_SUCCESS ? (double)value : 0;
}

static void text_attribute(exr_context_t file, int part, const char *name, char *to, size_t size)
{
    const char *text = NULL;
    int32_t length = 0;
    if (exr_attr_get_string(file, part, name, &length, &text) == EXR_ERR_SUCCESS && text)
        snprintf(to, size, "%.*s", (int)length, text);
}

static void read_settings(struct photo *info, exr_context_t file, int part)
{
    info->exposure_time = number_attribute(file, part, "expTime");
    info->aperture = number_attribute(file, part, "aperture");
    info->iso = number_attribute(file, part, "isoSpeed");
    info->focal_length = number_attribute(file, part, "focalLength");
    text_attribute(file, part, "cameraMake", info->make, sizeof info->make);
    text_attribute(file, part, "cameraModel", info->model, sizeof info->model);
    text_attribute(file, part, "lensModel", info->lens, sizeof info->lens);
    text_attribute(file, part, "capDate", info->taken, sizeof info->taken);
    text_attribute(file, part, EXR_CFA, info->cfa, sizeof info->cfa);
}

/* Does the part have this channel at full resolution, in numbers of floating point? */
static bool has_channel(const exr_attr_chlist_t *channels, const char *name)
{
    for (int i = 0; i < channels->num_channels; i++) {
        const exr_attr_chlist_entry_t *c = &channels->entries[i];
        if (strcmp(c->name.str, name) == 0)
            return c->x_sampling == 1 && c->y_sampling == 1 && c->pixel_type != EXR_PIXEL_UINT;
    }
    return false;
}

/* R, G and B of the layer of a channel called R, r, red or Red; false: it is none. */
static bool name_layer(char name[3][NAME_MAX_LENGTH], const exr_attr_chlist_t *channels,
                       const char *red)
{
    static const char *const words[4][3] = {
        {"R", "G", "B"}, {"r", "g", "b"}, {"red", "green", "blue"}, {"Red", "Green", "Blue"}};
    const char *dot = strrchr(red, '.'), *last = dot ? dot + 1 : red;
    for (int k = 0; k < 4; k++) {
        bool all = strcmp(last, words[k][0]) == 0;
        for (int c = 0; c < 3 && all; c++) {
            snprintf(name[c], NAME_MAX_LENGTH, "%.*s%s", (int)(last - red), red, words[k][c]);
            all = has_channel(channels, name[c]);
        }
        if (all)
            return true;
    }
    return false;
}

/* The layer that is the image: the one without a name, or the only one. Returns how many might be
 * meant; name[] is set where it is 1. */
static int choose_layer(char name[3][NAME_MAX_LENGTH], const exr_attr_chlist_t *channels)
{
    char found[3][NAME_MAX_LENGTH];
    int layers = 0;
    for (int i = 0; i < channels->num_channels; i++) {
        const char *red = channels->entries[i].name.str;
        if (!name_layer(found, channels, red))
            continue;
        memcpy(name, found, sizeof found);
        layers++;
        if (!strchr(red, '.'))
            return 1;
    }
    return layers;
}

/* Y, or the only channel there is (but no depth): a mosaic where cfa says so, else gray. */
static bool choose_single(char name[NAME_MAX_LENGTH], const exr_attr_chlist_t *channels)
{
    const char *only = channels->num_channels == 1 ? channels->entries[0].name.str : "Y";
    const char *dot = strrchr(only, '.');
    for (int i = 0; i < channels->num_channels; i++)
        if (strcmp(channels->entries[i].name.str, "RY") == 0)
            return false;  // luminance and chroma, the latter at half the resolution
    snprintf(name, NAME_MAX_LENGTH, "%s", only);
    return strcmp(dot ? dot + 1 : only, "Z") != 0 && has_channel(channels, name);
}

/* The channels of a part that holds an image as such; NULL: it does not. */
static const exr_attr_chlist_t *channels_of(exr_context_t file, int part)
{
    exr_storage_t storage;
    const exr_attr_chlist_t *channels;
    if (exr_get_storage(file, part, &storage) || exr_get_channels(file, part, &channels))
        return NULL;
    return storage == EXR_STORAGE_SCANLINE || storage == EXR_STORAGE_TILED ? channels : NULL;
}

static enum status choose_channels(struct exr_file *file, struct error *err)
{
    int parts = 1, layers = 0;
    exr_get_count(file->file, &parts);
    for (int part = 0; part < parts && layers == 0; part++) {
        const exr_attr_chlist_t *channels = channels_of(file->file, part);
        layers = channels ? choose_layer(file->name, channels) : 0;
        file->part = part;
    }
    file->stored = layers == 0 ? 1 : 3;
    for (int part = 0; part < parts && layers == 0; part++) {
        const exr_attr_chlist_t *channels = channels_of(file->file, part);
        layers = channels && choose_single(file->name[0], channels);
        file->part = part;
    }
    if (layers > 1)
        return fail(file, err, "several layers of R, G and B: save the one that is the photograph");
    if (layers == 0)
        return fail(file, err,
                    "no image in it: neither R, G, B nor gray nor a mosaic Y, in half or float and "
                    "at full resolution");
    return STATUS_OK;
}

static bool make_sense(const exr_attr_box2i_t *box)
{
    enum { SIDE_MAX = 65535 };
    int64_t width = (int64_t)box->max.x - box->min.x, height = (int64_t)box->max.y - box->min.y;
    return width >= 0 && height >= 0 && width < SIDE_MAX && height < SIDE_MAX;
}

/* The display window; but where it shows nothing of the data, some program forgot to set it. */
static bool read_windows(struct exr_file *file)
{
    exr_attr_box2i_t *data = &file->data, *shown = &file->shown;
    if (exr_get_data_window(file->file, file->part, data) || !make_sense(data))
        return false;
    bool display = exr_get_display_window(file->file, file->part, shown) == EXR_ERR_SUCCESS
                   && make_sense(shown);
    bool meet = display && shown->min.x <= data->max.x && shown->max.x >= data->min.x
                && shown->min.y <= data->max.y && shown->max.y >= data->min.y;
    if (!meet || (shown->min.x == shown->max.x && shown->min.y == shown->max.y))
        *shown = *data;
    return true;
}

static enum status read_layout(struct exr_file *file, struct error *err)
{
    struct photo *info = &file->base.info;
    enum status status = choose_channels(file, err);
    if (status)
        return status;
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    int32_t lines = 1;
    exr_get_storage(file->file, file->part, &storage);
    if (!read_windows(file))
        return fail(file, err, "the size of the image makes no sense");
    if (storage == EXR_STORAGE_TILED
            ? exr_get_tile_sizes(file->file, file->part, 0, 0, &file->tile[0], &file->tile[1])
                  || file->tile[0] < 1 || file->tile[1] < 1
            : exr_get_scanlines_per_chunk(file->file, file->part, &lines))
        return fail(file, err, "damaged: it does not tell the size of its parts");
    read_settings(info, file->file, file->part);
    if (file->stored == 3 || !cap_cfa_is_valid(info->cfa))
        info->cfa[0] = '\0';
    info->channels = *info->cfa ? 1 : 3;
    info->gray = file->stored == 1 && !*info->cfa;
    info->width = file->shown.max.x - file->shown.min.x + 1;
    info->height = file->shown.max.y - file->shown.min.y + 1;
    info->bits = 32;
    int height = file->data.max.y - file->data.min.y + 1;
    int rows = file->tile[1] ? file->tile[1] : lines;
    file->base.rows_at_once = rows < height ? rows : height;
    file->base.any_row = true;
    file->band_top = -1;
    size_t width = (size_t)(file->data.max.x - file->data.min.x) + 1;
    size_t size = (size_t)file->base.rows_at_once * width * (size_t)file->stored * sizeof(float);
    if (!exr_can_hold(file->base.path, size))
        return fail(file, err, "damaged: it is too short for what it promises");
    file->band = malloc(size);
    return file->band ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", file->base.path);
}

/* One chunk of the file, from column `left` of the data window, into the band. */
static exr_result_t read_chunk(struct exr_file *file, const exr_chunk_info_t *chunk, int left)
{
    bool first = file->pipe.context == NULL;
    const int stored = file->stored, line = (file->data.max.x - file->data.min.x + 1) * stored;
    exr_result_t result = first
                              ? exr_decoding_initialize(file->file, file->part, chunk, &file->pipe)
                              : exr_decoding_update(file->file, file->part, chunk, &file->pipe);
    for (int i = 0; i < file->pipe.channel_count && !result; i++) {
        exr_coding_channel_info_t *channel = &file->pipe.channels[i];
        channel->decode_to_ptr = NULL;
        for (int c = 0; c < stored; c++)
            if (strcmp(channel->channel_name, file->name[c]) == 0)
                channel->decode_to_ptr = (uint8_t *)(file->band + (size_t)left * stored + c);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = sizeof(float);
        channel->user_pixel_stride = stored * (int)sizeof(float);
        channel->user_line_stride = line * (int)sizeof(float);
    }
    if (!result && first)
        result = exr_decoding_choose_default_routines(file->file, file->part, &file->pipe);
    return result ? result : exr_decoding_run(file->file, file->part, &file->pipe);
}

/* The rows of the data window from `top` on, which begin chunks. */
static exr_result_t read_band(struct exr_file *file, int top)
{
    exr_chunk_info_t chunk;
    exr_result_t result = EXR_ERR_SUCCESS;
    if (file->tile[0] == 0) {
        result =
            exr_read_scanline_chunk_info(file->file, file->part, file->data.min.y + top, &chunk);
        return result ? result : read_chunk(file, &chunk, 0);
    }
    int width = file->data.max.x - file->data.min.x + 1;
    for (int left = 0; left < width && !result; left += file->tile[0]) {
        result = exr_read_tile_chunk_info(file->file, file->part, left / file->tile[0],
                                          top / file->tile[1], 0, 0, &chunk);
        if (!result)
            result = read_chunk(file, &chunk, left);
    }
    return result;
}

/* One row of the image, from the band's row `line` or (NULL) from outside the data window. */
static void take_row(const struct exr_file *file, const float *line, float *dn)
{
    const int left = file->shown.min.x - file->data.min.x;
    const int columns = file->data.max.x - file->data.min.x + 1;
    const int channels = file->base.info.channels;
    for (int x = 0; x < file->base.info.width; x++)
        for (int c = 0; c < channels; c++) {
            int at = x + left;
            bool there = line && at >= 0 && at < columns;
            float v = there ? line[at * file->stored + (file->stored == 3 ? c : 0)] : NAN;
            dn[x * channels + c] = v == v ? 65535 * v : INFINITY;
        }
}

static enum status read_rows(struct photo_file *base, float *dn, int rows, struct error *err)
{
    struct exr_file *file = (struct exr_file *)base;
    const size_t line = (size_t)base->info.width * (size_t)base->info.channels;
    const size_t stored = (size_t)(file->data.max.x - file->data.min.x + 1) * (size_t)file->stored;
    for (int y = 0; dn && y < rows; y++) {
        int row = base->row + y + file->shown.min.y - file->data.min.y;
        bool there = row >= 0 && row <= file->data.max.y - file->data.min.y;
        int top = there ? row - row % base->rows_at_once : 0;
        if (there && file->band_top != top) {
            file->band_top = -1;
            if (read_band(file, top) != EXR_ERR_SUCCESS)
                return fail(file, err, *file->story.text ? file->story.text : "damaged");
            file->band_top = top;
        }
        take_row(file, there ? file->band + (size_t)(row - top) * stored : NULL,
                 dn + (size_t)y * line);
    }
    return STATUS_OK;
}

static void close_file(struct photo_file *base)
{
    struct exr_file *file = (struct exr_file *)base;
    if (file->pipe.context)
        exr_decoding_destroy(file->file, &file->pipe);
    if (file->file)
        exr_finish(&file->file);
    free(file->band);
}

enum status exr_open(struct photo_file **opened, const char *path, struct error *err)
{
    static const struct photo_format format = {read_rows, close_file};
    struct exr_file *file = photo_begin(sizeof *file, &format, path, err);
    if (!file)
        return STATUS_MEMORY;
    exr_context_initializer_t init = exr_initializer(&file->story);
    enum status status = STATUS_OK;
    if (exr_start_read(&file->file, path, &init) != EXR_ERR_SUCCESS)
        status = fail(file, err, *file->story.text ? file->story.text : "no EXR image");
    if (!status)
        status = read_layout(file, err);
    return photo_opened(opened, &file->base, status);
}
