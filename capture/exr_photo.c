/* exr_photo.c -- EXR images as photographs: linear already, half or float, R, G, B or a mosaic Y.
 *
 * Chunks of scan lines are decoded whole into a band of rows. The standard attributes expTime,
 * aperture, isoSpeed, focalLength and the texts of the camera are taken for EXIF.
 */
#include "exr_library.h"
#include "photo.h"

#include <stdlib.h>
#include <string.h>

struct exr_file {
    struct photo_file base;
    exr_context_t file;
    exr_decode_pipeline_t pipe;
    struct error story;
    float *band;        // [rows_at_once][width][channels]
    int top, band_top;  // of the data window; the first row that band holds, -1: none
};

static enum status fail(struct exr_file *file, struct error *err, const char *what)
{
    return cap_fail(err, STATUS_FORMAT, "%s: %s", file->base.path, what);
}

static double number_attribute(exr_context_t file, const char *name)
{
    float value = 0;
    return exr_attr_get_float(file, 0, name, &value) == EXR_ERR_SUCCESS ? (double)value : 0;
}

static void text_attribute(exr_context_t file, const char *name, char *to, size_t size)
{
    const char *text = NULL;
    int32_t length = 0;
    if (exr_attr_get_string(file, 0, name, &length, &text) == EXR_ERR_SUCCESS && text)
        snprintf(to, size, "%.*s", (int)length, text);
}

static void read_settings(struct photo *info, exr_context_t file)
{
    info->exposure_time = number_attribute(file, "expTime");
    info->aperture = number_attribute(file, "aperture");
    info->iso = number_attribute(file, "isoSpeed");
    info->focal_length = number_attribute(file, "focalLength");
    text_attribute(file, "cameraMake", info->make, sizeof info->make);
    text_attribute(file, "cameraModel", info->model, sizeof info->model);
    text_attribute(file, "lensModel", info->lens, sizeof info->lens);
    text_attribute(file, "capDate", info->taken, sizeof info->taken);
    text_attribute(file, EXR_CFA, info->cfa, sizeof info->cfa);
}

static bool has_channels(exr_context_t file, const char *names)
{
    const exr_attr_chlist_t *channels;
    size_t found = 0;
    if (exr_get_channels(file, 0, &channels))
        return false;
    for (int i = 0; i < channels->num_channels; i++)
        found += channels->entries[i].name.length == 1
                 && strchr(names, channels->entries[i].name.str[0])
                 && channels->entries[i].x_sampling == 1 && channels->entries[i].y_sampling == 1;
    return found == strlen(names);
}

static enum status read_layout(struct exr_file *file, struct error *err)
{
    enum { SIDE_MAX = 65535 };
    struct photo *info = &file->base.info;
    exr_storage_t storage;
    exr_attr_box2i_t box;
    int32_t lines = 1;
    if (exr_get_storage(file->file, 0, &storage) || storage != EXR_STORAGE_SCANLINE
        || exr_get_data_window(file->file, 0, &box)
        || exr_get_scanlines_per_chunk(file->file, 0, &lines))
        return fail(file, err, "not an EXR image of scan lines");
    read_settings(info, file->file);
    bool mosaic = strlen(info->cfa) == 4 && has_channels(file->file, "Y");
    if (!mosaic && !has_channels(file->file, "RGB"))
        return fail(file, err, "neither R, G, B nor a mosaic Y with its attribute cfa");
    if (!mosaic)
        info->cfa[0] = '\0';
    info->width = box.max.x - box.min.x + 1;
    info->height = box.max.y - box.min.y + 1;
    if (info->width > SIDE_MAX || info->height > SIDE_MAX)
        return fail(file, err, "the size of the image makes no sense");
    info->channels = mosaic ? 1 : 3;
    info->bits = 32;
    file->top = box.min.y;
    file->band_top = -1;
    file->base.rows_at_once = lines;
    file->band = malloc((size_t)lines * info->width * info->channels * sizeof *file->band);
    return file->band ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", file->base.path);
}

static exr_result_t read_chunk(struct exr_file *file, int y)
{
    static const char colours[] = "RGB";
    int channels = file->base.info.channels;
    exr_chunk_info_t chunk;
    exr_result_t result = exr_read_scanline_chunk_info(file->file, 0, file->top + y, &chunk);
    bool first = file->pipe.context == NULL;
    if (!result)
        result = first ? exr_decoding_initialize(file->file, 0, &chunk, &file->pipe)
                       : exr_decoding_update(file->file, 0, &chunk, &file->pipe);
    for (int c = 0; c < file->pipe.channel_count && !result; c++) {
        exr_coding_channel_info_t *channel = &file->pipe.channels[c];
        const char *name = channel->channel_name, *at = strchr(colours, name[0]);
        int place = channels == 1               ? (strcmp(name, "Y") == 0 ? 0 : -1)
                    : at && name[0] && !name[1] ? (int)(at - colours)
                                                : -1;
        channel->decode_to_ptr = place < 0 ? NULL : (uint8_t *)(file->band + place);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = sizeof(float);
        channel->user_pixel_stride = channels * (int)sizeof(float);
        channel->user_line_stride = file->base.info.width * channels * (int)sizeof(float);
    }
    if (!result && first)
        result = exr_decoding_choose_default_routines(file->file, 0, &file->pipe);
    return result ? result : exr_decoding_run(file->file, 0, &file->pipe);
}

static enum status read_rows(struct photo_file *base, float *dn, int rows, struct error *err)
{
    struct exr_file *file = (struct exr_file *)base;
    size_t line = (size_t)base->info.width * (size_t)base->info.channels;
    for (int y = 0; dn && y < rows; y++) {
        int row = base->row + y, top = row - row % base->rows_at_once;
        if (file->band_top != top && read_chunk(file, top) != EXR_ERR_SUCCESS) {
            file->band_top = -1;
            return fail(file, err, *file->story.text ? file->story.text : "damaged");
        }
        file->band_top = top;
        for (size_t i = 0; i < line; i++) {
            float v = file->band[(size_t)(row - top) * line + i];
            dn[(size_t)y * line + i] = v == v ? 65535 * v : INFINITY;
        }
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
    free(base->path);
    free(file);
}

enum status exr_open(struct photo_file **opened, const char *path, struct error *err)
{
    static const struct photo_format format = {read_rows, close_file};
    struct exr_file *file = calloc(1, sizeof *file);
    char *copy = strdup(path);
    if (!file || !copy) {
        free(file);
        free(copy);
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    }
    file->base = (struct photo_file){
        .format = &format, .path = copy, .info = photo_unknown(), .any_row = true};
    exr_context_initializer_t init = exr_initializer(&file->story);
    enum status status = STATUS_OK;
    if (exr_start_read(&file->file, path, &init) != EXR_ERR_SUCCESS)
        status = fail(file, err, *file->story.text ? file->story.text : "no EXR image");
    if (!status)
        status = read_layout(file, err);
    if (status)
        close_file(&file->base);
    else
        *opened = &file->base;
    return status;
}
