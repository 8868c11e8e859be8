/* exr.c -- radiance maps through OpenEXRCore: R, G, B, var.R, var.G, var.B, 32-bit float.
 *
 * Written uncompressed, one scan line a chunk: noise does not compress, and deflate would take
 * longer than the merge. Read in any scan-line form, half or float. Round trips are exact.
 */
#include "exr.h"

#include <openexr.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char inputs_attribute[] = "goniocam:inputs";
static const char *const channel_names[6] = {"R", "G", "B", "var.R", "var.G", "var.B"};

/* OpenEXR tells its story here; its user data is the buffer. */
static void keep_message(exr_const_context_t file, exr_result_t code, const char *message)
{
    (void)code;
    void *text = NULL;
    if (file && exr_get_user_data(file, &text) == EXR_ERR_SUCCESS && text)
        snprintf(text, sizeof((struct error *)0)->text, "%s", message);
}

static exr_context_initializer_t initializer(struct error *story)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_message;
    init.user_data = story->text;
    return init;
}

/* The place of a channel's first value; NULL for a channel that is not ours. */
static float *channel_start(const struct radiance *map, const char *name)
{
    for (int c = 0; c < 6; c++)
        if (strcmp(name, channel_names[c]) == 0)
            return (c < 3 ? map->value : map->variance) + c % 3;
    return NULL;
}

static exr_result_t write_header(exr_context_t file, const struct radiance *map, const char *inputs)
{
    int part;
    exr_result_t result = exr_add_part(file, "radiance", EXR_STORAGE_SCANLINE, &part);
    if (!result)
        result = exr_initialize_required_attr_simple(file, part, map->width, map->height,
                                                     EXR_COMPRESSION_NONE);
    for (int c = 0; c < 6 && !result; c++)
        result = exr_add_channel(file, part, channel_names[c], EXR_PIXEL_FLOAT,
                                 EXR_PERCEPTUALLY_LINEAR, 1, 1);
    if (!result && inputs)
        result = exr_attr_set_string(file, part, inputs_attribute, inputs);
    return result ? result : exr_write_header(file);
}

static exr_result_t write_lines(exr_context_t file, const struct radiance *map)
{
    exr_result_t result = EXR_ERR_SUCCESS;
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    for (int y = 0; y < map->height && !result; y++) {
        exr_chunk_info_t chunk;
        result = exr_write_scanline_chunk_info(file, 0, y, &chunk);
        if (!result)
            result = y == 0 ? exr_encoding_initialize(file, 0, &chunk, &pipe)
                            : exr_encoding_update(file, 0, &chunk, &pipe);
        for (int c = 0; c < pipe.channel_count && !result; c++) {
            exr_coding_channel_info_t *channel = &pipe.channels[c];
            float *start = channel_start(map, channel->channel_name);
            channel->encode_from_ptr = (const uint8_t *)(start + (size_t)y * map->width * 3);
            channel->user_pixel_stride = 3 * sizeof(float);
            channel->user_line_stride = map->width * 3 * (int)sizeof(float);
        }
        if (!result && y == 0)
            result = exr_encoding_choose_default_routines(file, 0, &pipe);
        if (!result)
            result = exr_encoding_run(file, 0, &pipe);
    }
    exr_encoding_destroy(file, &pipe);
    return result;
}

enum status exr_write(const struct radiance *map, const char *path, const char *inputs,
                      struct error *err)
{
    struct atomic_file aside;
    enum status status = cap_file_begin(&aside, path, false, err);
    if (status)
        return status;
    struct error story = {0};
    exr_context_initializer_t init = initializer(&story);
    exr_context_t file = NULL;
    exr_result_t result = exr_start_write(&file, aside.aside, EXR_WRITE_FILE_DIRECTLY, &init);
    if (!result)
        result = write_header(file, map, inputs);
    if (!result)
        result = write_lines(file, map);
    exr_result_t finished = file ? exr_finish(&file) : EXR_ERR_SUCCESS;
    if (!result)
        result = finished;
    if (!result)
        return cap_file_commit(&aside, err);
    status = cap_fail(err, STATUS_IO, "%s: cannot be written: %s", path,
                      *story.text ? story.text : exr_get_default_error_message(result));
    cap_file_abandon(&aside);
    return status;
}

enum status cap_radiance_write(const struct radiance *map, const char *path, struct error *err)
{
    return exr_write(map, path, NULL, err);
}

