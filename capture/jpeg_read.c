/* jpeg_read.c -- JPEG photographs through libjpeg-turbo, their EXIF through exif_read.c; baseline
 * or progressive, colour or gray.
 *
 * libjpeg goes on after a file ends early, with grey, and only warns: here such warnings are
 * errors, for a grey half is no measurement. Its errors leave by longjmp.
 */
#include "photo.h"

#include <errno.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>
#include <jerror.h>

struct jpeg_file {
    struct photo_file base;
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    jmp_buf leave;
    FILE *stream;
    JSAMPLE *line;
    char message[JMSG_LENGTH_MAX];
};

static void leave_with_message(j_common_ptr jpeg)
{
    struct jpeg_file *file = jpeg->client_data;
    jpeg->err->format_message(jpeg, file->message);
    longjmp(file->leave, 1);
}

static void judge_warning(j_common_ptr jpeg, int level)
{
    int code = jpeg->err->msg_code;
    bool lost_data = code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER || code == JWRN_MUST_RESYNC
                     || code == JWRN_HUFF_BAD_CODE || code == JWRN_BOGUS_PROGRESSION;
    if (level < 0 && lost_data)
        leave_with_message(jpeg);
}

static void print_nothing(j_common_ptr jpeg)
{
    (void)jpeg;
}

static void read_exif(struct jpeg_file *file)
{
    for (jpeg_saved_marker_ptr m = file->jpeg.marker_list; m; m = m->next) {
        if (m->data_length < 6 || memcmp(m->data, "Exif\0", 6) != 0)
            continue;
        exif_take(&file->base.info, m->data + 6, m->data_length - 6);
        return;
    }
}

static enum status fail(struct jpeg_file *file, struct error *err, const char *what)
{
    return cap_fail(err, STATUS_FORMAT, "%s: %s", file->base.path, what);
}

static enum status begin(struct jpeg_file *file, struct error *err)
{
    enum { EXIF_MARKER = JPEG_APP0 + 1, MARKER_BYTES = 0xFFFF };
    if (setjmp(file->leave))
        return fail(file, err, file->message);
    jpeg_create_decompress(&file->jpeg);
    file->jpeg.client_data = file;
    jpeg_stdio_src(&file->jpeg, file->stream);
    jpeg_save_markers(&file->jpeg, EXIF_MARKER, MARKER_BYTES);
    jpeg_read_header(&file->jpeg, TRUE);
    if (file->jpeg.num_components != 3 && file->jpeg.num_components != 1)
        return fail(file, err, "the colours of print (CMYK), not RGB; save it as RGB");
    read_exif(file);
    file->jpeg.out_color_space = JCS_RGB;
    jpeg_start_decompress(&file->jpeg);
    struct photo *info = &file->base.info;
    info->width = (int)file->jpeg.output_width;
    info->height = (int)file->jpeg.output_height;
    info->channels = 3;
    info->gray = file->jpeg.num_components == 1;
    const jpeg_component_info *colour = &file->jpeg.comp_info[file->jpeg.num_components - 1];
    info->chroma[0] = file->jpeg.max_h_samp_factor / colour->h_samp_factor;
    info->chroma[1] = file->jpeg.max_v_samp_factor / colour->v_samp_factor;
    info->bits = 8;
    info->encoded = true;
    file->line = malloc(3 * (size_t)info->width);
    return file->line ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", file->base.path);
}

static enum status read_rows(struct photo_file *base, float *dn, int rows, struct error *err)
{
    struct jpeg_file *file = (struct jpeg_file *)base;
    if (setjmp(file->leave))
        return fail(file, err, file->message);
    if (!dn) {
        jpeg_skip_scanlines(&file->jpeg, (JDIMENSION)rows);
        return STATUS_OK;
    }
    size_t count = 3 * (size_t)base->info.width;
    for (int y = 0; y < rows; y++) {
        jpeg_read_scanlines(&file->jpeg, &file->line, 1);
        for (size_t i = 0; i < count; i++)
            dn[y * count + i] = file->line[i];
    }
    return STATUS_OK;
}

static void close_file(struct photo_file *base)
{
    struct jpeg_file *file = (struct jpeg_file *)base;
    jpeg_destroy_decompress(&file->jpeg);
    if (file->stream)
        fclose(file->stream);
    free(file->line);
}

enum status jpeg_open(struct photo_file **opened, const char *path, struct error *err)
{
    static const struct photo_format format = {read_rows, close_file};
    struct jpeg_file *file = photo_begin(sizeof *file, &format, path, err);
    if (!file)
        return STATUS_MEMORY;
    file->jpeg.err = jpeg_std_error(&file->errors);
    file->jpeg.client_data = file;
    file->errors.error_exit = leave_with_message;
    file->errors.emit_message = judge_warning;
    file->errors.output_message = print_nothing;
    file->stream = fopen(path, "rb");
    enum status status =
        file->stream ? begin(file, err) : cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    return photo_opened(opened, &file->base, status);
}
