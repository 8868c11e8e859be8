/* jpeg_write.c -- 8-bit JPEG with EXIF, by libjpeg and libexif. */
#include "jpeg_write.h"

#include "exif_block.h"

#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>

enum { QUALITY = 95 };  // a camera's best

static double srgb(double v)
{
    return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;  // IEC 61966-2-1
}

static unsigned char encode(const struct tone_curve *tone, double linear)
{
    double v = fmin(fmax(linear, 0), 1), encoded = srgb(v);
    if (tone->gamma > 0)
        encoded = pow(v, 1 / tone->gamma);
    if (tone->values > 0) {
        double at = v * (tone->values - 1);
        int low = (int)fmin(floor(at), tone->values - 2);
        encoded = tone->value[low] * (low + 1 - at) + tone->value[low + 1] * (at - low);
    }
    return (unsigned char)lround(255 * encoded);
}

/** The curve of one channel, for every DN. */
static void make_curve(unsigned char curve[65536], const struct scene *scene, int channel)
{
    const struct sensor_model *sensor = &scene->sensor;
    const double *gain = sensor->channel_gain;
    double largest = fmax(gain[0], fmax(gain[1], gain[2]));
    double range = (sensor->adc_max - sensor->black_level) * gain[channel] / largest;
    for (int dn = 0; dn < 65536; dn++)
        curve[dn] = encode(&scene->tone, (dn - sensor->black_level) / range);
}

static unsigned char *develop(const uint16_t *dn, const struct scene *scene)
{
    size_t pixels = (size_t)scene->camera.width * (size_t)scene->camera.height;
    unsigned char *rgb = malloc(3 * pixels), *curve = malloc(65536);
    for (int c = 0; c < 3 && rgb && curve; c++) {
        make_curve(curve, scene, c);
        for (size_t i = 0; i < pixels; i++)
            rgb[3 * i + (size_t)c] = curve[dn[3 * i + (size_t)c]];
    }
    if (!curve) {
        free(rgb);
        rgb = NULL;
    }
    free(curve);
    return rgb;
}

/** libjpeg's errors come back here instead of ending the program. */
struct failure {
    struct jpeg_error_mgr manager;  // first: libjpeg knows only this
    jmp_buf back;
    char text[JMSG_LENGTH_MAX];
};

static void come_back(j_common_ptr jpeg)
{
    struct failure *failure = (struct failure *)jpeg->err;
    jpeg->err->format_message(jpeg, failure->text);
    longjmp(failure->back, 1);
}

/** The whole file. false: failure->text says why. */
static bool compress(FILE *stream, unsigned char *rgb, const struct camera *camera,
                     const unsigned char *exif, unsigned exif_size, struct failure *failure)
{
    struct jpeg_compress_struct jpeg = {.err = jpeg_std_error(&failure->manager)};
    failure->manager.error_exit = come_back;
    if (setjmp(failure->back)) {
        jpeg_destroy_compress(&jpeg);
        return false;
    }
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, stream);
    jpeg.image_width = (JDIMENSION)camera->width;
    jpeg.image_height = (JDIMENSION)camera->height;
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, QUALITY, TRUE);
    jpeg_start_compress(&jpeg, TRUE);
    jpeg_write_marker(&jpeg, JPEG_APP0 + 1, exif, exif_size);
    while (jpeg.next_scanline < jpeg.image_height) {
        JSAMPROW row = &rgb[(size_t)jpeg.next_scanline * (size_t)camera->width * 3];
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    return true;
}

enum status sam_jpeg_write(const char *path, const uint16_t *dn, const struct scene *scene,
                           double seconds, struct error *err)
{
    struct atomic_file file = {0};
    struct failure failure;
    unsigned char *exif = NULL, *rgb = develop(dn, scene);
    unsigned size = 0;
    enum status status = STATUS_OK;
    if (!rgb || !sam_exif_block(&scene->exif, seconds, &exif, &size)) {
        status = cap_fail(err, STATUS_MEMORY, "%s: out of memory", path);
    } else if ((status = cap_file_begin(&file, path, true, err))) {
        // told
    } else if (!compress(file.stream, rgb, &scene->camera, exif, size, &failure)) {
        status = cap_fail(err, STATUS_IO, "%s: %s", path, failure.text);
        cap_file_abandon(&file);
    } else {
        status = cap_file_commit(&file, err);
    }
    free(exif);
    free(rgb);
    return status;
}
