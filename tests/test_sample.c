/* What is read of all shots to learn from: where a board is lit in the middle of a dark photograph,
 * bands beside it tell nothing of how frames compare, and there are more of them then. */
#include "capture.h"
#include "sample.h"
#include "synthetic.h"

#include <unistd.h>

enum { WIDTH = 64, HEIGHT = 4800, COUNT = 3 * WIDTH * HEIGHT, SHOTS = 16, FRAMES = 2 };

static char folder[32];

static char *photo(int shot, int frame)
{
    char name[32];
    snprintf(name, sizeof name, "s%02d_%d.tif", shot, frame);
    return cap_path(folder, name);
}

static int set_up(void **state)
{
    (void)state;
    static uint16_t rgb[COUNT];
    strcpy(folder, "/tmp/test_sample_XXXXXX");
    if (!mkdtemp(folder))
        return -1;
    for (int k = 0; k < SHOTS * FRAMES; k++) {
        double seconds = pow(4, k % FRAMES) / 64;
        struct tiff_form form = {16, 3, COMPRESSION_NONE, 0, false, seconds};
        for (int i = 0; i < COUNT; i++) {
            int y = i / 3 / WIDTH;
            bool board = y > HEIGHT / 3 && y < HEIGHT * 2 / 3;
            rgb[i] = (uint16_t)((board ? 5e5 + 100 * (i % 7) : 0) * seconds);
        }
        rgb[0] = 65535;  // what saturates, somewhere
        char *path = photo(k / FRAMES, k % FRAMES);
        write_tiff(path, rgb, WIDTH, HEIGHT, &form);
        free(path);
    }
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    for (int k = 0; k < SHOTS * FRAMES; k++) {
        char *path = photo(k / FRAMES, k % FRAMES);
        remove(path);
        free(path);
    }
    return rmdir(folder);
}

static void test_every_shot_shows_what_is_lit(void **state)
{
    (void)state;
    struct capture capture = {0};
    struct sample_set set = {0};
    struct run run;
    struct error err = {0};
    cap_run_begin(&run, 2, true);
    assert_int_equal(cap_capture_of_photos(&capture, folder, &run, &err), STATUS_OK);
    assert_int_equal(capture.shots, SHOTS);
    double *seconds = malloc((size_t)capture.photos * sizeof *seconds);
    for (int k = 0; k < capture.photos; k++)
        seconds[k] = capture.photo[k].exposure_time;
    assert_int_equal(sample_read(&set, &capture, 0, seconds, &run, &err), STATUS_OK);
    assert_int_equal(set.samples, SHOTS);
    for (int s = 0; s < SHOTS; s++) {
        const struct bracket_sample *one = &set.channel[0][s];
        int lit = 0;
        for (size_t i = 0; i < one->photosites; i++)
            lit += one->dn[0][i] > 5000;
        assert_true(lit > 2000);
        assert_true(one->photosites < COUNT / 3);  // some of the rows
    }
    free(seconds);
    sample_free(&set);
    cap_capture_free(&capture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_shot_shows_what_is_lit)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
