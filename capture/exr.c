/* exr.c -- radiance maps read through OpenEXRCore: R, G, B, var.R, var.G, var.B, or a mosaic's Y
 * and var.Y; any scan-line form, half or float. Round trips of float are exact.
 */
#include "exr_library.h"
#include "map_file.h"
#include "map_room.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char inputs_attribute[] = "goniocam:inputs";
static const char *const rgb_names[6] = {"R", "G", "B", "var.R", "var.G", "var.B"};
static const char *const mosaic_names[2] = {"Y", "var.Y"};

/* OpenEXR tells its story here; its user data is the buffer. */
static void keep_message(exr_const_context_t file, exr_result_t code, const char *message)
{
    (void)code;
    void *text = NULL;
    if (file && exr_get_user_data(file, &text) == EXR_ERR_SUCCESS && text)
        snprintf(text, sizeof((struct error *)0)->text, "%s", message);
}

exr_context_initializer_t exr_initializer(struct error *story)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_message;
    init.user_data = story->text;
    return init;
}

/* The place of a channel's first value; NULL for a channel that is not ours. */
static float *channel_start(const struct radiance *map, const char *name)
{
    const char *const *names = map->channels == 3 ? rgb_names : mosaic_names;
    for (int c = 0; c < 2 * map->channels; c++)
        if (strcmp(name, names[c]) == 0)
            return (c < map->channels ? map->value : map->variance) + c % map->channels;
    return NULL;
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
            channel->decode_to_ptr =
                (uint8_t *)(start + (size_t)(y - top) * map->width * map->channels);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = sizeof(float);
        channel->user_pixel_stride = map->channels * (int)sizeof(float);
        channel->user_line_stride = map->width * map->channels * (int)sizeof(float);
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

/* How many of the names are channels at full resolution. */
static int count_names(const exr_attr_chlist_t *channels, const char *const *names, int count)
{
    int found = 0;
    for (int i = 0; i < channels->num_channels; i++)
        for (int c = 0; c < count; c++)
            found += strcmp(channels->entries[i].name.str, names[c]) == 0
                     && channels->entries[i].x_sampling == 1
                     && channels->entries[i].y_sampling == 1;
    return found;
}

/* How many photosites share their colour; where nobody tells, each has its own. */
static void read_chroma(struct radiance *map, exr_context_t file)
{
    exr_attr_v2i_t chroma = {{{0, 0}}};
    if (exr_attr_get_v2i(file, 0, EXR_CHROMA, &chroma) == EXR_ERR_SUCCESS) {
        map->chroma[0] = chroma.x;
        map->chroma[1] = chroma.y;
    }
}

/* 3, or 1 with the mosaic's cfa; 0: not our form. */
static int our_channels(exr_context_t file, char cfa[CFA_SIZE])
{
    exr_storage_t storage;
    const exr_attr_chlist_t *channels;
    int32_t length = 0;
    const char *text = NULL;
    cfa[0] = '\0';
    if (exr_get_storage(file, 0, &storage) || storage != EXR_STORAGE_SCANLINE
        || exr_get_channels(file, 0, &channels))
        return 0;
    if (count_names(channels, rgb_names, 6) == 6)
        return 3;
    if (count_names(channels, mosaic_names, 2) != 2
        || exr_attr_get_string(file, 0, EXR_CFA, &length, &text) || !text
        || !cap_cfa_is_valid(text))
        return 0;
    snprintf(cfa, CFA_SIZE, "%s", text);
    return 1;
}

/* No compression of EXR's packs more than a deflate stream's 1032 to 1: a header that promises more
 * than that is damaged, and the memory it asks for is not worth trying. */
bool exr_can_hold(const char *path, size_t bytes)
{
    struct stat about;
    return stat(path, &about) == 0 && bytes / 1032 <= (size_t)about.st_size;
}

static enum status read_open_file(struct radiance *map, exr_context_t file, const char *path,
                                  const struct error *story, struct error *err)
{
    exr_attr_box2i_t box;
    struct radiance made = {0};
    made.channels = our_channels(file, made.cfa);
    read_chroma(&made, file);
    if (made.channels == 0 || exr_get_data_window(file, 0, &box))
        return cap_fail(err, STATUS_FORMAT,
                        "%s: not a radiance map (scan lines of R, G, B, var.R, var.G, var.B, or of "
                        "Y, var.Y with an attribute cfa)",
                        path);
    made.width = box.max.x - box.min.x + 1;
    made.height = box.max.y - box.min.y + 1;
    size_t count = (size_t)made.channels * (size_t)made.width * (size_t)made.height;
    if (!exr_can_hold(path, 2 * count * sizeof(float)))
        return cap_fail(err, STATUS_FORMAT, "%s: shorter than its %d x %d pixels", path, made.width,
                        made.height);
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

enum status cap_radiance_read_stored(struct radiance *map, const char *path, struct error *err)
{
    struct error story = {0};
    exr_context_initializer_t init = exr_initializer(&story);
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
    exr_context_initializer_t init = exr_initializer(&story);
    exr_context_t file = NULL;
    int32_t length = 0;
    const char *text = NULL;
    char cfa[CFA_SIZE];
    bool same = exr_start_read(&file, path, &init) == EXR_ERR_SUCCESS && our_channels(file, cfa) > 0
                && exr_attr_get_string(file, 0, inputs_attribute, &length, &text) == EXR_ERR_SUCCESS
                && strcmp(text, inputs) == 0;
    if (file)
        exr_finish(&file);
    return same;
}

/* Channels of ours alone, all in float, each line a chunk of its own, which is not compressed. */
static bool is_plain(exr_context_t file, struct radiance *map, size_t *first)
{
    exr_compression_t compression;
    const exr_attr_chlist_t *channels;
    exr_attr_box2i_t box;
    exr_chunk_info_t chunk;
    map->channels = our_channels(file, map->cfa);
    read_chroma(map, file);
    if (map->channels == 0 || exr_get_compression(file, 0, &compression)
        || compression != EXR_COMPRESSION_NONE || exr_get_channels(file, 0, &channels)
        || channels->num_channels != 2 * map->channels || exr_get_data_window(file, 0, &box)
        || exr_read_scanline_chunk_info(file, 0, box.min.y, &chunk))
        return false;
    for (int i = 0; i < channels->num_channels; i++)
        if (channels->entries[i].pixel_type != EXR_PIXEL_FLOAT)
            return false;
    map->width = box.max.x - box.min.x + 1;
    map->height = box.max.y - box.min.y + 1;
    *first = chunk.data_offset;
    return __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
}

bool exr_is_plain(struct radiance *map, size_t *first, const char *path)
{
    struct error story = {0};
    exr_context_initializer_t init = exr_initializer(&story);
    exr_context_t file = NULL;
    bool plain =
        exr_start_read(&file, path, &init) == EXR_ERR_SUCCESS && is_plain(file, map, first);
    if (file)
        exr_finish(&file);
    return plain;
}

void cap_radiance_free(struct radiance *map)
{
    map_file_close(map->file);
    map_room_give(map->value);
    map_room_give(map->variance);
    *map = (struct radiance){0};
}
