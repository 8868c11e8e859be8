/* Dark and ambient frames: taken off for what they are worth, with their noise. */
#include "ambient.h"
#include "frames.h"
#include "synthetic.h"

#include <unistd.h>

enum { WIDTH = 64, HEIGHT = 48, LINE = 3 * WIDTH, COUNT = LINE * HEIGHT, DARKS = 16 };

static char folder[] = "/tmp/test_frames_XXXXXX";
static char *name[DARKS];
static uint64_t random_state = 9;

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    for (int k = 0; k < DARKS; k++)
        if (asprintf(&name[k], "frame%02d.tif", k) < 0)
            return -1;
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    for (int k = 0; k < DARKS; k++) {
        char *path = cap_path(folder, name[k]);
        remove(path);
        free(path);
        free(name[k]);
    }
    return rmdir(folder);
}

/* DN of a photosite: level[i] and normal noise of sigma. */
static void write_frames(const double *level, double sigma)
{
    static uint16_t rgb[COUNT];
    struct tiff_form form = {16, 3, COMPRESSION_NONE, 0, false, 0.25};
    for (int k = 0; k < DARKS; k++) {
        char *path = cap_path(folder, name[k]);
        for (int i = 0; i < COUNT; i++)
            rgb[i] = (uint16_t)rint(level[i] + sigma * random_normal(&random_state));
        write_tiff(path, rgb, WIDTH, HEIGHT, &form);
        free(path);
    }
}

static struct learned learned_chip(double read_noise)
{
    struct learned learned = {0};
    for (int c = 0; c < 3; c++) {
        learned.sensor.black[c] = 500;
        learned.sensor.white[c] = learned.sensor.usable[c] = 16000;
        learned.sensor.gain[c] = 2;
        learned.sensor.read_noise[c] = read_noise;
    }
    return learned;
}

static struct capture some_capture(struct camera_kind *kind)
{
    *kind = (struct camera_kind){.width = WIDTH, .height = HEIGHT};
    return (struct capture){.folder = folder, .camera = kind, .cameras = 1};
}

/* Rms error of a row's black against the truth, all rows. */
static double black_error(const struct frames *frames, const struct learned *learned,
                          const double *level, double *stated)
{
    static float room[6 * LINE];
    double sum = 0, stated2 = 0;
    struct merge_row made = {0};
    assert_int_equal(frames_room(LINE), 6 * LINE);
    assert_int_equal(merge_row_make(&made, &learned->sensor, WIDTH, NULL, 0, NULL), STATUS_OK);
    for (int y = 0; y < HEIGHT; y++) {
        struct merge_row row = made;
        frames_row(frames, &row, y, room);
        for (int i = 0; i < LINE; i++) {
            sum += pow((double)row.black[i] - level[y * LINE + i], 2) / COUNT;
            stated2 += (double)(row.read2[i] - made.read2[i]) / COUNT;
        }
    }
    merge_row_free(&made);
    *stated = sqrt(fmax(stated2, 0));
    return sqrt(sum);
}

static void test_a_dark_pattern(void **state)
{
    (void)state;
    static double level[COUNT];
    const double read = 4, pattern = 3;
    struct camera_kind kind;
    struct capture capture = some_capture(&kind);
    struct learned learned = learned_chip(read);
    struct frames frames;
    struct error err = {0};
    double stated;
    for (int i = 0; i < COUNT; i++)
        level[i] = 500 + pattern * random_normal(&random_state);
    level[1000] = 3000;  // hot
    write_frames(level, read);
    capture.dark_frames = (struct frame_names){name, DARKS};
    assert_int_equal(frames_make(&frames, &capture, &learned, 0, &err), STATUS_OK);
    level[1000] = 500;  // it does not count
    double error = black_error(&frames, &learned, level, &stated);
    // 16 frames: 1 DN of noise beside 3 DN of pattern leave 3 / sqrt(10) = 0.95 DN.
    double left = pattern * (read / 4) / hypot(pattern, read / 4);
    assert_near(stated, left, 0.05 * left);
    float variance[LINE] = {0};
    struct merge_row row = {0};
    assert_int_equal(merge_row_make(&row, &learned.sensor, WIDTH, NULL, 0, NULL), STATUS_OK);
    frames_finish(&frames, &row, 1000 / LINE, variance);
    for (int i = 0; i < LINE; i++)
        assert_int_equal(isinf(variance[i]), i == 1000 % LINE);
    merge_row_free(&row);
    frames_free(&frames);
    assert_true(error < hypot(1.05 * left, 2500 / sqrt(COUNT)));
}

static void test_noisy_dark_frames_do_no_harm(void **state)
{
    (void)state;
    static double level[COUNT];
    struct camera_kind kind;
    struct capture capture = some_capture(&kind);
    struct learned learned = learned_chip(4);
    struct frames frames;
    double stated;
    for (int i = 0; i < COUNT; i++)
        level[i] = 500;  // no pattern at all
    write_frames(level, 4);
    capture.dark_frames = (struct frame_names){name, 1};
    assert_int_equal(frames_make(&frames, &capture, &learned, 0, NULL), STATUS_OK);
    // One frame has 4 DN of noise; what passes for a pattern is the scatter of its variance.
    assert_true(black_error(&frames, &learned, level, &stated) < 0.6);
    frames_free(&frames);
}

static void test_ambient_light_goes(void **state)
{
    (void)state;
    static double level[COUNT];
    struct camera_kind kind;
    struct capture capture = some_capture(&kind);
    struct learned learned = learned_chip(4);
    struct ambient_light light = {0};
    for (int i = 0; i < COUNT; i++)
        level[i] = 500 + 800;  // in 0.25 s
    write_frames(level, 5);
    const struct frame_names names = {name, DARKS};
    assert_int_equal(ambient_light_read(&light, &capture, &names, 0, &learned, NULL), STATUS_OK);
    float value[LINE], variance[LINE];
    struct merge_row row = {0};
    assert_int_equal(merge_row_make(&row, &learned.sensor, WIDTH, NULL, 0, NULL), STATUS_OK);
    for (int i = 0; i < LINE; i++) {
        value[i] = 1;
        variance[i] = 0;
    }
    ambient_take(&light, &row, 3, value, variance);
    double full = 15500, rate = 800 / 0.25 / full, mean = 0;
    for (int i = 0; i < LINE; i++)
        mean += (double)value[i] / LINE;
    // Of a frame: read noise 4 DN and 800 DN at 2 electrons each; 16 frames.
    double sigma = sqrt((16 + 800 / 2.0) / DARKS) / 0.25 / full;
    assert_near(sqrt((double)variance[0]), sigma, 0.01 * sigma);
    assert_near(mean, 1 - rate, 5 * sigma / sqrt(LINE));
    merge_row_free(&row);
    ambient_light_free(&light);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_dark_pattern),
        cmocka_unit_test(test_noisy_dark_frames_do_no_harm),
        cmocka_unit_test(test_ambient_light_goes),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
