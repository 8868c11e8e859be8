/* What JPEG files lose: of pictures of known truth, written by libjpeg with other tables and
 * subsampling, the stated variances are the errors that there are; and merged brackets have them.
 */
#include "blocks.h"
#include "photo.h"
#include "response.h"
#include "synthetic.h"

#include <stdio.h>
#include <unistd.h>

#include <jpeglib.h>

enum { WIDTH = 512, HEIGHT = 384, PIXELS = WIDTH * HEIGHT, COUNT = 3 * WIDTH };
enum { FRAMES = 3 };

static const double times[FRAMES] = {0.01, 0.04, 0.16};

static struct row {
    const char *name;
    int quality, sampling;  // of luma: 2 is 4:2:0, 1 is 4:4:4
    double electrons;       // of full scale
    bool progressive;
} rows[] = {
    {"quality 75, 4:2:0", 75, 2, 50000, false},
    {"quality 75, 4:4:4", 75, 1, 50000, false},
    {"quality 90, 4:2:0", 90, 2, 50000, true},
    {"quality 90, 4:4:4", 90, 1, 50000, false},
    {"quality 95, 4:2:0", 95, 2, 50000, false},
    {"quality 95, 4:4:4", 95, 1, 50000, true},
    {"quality 100, 4:2:0", 100, 2, 50000, false},
    {"quality 100, 4:4:4", 100, 1, 50000, false},
    {"quality 95 of a noisy sensor", 95, 2, 8000, false},
};
enum { ROWS = sizeof rows / sizeof *rows };

static char path[] = "/tmp/test_coding_XXXXXX";
static float truth[3 * PIXELS];  // of full scale, in the longest frame

/* A shaded ball before a print: smooth shading, edges of all directions, fine detail, colours. */
static void make_truth(void)
{
    uint64_t seed = 5;
    static float paper[48][64];
    for (int i = 0; i < 48 * 64; i++)
        paper[i / 64][i % 64] = random_uniform(&seed) < 0.5 ? 0.06f : 0.75f;
    for (int i = 0; i < PIXELS; i++) {
        double x = i % WIDTH, y = (double)(i / WIDTH), u = (x - 170) / 120, v = (y - 190) / 120;
        double r2 = u * u + v * v, shade = 0.9 - 0.3 * x / WIDTH - 0.2 * y / HEIGHT;
        for (int c = 0; c < 3; c++) {
            double value = 0.75 * shade;
            if (r2 < 1) {
                static const double colour[3] = {0.5, 0.25, 0.12};
                double n = sqrt(1 - r2), light = fmax(0.6 * n - 0.5 * u - 0.5 * v, 0) / 0.93;
                value = 0.01 + colour[c] * light + 0.3 * pow(light, 40);
            } else if (x > 330 && y < 330) {
                // Cells of 7.3 pixels, averaged over a pixel and a half.
                for (int k = 0, first = 1; k < 25; k++, first = 0) {
                    double s = (x + k % 5 * 0.3 + 0.07) / 7.3, t = (y + k / 5 * 0.3 + 0.01) / 7.3;
                    value =
                        (first ? 0 : value) + shade * (double)paper[(int)t % 48][(int)s % 64] / 25;
                }
            }
            truth[3 * i + c] = (float)value;
        }
    }
}

static unsigned char srgb_code(double v)
{
    v = fmin(fmax(v, 0), 1);
    return (unsigned char)lround(255
                                 * (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055));
}

