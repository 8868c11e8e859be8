/* Which photographs without the lamp belong to which shot: told by what they show. */
#include "ambient.h"
#include "synthetic.h"

#include <unistd.h>

enum { WIDTH = 192, HEIGHT = 128, COUNT = 3 * WIDTH * HEIGHT, SHOTS = 3, FRAMES = 4 };
enum { SHEETS = 60 };

static char folder[] = "/tmp/test_ambient_XXXXXX";
static char *frame_name[FRAMES] = {"a.tif", "b.tif", "c.tif", "d.tif"};
static char *shot_name[SHOTS] = {"shot0.tif", "shot1.tif", "shot2.tif"};
static struct photo photo[SHOTS];
static int photo_of[SHOTS] = {0, 1, 2};
static struct shot shot[SHOTS];
static struct camera_kind kind = {.width = WIDTH, .height = HEIGHT};
static struct learned learned;
static bool left_out[SHOTS];
static uint64_t random_state = 5;

static const double black = 500, gain = 2, read_noise = 4;

/* Sheets of paper of many albedos, lying about differently in each view; moved to the right by so
 * many pixels. */
static double albedo(int view, double x, double y)
{
    uint64_t state = 100 + (uint64_t)view;
    double found = 0.2;
    for (int k = 0; k < SHEETS; k++) {
        double left = 1.2 * WIDTH * random_uniform(&state) - 0.1 * WIDTH;
        double top = HEIGHT * random_uniform(&state), side = 8 + 16 * random_uniform(&state);
        double own = random_uniform(&state);
        if (x >= left && x < left + side && y >= top && y < top + side)
            found = 0.04 + 0.8 * own * own;
    }
    return found;
}

/* The lamp lights one side more than the other; the room is even. */
static void write_view(const char *name, int view, double moved, double room, double lamp)
{
    static uint16_t rgb[COUNT];
    struct tiff_form form = {16, 3, COMPRESSION_NONE, 0, false, 0.25};
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double light = room + lamp * (0.3 + 0.7 * x / WIDTH);
            double dn = light * albedo(view, x - moved, y);
            for (int c = 0; c < 3; c++) {
                double sigma = sqrt(read_noise * read_noise + dn / gain);
                rgb[3 * (y * WIDTH + x) + c] =
                    (uint16_t)rint(black + dn + sigma * random_normal(&random_state));
            }
        }
    char *path = cap_path(folder, name);
    write_tiff(path, rgb, WIDTH, HEIGHT, &form);
    free(path);
}

static struct capture make_capture(int frames)
{
    for (int s = 0; s < SHOTS; s++) {
        photo[s] = (struct photo){.name = shot_name[s], .exposure_time = 0.25};
        shot[s] = (struct shot){.name = shot_name[s], .photo = &photo_of[s], .photos = 1};
    }
    for (int c = 0; c < 3; c++) {
        learned.sensor.black[c] = black;
        learned.sensor.white[c] = learned.sensor.usable[c] = 16000;
        learned.sensor.gain[c] = gain;
        learned.sensor.read_noise[c] = read_noise;
    }
    return (struct capture){.folder = folder,
                            .photo = photo,
                            .photos = SHOTS,
                            .shot = shot,
                            .shots = SHOTS,
                            .camera = &kind,
                            .cameras = 1,
                            .ambient_frames = {frame_name, frames}};
}

/* "ab a -": the frames of each shot. */
static void assert_choice(int frames, const char *expected, int warnings)
{
    char told[64] = "", *end = told;
    struct capture capture = make_capture(frames);
    struct ambients *ambients = NULL;
    struct run run;
    cap_run_begin(&run, 2, true);
    assert_int_equal(ambients_find(&ambients, &capture, &learned, left_out, &run, NULL), STATUS_OK);
    for (int s = 0; s < SHOTS; s++) {
        const struct frame_names names = ambients_of(ambients, s);
        for (int k = 0; k < names.count; k++)
            *end++ = *names.name[k];
        *end++ = names.count > 0 ? ' ' : '-';
    }
    assert_string_equal(told, expected);
    assert_int_equal(run.warnings, warnings);
    ambients_free(ambients);
    cap_run_end(&run);
}

