/* Photographs become shots: order of names, and where one shot ends and the next begins. */
#include "near.h"
#include "shots.h"

#include <stdlib.h>
#include <string.h>

static void test_digits_compare_as_numbers(void **state)
{
    (void)state;
    static const char *const ordered[] = {
        "IMG_1.tif",   "IMG_2.tif", "IMG_10.tif", "IMG_10a.tif", "IMG_010b.tif",
        "IMG_100.tif", "a",         "a1",         "a01",         "b"};
    enum { N = sizeof ordered / sizeof *ordered };
    for (int i = 0; i < N; i++)
        for (int k = 0; k < N; k++) {
            int order = natural_order(ordered[i], ordered[k]);
            if (strcmp(ordered[i], "a1") == 0 && strcmp(ordered[k], "a01") == 0)
                assert_int_not_equal(order, 0);  // same number, other name: some fixed order
            else if (strcmp(ordered[i], "a01") == 0 && strcmp(ordered[k], "a1") == 0)
                assert_int_not_equal(order, 0);
            else
                assert_int_equal((order > 0) - (order < 0), (i > k) - (i < k));
        }
}

/* A capture of photographs p0.tif, p1.tif, ... with these times; all else the same. */
static struct capture make_capture(const double *time, int count)
{
    struct capture capture = {.folder = strdup("folder"), .photos = count};
    capture.photo = calloc((size_t)count, sizeof *capture.photo);
    assert_non_null(capture.photo);
    for (int i = 0; i < count; i++) {
        capture.photo[i] = (struct photo){
            .width = 6, .height = 4, .channels = 3, .bits = 16, .iso = 100, .light = 0, .shot = -1};
        capture.photo[i].exposure_time = time[i];
        assert_true(asprintf(&capture.photo[i].name, "p%d.tif", i) > 0);
    }
    return capture;
}

static struct capture_yaml_root no_shots;
static const struct capture_yaml plain = {.root = &no_shots};

/* The expected shot of each photograph, as digits. */
static void expect_shots(struct capture *capture, const struct capture_yaml *yaml,
                         const char *expected)
{
    struct error err = {0};
    assert_int_equal(shots_group(capture, yaml, &err), STATUS_OK);
    for (int i = 0; i < capture->photos; i++)
        assert_int_equal('0' + capture->photo[i].shot, expected[i]);
    cap_capture_free(capture);
}

static void test_a_repeated_time_begins_a_shot(void **state)
{
    (void)state;
    struct capture capture = make_capture((const double[]){1, 4, 16, 1, 4, 16, 16, 4}, 8);
    expect_shots(&capture, &plain, "00011122");
    // EXIF's 1/30 is 0.0333 in one file and 10/300 in another: the same within a percent.
    capture = make_capture((const double[]){1.0 / 30, 1.0 / 15, 0.0333}, 3);
    expect_shots(&capture, &plain, "001");
}

static void test_an_unreadable_photograph_keeps_its_turn(void **state)
{
    (void)state;
    // (1) 4 16 | 1 4 16 | 1 4 16 : without its turn, the second shot's 1 would join the first
    struct capture capture = make_capture((const double[]){4, 16, 1, 4, 16, 1, 4, 16}, 8);
    capture.photo[0].missing = 1;
    expect_shots(&capture, &plain, "00111222");
    // 1 4 16 | (1 4) 16 | 1 4 16
    capture = make_capture((const double[]){1, 4, 16, 16, 1, 4, 16}, 7);
    capture.photo[3].missing = 2;
    expect_shots(&capture, &plain, "0001222");
    // 1 4 (16 | 1) 4 16 | 1 4 16
    capture = make_capture((const double[]){1, 4, 4, 16, 1, 4, 16}, 7);
    capture.photo[2].missing = 2;
    expect_shots(&capture, &plain, "0011222");
}

static void test_other_settings_begin_a_shot(void **state)
{
    (void)state;
    const double time[] = {1, 2, 3, 4, 5};
    struct capture capture = make_capture(time, 5);
    capture.photo[2].iso = 200;
    expect_shots(&capture, &plain, "00122");
    capture = make_capture(time, 5);
    capture.photo[3].light = capture.photo[4].light = 1;
    expect_shots(&capture, &plain, "00011");
    capture = make_capture(time, 5);
    capture.photo[4].width = 8;
    expect_shots(&capture, &plain, "00001");
    capture = make_capture(time, 5);
    capture.photo[0].aperture = 8;
    expect_shots(&capture, &plain, "01111");
}