static exr_result_t read_chunk(exr_context_t file, const struct radiance *map, int top, int y,
                               exr_decode_pipeline_t *pipe)
{
    exr_chunk_info_t chunk;
    exr_result_t result = exr_read_scanline_chunk_info(file, 0, y, &chunk);
    bool first = pipe->context == NULL;
    if (!result)
        result = first ? exr_decoding_initialize(file, 0, &chunk, pipe)
                       : exr_decoding_update(file, 0, &chunk, pipe);
    for (int c = 0; c < pipe->channel_count && !result; c++) {
        exr_coding_channel_info_t *channel = &pipe->channels[c];
        float *start = channel_start(map, channel->channel_name);
        if (start)
            channel->decode_to_ptr = (uint8_t *)(start + (size_t)(y - top) * map->width * 3);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = sizeof(float);
        channel->user_pixel_stride = 3 * sizeof(float);
        channel->user_line_stride = map->width * 3 * (int)sizeof(float);
    }
    if (!result && first)
        result = exr_decoding_choose_default_routines(file, 0, pipe);
    return result ? result : exr_decoding_run(file, 0, pipe);
}

static exr_result_t read_lines(exr_context_t file, const struct radiance *map, int top)
{
    int32_t lines = 1;
    exr_decode_pipeline_t pipe = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_result_t result = exr_get_scanlines_per_chunk(file, 0, &lines);
    for (int y = top; y < top + map->height && !result; y += lines)
        result = read_chunk(file, map, top, y, &pipe);
    exr_decoding_destroy(file, &pipe);
    return result;
}

/* Scan lines, and all six channels at full resolution? */
static bool has_our_form(exr_context_t file)
{
    exr_storage_t storage;
    const exr_attr_chlist_t *channels;
    if (exr_get_storage(file, 0, &storage) || storage != EXR_STORAGE_SCANLINE
        || exr_get_channels(file, 0, &channels))
        return false;
    int found = 0;
    for (int i = 0; i < channels->num_channels; i++)
        for (int c = 0; c < 6; c++)
            found += strcmp(channels->entries[i].name.str, channel_names[c]) == 0
                     && channels->entries[i].x_sampling == 1
                     && channels->entries[i].y_sampling == 1;
    return found == 6;
}

static enum status read_open_file(struct radiance *map, exr_context_t file, const char *path,
                                  const struct error *story, struct error *err)
{
    exr_attr_box2i_t box;
    if (!has_our_form(file) || exr_get_data_window(file, 0, &box))
        return cap_fail(err, STATUS_FORMAT,
                        "%s: not a radiance map (scan lines of R, G, B, var.R, var.G, var.B)",
                        path);
    struct radiance made = {.width = box.max.x - box.min.x + 1,
                            .height = box.max.y - box.min.y + 1};
    size_t count = 3 * (size_t)made.width * (size_t)made.height;
    made.value = malloc(count * sizeof *made.value);
    made.variance = malloc(count * sizeof *made.variance);
    enum status status = STATUS_OK;
    if (!made.value || !made.variance) {
        status = cap_fail(err, STATUS_MEMORY, "%s: %zu values", path, 2 * count);
    } else if (read_lines(file, &made, box.min.y) != EXR_ERR_SUCCESS) {
        status = cap_fail(err, STATUS_FORMAT, "%s: %s", path, story->text);
    } else {
        *map = made;
        made = (struct radiance){0};  // the caller's now
    }
    cap_radiance_free(&made);
    return status;
}

enum status cap_radiance_read(struct radiance *map, const char *path, struct error *err)
{
    struct error story = {0};
    exr_context_initializer_t init = initializer(&story);
    exr_context_t file = NULL;
    exr_result_t result = exr_start_read(&file, path, &init);
    enum status status;
    if (result)
        status = cap_fail(err, result == EXR_ERR_FILE_ACCESS ? STATUS_IO : STATUS_FORMAT, "%s: %s",
                          path, *story.text ? story.text : exr_get_default_error_message(result));
    else
        status = read_open_file(map, file, path, &story, err);
    if (file)
        exr_finish(&file);
    return status;
}

bool exr_made_from(const char *path, const char *inputs)
{
    if (access(path, R_OK) != 0)
        return false;
    struct error story = {0};
    exr_context_initializer_t init = initializer(&story);
    exr_context_t file = NULL;
    int32_t length = 0;
    const char *text = NULL;
    bool same = exr_start_read(&file, path, &init) == EXR_ERR_SUCCESS && has_our_form(file)
                && exr_attr_get_string(file, 0, inputs_attribute, &length, &text) == EXR_ERR_SUCCESS
                && strcmp(text, inputs) == 0;
    if (file)
        exr_finish(&file);
    return same;
}

void cap_radiance_free(struct radiance *map)
{
    free(map->value);
    free(map->variance);
    *map = (struct radiance){0};
}
