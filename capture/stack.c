/* stack.c -- several photographs of the same, averaged. */
#include "stack.h"
#include "photo.h"

#include <stdlib.h>
#include <string.h>

int stack_channel(const struct stack *stack, size_t i, int y)
{
    if (stack->channels == 3)
        return (int)(i % 3);
    return cap_cfa_channel(stack->cfa, (int)i, y);
}

static bool begin(struct stack *stack, const struct photo *info)
{
    stack->width = info->width;
    stack->height = info->height;
    stack->channels = info->channels;
    memcpy(stack->cfa, info->cfa, sizeof stack->cfa);
    size_t count = (size_t)info->width * (size_t)info->height * (size_t)info->channels;
    stack->mean = calloc(count, sizeof *stack->mean);
    return stack->mean != NULL;
}

/* Add one frame to the sums. */
static enum status add_frame(struct stack *stack, struct photo_file *file,
                             const struct curve *curve, struct error *err)
{
    size_t count = (size_t)stack->width * (size_t)stack->channels;
    float *row = malloc(count * sizeof *row);
    enum status status = row ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", file->path);
    for (int y = 0; y < stack->height && !status; y++) {
        status = photo_read(file, row, 1, err);
        float *to = stack->mean + (size_t)y * count;
        for (size_t i = 0; i < count && !status; i++)
            to[i] += file->info.encoded ? curve->dn[i % 3][(unsigned char)row[i]] : row[i];
    }
    free(row);
    stack->frames++;
    bool timed = file->info.exposure_time > 0 && (stack->frames == 1 || stack->seconds > 0);
    stack->seconds = timed ? stack->seconds + file->info.exposure_time : 0;
    return status;
}

static enum status add_file(struct stack *stack, const char *path, const struct camera_kind *kind,
                            const struct curve *curve, struct error *err)
{
    struct photo_file *file = NULL;
    enum status status = photo_open(&file, path, err);
    if (status)
        return status;
    const struct photo *info = &file->info;
    bool fits = info->width == kind->width && info->height == kind->height
                && (!stack->mean || info->channels == stack->channels);
    if (fits && !stack->mean && !begin(stack, info))
        status = cap_fail(err, STATUS_MEMORY, "%s", path);
    if (fits && !status)
        status = add_frame(stack, file, curve, err);
    photo_close(file);
    return status;
}

enum status stack_read(struct stack *stack, const struct capture *capture,
                       const struct frame_names *names, int camera, const struct curve *curve,
                       struct error *err)
{
    struct stack made = {0};
    enum status status = STATUS_OK;
    for (int k = 0; k < names->count && !status; k++) {
        char *path = cap_path(capture->folder, names->name[k]);
        status = path ? add_file(&made, path, &capture->camera[camera], curve, err)
                      : cap_fail(err, STATUS_MEMORY, "%s", names->name[k]);
        free(path);
    }
    size_t count = (size_t)made.width * (size_t)made.height * (size_t)made.channels;
    for (size_t i = 0; i < count && made.frames > 1; i++)
        made.mean[i] /= (float)made.frames;
    if (status)
        stack_free(&made);
    else
        *stack = made;
    return status;
}

void stack_free(struct stack *stack)
{
    free(stack->mean);
    *stack = (struct stack){0};
}

void stack_levels(double level[3], const struct stack *stack)
{
    double sum[3] = {0}, count[3] = {0};
    size_t line = (size_t)stack->width * (size_t)stack->channels;
    for (int y = 0; y < stack->height; y++)
        for (size_t i = 0; i < line; i++) {
            int c = stack_channel(stack, i, y);
            sum[c] += (double)stack->mean[(size_t)y * line + i];
            count[c]++;
        }
    for (int c = 0; c < 3; c++)
        level[c] = count[c] > 0 ? sum[c] / count[c] : NAN;
}