static void test_shots_and_cameras_have_names(void **state)
{
    (void)state;
    struct capture capture = make_capture((const double[]){1, 2, 1, 2, 1, 2}, 6);
    for (int i = 2; i < 4; i++)
        strcpy(capture.photo[i].model, "another camera");
    assert_int_equal(shots_group(&capture, &plain, NULL), STATUS_OK);
    assert_int_equal(capture.shots, 3);
    assert_string_equal(capture.shot[1].name, "p2");
    assert_int_equal(capture.cameras, 2);
    assert_int_equal(capture.shot[0].camera, 0);
    assert_int_equal(capture.shot[1].camera, 1);
    assert_int_equal(capture.shot[2].camera, 0);
    cap_capture_free(&capture);
}

static void test_named_shots_come_first(void **state)
{
    (void)state;
    char *globs[] = {"p1.tif", "p3*"};
    struct yaml_shot given = {"mine", globs, 2};
    struct capture_yaml_root root = {.shot = &given, .shots = 1};
    struct capture_yaml yaml = {.root = &root};
    struct capture capture = make_capture((const double[]){1, 2, 4, 2}, 4);
    expect_shots(&capture, &yaml, "1020");
}

static void test_no_time_names_the_photograph(void **state)
{
    (void)state;
    struct error err = {0};
    struct capture capture = make_capture((const double[]){1, 0}, 2);
    assert_int_equal(shots_group(&capture, &plain, &err), STATUS_DATA);
    assert_non_null(strstr(err.text, "p1.tif"));
    assert_non_null(strstr(err.text, "overrides"));
    cap_capture_free(&capture);
}

/* Two lamps, one flash each at every exposure time: a b a b. */
static void test_lamps_that_take_turns(void **state)
{
    (void)state;
    struct capture capture =
        make_capture((const double[]){1, 1, 4, 4, 16, 16, 1, 1, 4, 4, 16, 16}, 12);
    for (int i = 0; i < 12; i++)
        capture.photo[i].light = i % 2;
    expect_shots(&capture, &plain, "010101232323");
    // Single photographs under lamps in turn are no brackets: the same time every time.
    capture = make_capture((const double[]){1, 1, 1, 1}, 4);
    for (int i = 0; i < 4; i++)
        capture.photo[i].light = i % 2;
    expect_shots(&capture, &plain, "0123");
    // One bracket is not complete: nothing is made up.
    capture = make_capture((const double[]){1, 1, 4, 4, 16}, 5);
    for (int i = 0; i < 5; i++)
        capture.photo[i].light = i % 2;
    expect_shots(&capture, &plain, "01234");
}

/* An exposure too many, then one too few, the first of its bracket: no shot is of two views. */
static void test_brackets_behind_a_mishap_stay_whole(void **state)
{
    (void)state;
    const double times[] = {1, 4, 16, 1, 4, 4, 16, 1, 4, 16, 4, 16, 1, 4, 16, 1, 4, 16};
    struct capture capture = make_capture(times, sizeof times / sizeof *times);
    expect_shots(&capture, &plain, "000111122233444555");
    // Up and down is an order of its own.
    capture = make_capture((const double[]){1, 4, 16, 16, 4, 1, 1, 4, 16}, 9);
    expect_shots(&capture, &plain, "000111222");
}

static void test_missing_exposures_and_clocks_are_warned_of(void **state)
{
    (void)state;
    struct capture capture = make_capture((const double[]){1, 4, 16, 1, 4, 16, 1, 16}, 8);
    struct error err = {0};
    struct run run;
    for (int i = 0; i < 8; i++)
        snprintf(capture.photo[i].taken, sizeof capture.photo[i].taken, "2026:11:22 10:00:%02d",
                 i == 4 ? 0 : 10 + i);
    assert_int_equal(shots_group(&capture, &plain, &err), STATUS_OK);
    assert_int_equal(capture.shots, 3);
    assert_string_equal(capture.shot[1].why, "an exposure time repeats");
    cap_run_begin(&run, 1, true);
    shots_warn(&capture, &run);
    assert_int_equal(run.warnings, 2);
    assert_non_null(strstr(run.warning[0], "shot p6 has 2 photographs where most have 3"));
    assert_non_null(strstr(run.warning[1], "1 photographs were taken before"));
    cap_run_end(&run);
    cap_capture_free(&capture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_digits_compare_as_numbers),
        cmocka_unit_test(test_a_repeated_time_begins_a_shot),
        cmocka_unit_test(test_an_unreadable_photograph_keeps_its_turn),
        cmocka_unit_test(test_lamps_that_take_turns),
        cmocka_unit_test(test_brackets_behind_a_mishap_stay_whole),
        cmocka_unit_test(test_missing_exposures_and_clocks_are_warned_of),
        cmocka_unit_test(test_other_settings_begin_a_shot),
        cmocka_unit_test(test_shots_and_cameras_have_names),
        cmocka_unit_test(test_named_shots_come_first),
        cmocka_unit_test(test_no_time_names_the_photograph),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