static void write_jpeg(const struct row *r, const unsigned char *rgb)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = WIDTH;
    jpeg.image_height = HEIGHT;
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, r->quality, TRUE);
    jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = r->sampling;
    if (r->progressive)
        jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    for (int y = 0; y < HEIGHT; y++) {
        JSAMPROW line = (JSAMPROW)(rgb + (size_t)y * COUNT);
        jpeg_write_scanlines(&jpeg, &line, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    assert_int_equal(fclose(file), 0);
}

static struct sensor sensor_of(const struct row *r)
{
    struct sensor sensor = {0};
    for (int c = 0; c < 3; c++) {
        sensor.white[c] = 65535;
        sensor.usable[c] = 0.96 * 65535;
        sensor.gain[c] = r->electrons / 65535;
        sensor.read_noise[c] = 65535 * 4 / r->electrons;
    }
    return sensor;
}

static struct code_noise noise_of(const struct sensor *sensor, const struct curve *curve)
{
    struct code_noise noise;
    for (int z = 0; z < 256; z++)
        for (int c = 0; c < 3; c++) {
            double dn = (double)curve->dn[c][z];
            double step =
                (double)(curve->dn[c][z < 255 ? z + 1 : 255] - curve->dn[c][z < 255 ? z : 254]);
            noise.variance[z][c] =
                (sensor->read_noise[c] * sensor->read_noise[c] + dn / sensor->gain[c])
                    / (step * step)
                + 1.0 / 12;
        }
    return noise;
}

/* A frame: linear DN as they are read, and what its codes are worth. */
static void shoot(float *dn, struct coding *coding, const struct row *r, int f,
                  const struct sensor *sensor, const struct curve *curve, uint64_t *seed)
{
    static unsigned char rgb[3 * PIXELS];
    struct error err = {0};
    const struct code_noise noise = noise_of(sensor, curve);
    for (int i = 0; i < 3 * PIXELS; i++) {
        double v = (double)truth[i] * times[f] / times[FRAMES - 1] * 2.5, e = v * r->electrons;
        rgb[i] = srgb_code((e + sqrt(e + 16) * random_normal(seed)) / r->electrons);
    }
    write_jpeg(r, rgb);
    struct photo_file *file = NULL;
    assert_int_equal(photo_open(&file, path, &err), STATUS_OK);
    assert_int_equal(photo_read(file, dn, HEIGHT, &err), STATUS_OK);
    photo_close(file);
    for (int i = 0; i < 3 * PIXELS; i++)
        dn[i] = curve->dn[i % 3][(unsigned char)dn[i]];
    assert_int_equal(coding_read(coding, path, &noise, &err), STATUS_OK);
    assert_int_equal(coding->across, WIDTH / BLOCK_SIDE);
    assert_int_equal(coding->down, HEIGHT / BLOCK_SIDE);
}

static float dn[FRAMES][3 * PIXELS], value[3 * PIXELS], variance[3 * PIXELS];
static float chi2[3 * PIXELS], freedom[3 * PIXELS];

static void merge(const struct sensor *sensor, const struct curve *curve,
                  const struct coding *coding)
{
    struct merge_row row = {0};
    static struct code_steps steps;
    blocks_steps(&steps, curve);
    assert_int_equal(merge_row_make(&row, sensor, WIDTH, NULL, 0, NULL), STATUS_OK);
    for (int y = 0; y < HEIGHT; y++) {
        size_t at = (size_t)y * COUNT;
        const float *frames[FRAMES], *kept[FRAMES], *lost[FRAMES];
        for (int f = 0; f < FRAMES; f++) {
            size_t first = 3 * (size_t)(y / BLOCK_SIDE) * (size_t)coding[f].across;
            frames[f] = dn[f] + at;
            kept[f] = coding[f].kept + first;
            lost[f] = coding[f].lost + first;
        }
        const struct encoded_row encoded = {&row, frames, times, kept, lost, &steps, FRAMES};
        merge_row(value + at, variance + at, &row, frames, times, FRAMES);
        blocks_disagreement(chi2 + at, freedom + at, variance + at, value + at, &encoded);
    }
    blocks_apply(variance, value, chi2, freedom, &row, true, HEIGHT);
    merge_row_free(&row);
}

static void test_stated_variances_are_the_errors(void **state)
{
    const struct row *r = *state;
    struct coding coding[FRAMES] = {{0}};
    struct curve curve;
    uint64_t seed = 11;
    const struct sensor sensor = sensor_of(r);
    response_known(&curve, RESPONSE_SRGB);
    for (int f = 0; f < FRAMES; f++)
        shoot(dn[f], &coding[f], r, f, &sensor, &curve, &seed);
    merge(&sensor, &curve, coding);
    for (int c = 0; c < 3; c++) {
        double one = 0, two = 0, all = 0, square = 0;
        for (int i = c; i < 3 * PIXELS; i += 3) {
            double due = (double)truth[i] * 2.5 / times[FRAMES - 1];
            if (!isfinite(variance[i]) || (double)truth[i] < 0.02)
                continue;
            double z = fabs((double)value[i] - due) / sqrt((double)variance[i]);
            one += z < 1;
            two += z < 2;
            square += fmin(z * z, 25);
            all++;
        }
        print_message("%s, %c: %.3f within 1 sigma, %.3f within 2, rms %.2f\n", r->name, "RGB"[c],
                      one / all, two / all, sqrt(square / all));
        assert_true(all > 0.9 * PIXELS);
        assert_near(one / all, 0.70, 0.08);
        assert_near(two / all, 0.955, 0.03);
    }
    for (int f = 0; f < FRAMES; f++)
        coding_free(&coding[f]);
}

static void test_other_files_lose_nothing(void **state)
{
    (void)state;
    struct coding coding = {0};
    static const struct code_noise noise;
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("P6 1 1 255 abc", file);
    fclose(file);
    assert_int_equal(coding_read(&coding, path, &noise, NULL), STATUS_OK);
    assert_null(coding.kept);
}

static void test_a_broken_file_is_told(void **state)
{
    (void)state;
    struct coding coding = {0};
    static const struct code_noise noise;
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("\xFF\xD8 and no more", file);
    fclose(file);
    assert_int_equal(coding_read(&coding, path, &noise, NULL), STATUS_FORMAT);
    assert_null(coding.kept);
}

static int make_all(void **state)
{
    (void)state;
    make_truth();
    int file = mkstemp(path);
    return file < 0 ? -1 : close(file);
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 2];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_stated_variances_are_the_errors, NULL,
                                       NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_other_files_lose_nothing);
    tests[ROWS + 1] = (struct CMUnitTest)cmocka_unit_test(test_a_broken_file_is_told);
    return cmocka_run_group_tests(tests, make_all, remove_file);
}
