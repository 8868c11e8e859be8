/* coding.c -- what the codes of a JPEG photograph are worth, from its tables and coefficients.
 *
 * Each component, Y, Cb or Cr, tells of its own blocks (coding_plane.c); they become red, green and
 * blue by JFIF's matrix (ITU-T T.871). The file is read once more for that, without its transform:
 * the coefficients of all blocks are in memory at once, 2 bytes each, and then no more.
 */
#include "coding_plane.h"

#include <errno.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

struct coded {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    jmp_buf leave;
    char message[JMSG_LENGTH_MAX];
    int planes;
    struct plane plane[3];
};

/* Y, Cb and Cr of red, green and blue; and back. */
static const double from_rgb[3][3] = {
    {0.299, 0.587, 0.114}, {-0.1687, -0.3313, 0.5}, {0.5, -0.4187, -0.0813}};
static const double to_rgb[3][3] = {{1, 0, 1.402}, {1, -0.3441, -0.7141}, {1, 1.772, 0}};

static bool make_plane(struct coded *file, int k, jvirt_barray_ptr blocks)
{
    struct plane *p = &file->plane[k];
    const struct jpeg_decompress_struct *jpeg = &file->jpeg;
    jpeg_component_info *info = &jpeg->comp_info[k];
    bool mixed = jpeg->jpeg_color_space == JCS_YCbCr;
    *p = (struct plane){.jpeg = (j_common_ptr)&file->jpeg,
                        .info = info,
                        .blocks = blocks,
                        .first = &file->plane[0],
                        .across = (int)info->width_in_blocks,
                        .down = (int)info->height_in_blocks,
                        .wide = jpeg->max_h_samp_factor / info->h_samp_factor,
                        .high = jpeg->max_v_samp_factor / info->v_samp_factor};
    for (int c = 0; c < 3; c++) {
        double part = mixed ? from_rgb[k][c] : k == c;
        p->noise[c] = part * part / (p->wide * p->high);
    }
    size_t count = (size_t)p->across * (size_t)p->down;
    p->active = malloc(count);
    p->kept = malloc(count * sizeof *p->kept);
    p->lost = malloc(count * sizeof *p->lost);
    return p->active && p->kept && p->lost && info->quant_table;
}

/* The component's block where block (x, y) of the picture's full size stands. */
static int block_at(const struct plane *p, int x, int y)
{
    int u = x / p->wide, v = y / p->high;
    return (v < p->down ? v : p->down - 1) * p->across + (u < p->across ? u : p->across - 1);
}

static void mix(struct coding *coding, const struct coded *file)
{
    bool mixed = file->jpeg.jpeg_color_space == JCS_YCbCr;
    for (int i = 0; i < 3 * coding->across * coding->down; i++) {
        int x = i / 3 % coding->across, y = i / 3 / coding->across, c = i % 3;
        double kept = mixed ? CODE_ROUNDING : 0, lost = 0;
        for (int k = 0; k < file->planes; k++) {
            const struct plane *p = &file->plane[k];
            double part = mixed ? to_rgb[c][k] : file->planes == 1 || k == c;
            kept += part * part * (double)p->kept[block_at(p, x, y)];
            lost += part * part * (double)p->lost[block_at(p, x, y)];
        }
        coding->kept[i] = (float)kept;
        coding->lost[i] = (float)lost;
    }
}

static enum status read_file(struct coding *coding, struct coded *file, FILE *stream,
                             const char *path, const struct code_noise *noise, struct error *err)
{
    if (setjmp(file->leave))
        return cap_fail(err, STATUS_FORMAT, "%s: %s", path, file->message);
    jpeg_stdio_src(&file->jpeg, stream);
    jpeg_read_header(&file->jpeg, TRUE);
    jvirt_barray_ptr *blocks = jpeg_read_coefficients(&file->jpeg);
    file->planes = file->jpeg.num_components == 3 ? 3 : 1;
    for (int k = 0; k < file->planes; k++)
        if (!make_plane(file, k, blocks[k]))
            return cap_fail(err, STATUS_MEMORY, "%s: %d blocks", path, file->plane[k].across);
    for (int k = 0; k < file->planes; k++)
        plane_find_worth(&file->plane[k], noise);
    coding->across = ((int)file->jpeg.image_width + BLOCK_SIDE - 1) / BLOCK_SIDE;
    coding->down = ((int)file->jpeg.image_height + BLOCK_SIDE - 1) / BLOCK_SIDE;
    size_t count = 3 * (size_t)coding->across * (size_t)coding->down;
    coding->kept = malloc(count * sizeof *coding->kept);
    coding->lost = malloc(count * sizeof *coding->lost);
    if (!coding->kept || !coding->lost)
        return cap_fail(err, STATUS_MEMORY, "%s: %zu numbers", path, count);
    mix(coding, file);
    return STATUS_OK;
}

static void leave_with_message(j_common_ptr jpeg)
{
    struct coded *file = jpeg->client_data;
    jpeg->err->format_message(jpeg, file->message);
    longjmp(file->leave, 1);
}

static void ignore_warning(j_common_ptr jpeg, int level)
{
    (void)jpeg, (void)level;  // who reads the pixels judges
}

static bool is_jpeg(FILE *stream)
{
    unsigned char magic[2] = {0};
    bool jpeg = fread(magic, 1, 2, stream) == 2 && magic[0] == 0xFF && magic[1] == 0xD8;
    rewind(stream);
    return jpeg;
}

enum status coding_read(struct coding *coding, const char *path, const struct code_noise *noise,
                        struct error *err)
{
    FILE *stream = fopen(path, "rb");
    struct coding made = {0};
    if (!stream)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    struct coded *file = is_jpeg(stream) ? calloc(1, sizeof *file) : NULL;
    enum status status = STATUS_OK;
    if (file) {
        file->jpeg.err = jpeg_std_error(&file->errors);
        file->errors.error_exit = leave_with_message;
        file->errors.emit_message = ignore_warning;
        jpeg_create_decompress(&file->jpeg);
        file->jpeg.client_data = file;
        status = read_file(&made, file, stream, path, noise, err);
        jpeg_destroy_decompress(&file->jpeg);
        for (int k = 0; k < 3; k++) {
            free(file->plane[k].active);
            free(file->plane[k].kept);
            free(file->plane[k].lost);
        }
    }
    free(file);
    fclose(stream);
    if (status)
        coding_free(&made);
    else
        *coding = made;
    return status;
}

void coding_free(struct coding *coding)
{
    free(coding->kept);
    free(coding->lost);
    *coding = (struct coding){0};
}