static void write_shots(bool moving)
{
    for (int s = 0; s < SHOTS; s++)
        write_view(shot_name[s], moving ? s : 0, 0, 400, 8000);
}

static void test_a_moving_camera(void **state)
{
    (void)state;
    write_shots(true);
    for (int k = 0; k < FRAMES; k++)  // names go the other way; the last view has two
        write_view(frame_name[k], k < 2 ? 2 : 3 - k, 0, 400, 0);
    assert_choice(FRAMES, "d c ab ", 0);
}

static void test_a_camera_that_stands_still(void **state)
{
    (void)state;
    write_shots(false);
    write_view(frame_name[0], 0, 0, 400, 0);
    write_view(frame_name[1], 0, 0, 400, 0);
    assert_choice(1, "a a a ", 0);
    assert_choice(2, "ab ab ab ", 0);
}

static void test_views_that_no_frame_shows(void **state)
{
    (void)state;
    write_shots(true);
    write_view(frame_name[0], 1, 0, 400, 0);
    assert_choice(1, "-a -", 1);
    write_view(frame_name[0], 1, 4, 400, 0);  // the camera was moved by 2 % of the picture
    assert_choice(1, "---", 1);
}

static void test_a_dark_room(void **state)
{
    (void)state;
    write_shots(true);
    write_view(frame_name[0], 1, 0, 0, 0);
    write_view(frame_name[1], 2, 0, 0, 0);
    assert_choice(2, "ab ab ab ", 0);
    write_view(frame_name[0], 1, 0, 400, 0);  // the other shows nothing
    assert_choice(2, "b a b ", 0);
}

/* What is taken off a shot is its own view's. */
static void test_light_comes_and_goes(void **state)
{
    (void)state;
    struct capture capture = make_capture(2);
    struct ambients *ambients = NULL;
    struct run run;
    cap_run_begin(&run, 1, true);
    write_shots(true);
    write_view(frame_name[0], 0, 0, 400, 0);
    write_view(frame_name[1], 1, 0, 800, 0);
    assert_int_equal(ambients_find(&ambients, &capture, &learned, left_out, &run, NULL), STATUS_OK);
    for (int k = 0; k < 4; k++) {
        int s = k % 2, x = 100, y = 50;
        double sum = 0;
        assert_int_equal(ambients_begin(ambients, s, NULL), STATUS_OK);
        const struct ambient_light *light = ambients_light(ambients, s);
        assert_non_null(light);
        for (int c = 0; c < 3; c++)
            sum += (double)light->stack.mean[3 * (y * WIDTH + x) + c] / 3;
        double dn = (s == 0 ? 400 : 800) * albedo(s, x, y);
        assert_near(sum, black + dn, 5 * sqrt((read_noise * read_noise + dn / gain) / 3));
        ambients_done(ambients, s);
        assert_null(ambients_light(ambients, 1 - s));  // only the last one stays in memory
    }
    assert_int_equal(ambients_begin(ambients, 2, NULL), STATUS_OK);  // has none
    assert_null(ambients_light(ambients, 2));
    ambients_done(ambients, 2);
    ambients_free(ambients);
    cap_run_end(&run);
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    for (int k = 0; k < FRAMES + SHOTS; k++) {
        char *path = cap_path(folder, k < FRAMES ? frame_name[k] : shot_name[k - FRAMES]);
        remove(path);
        free(path);
    }
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_moving_camera),
        cmocka_unit_test(test_a_camera_that_stands_still),
        cmocka_unit_test(test_views_that_no_frame_shows),
        cmocka_unit_test(test_a_dark_room),
        cmocka_unit_test(test_light_comes_and_goes),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
