/* A camera at the cable: its names for exposure times, the bracket, and what files are called. */
#include "tether.h"

#include "near.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static struct row {
    const char *name, *text;
    double seconds;
} rows[] = {
    {"a fraction", "1/125", 1.0 / 125},
    {"a fraction with its unit", "1/250s", 1.0 / 250},
    {"a number", "0.5", 0.5},
    {"a comma", "0,4", 0.4},
    {"a unit apart", "2 s", 2},
    {"the sign of seconds", "30\"", 30},
    {"bulb", "bulb", 0},
    {"auto", "Auto", 0},
    {"half a fraction", "1/", 0},
    {"no time", "1/0", 0},
    {"below 0", "-1", 0},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_name(void **state)
{
    const struct row *r = *state;
    assert_near(cap_tether_seconds(r->text), r->seconds, 1e-15);
}

/** A camera that only remembers: the names it was set to, and how many photographs it took. */
struct memory {
    const char *const *name;
    int names, photographs, fails_at;
    char set[8][16];
};

static enum status times(void *self, const char *const **name, int *count, struct error *err)
{
    const struct memory *m = self;
    (void)err;
    *name = m->name;
    *count = m->names;
    return STATUS_OK;
}

static enum status set_time(void *self, const char *name, struct error *err)
{
    struct memory *m = self;
    (void)err;
    snprintf(m->set[m->photographs], sizeof m->set[0], "%s", name);
    return STATUS_OK;
}

static enum status take(void *self, const char *path, struct error *err)
{
    struct memory *m = self;
    if (m->photographs == m->fails_at)
        return cap_fail(err, STATUS_IO, "the battery is empty");
    char *file;
    assert_true(asprintf(&file, "%s.raw", path) > 0);
    FILE *to = fopen(file, "w");
    assert_non_null(to);
    fclose(to);
    free(file);
    m->photographs++;
    return STATUS_OK;
}

static const char *const camera_times[] = {"bulb", "1/500", "1/125", "1/30", "0.5s", "2"};
static struct memory memory_of_times(int fails_at)
{
    return (struct memory){.name = camera_times, .names = 6, .fails_at = fails_at};
}

static enum status shoot(struct memory *m, const char *folder, const double *seconds, int count,
                         int *warnings, struct error *err)
{
    struct tether camera = {m, times, set_time, take};
    struct run run;
    cap_run_begin(&run, 1, true);
    enum status status = cap_tether_bracket(&camera, folder, "ball", seconds, count, &run, err);
    *warnings = run.warnings;
    cap_run_end(&run);
    return status;
}

static void folder_of_test(char folder[64])
{
    snprintf(folder, 64, "/tmp/test_tether.%ld", (long)getpid());
}

static void test_bracket(void **state)
{
    (void)state;
    const double seconds[3] = {1 / 512.0, 1 / 31.0, 2};
    struct memory m = memory_of_times(-1);
    struct error err = {0};
    char folder[64], path[100];
    int warnings;
    folder_of_test(folder);
    assert_int_equal(shoot(&m, folder, seconds, 3, &warnings, &err), STATUS_OK);
    assert_int_equal(warnings, 0);  // 2.4 and 3.3 % off are as near as cameras come
    assert_int_equal(m.photographs, 3);
    assert_string_equal(m.set[0], "1/500");
    assert_string_equal(m.set[1], "1/30");
    assert_string_equal(m.set[2], "2");
    char next[16];
    cap_tether_next_name(next, folder);
    assert_string_equal(next, "shot00");
    for (int k = 0; k < 3; k++) {
        snprintf(path, sizeof path, "%s/ball_exp%d.raw", folder, k);
        assert_int_equal(access(path, R_OK), 0);
        if (k == 0) {  // a name that is taken is passed over
            char taken[100];
            snprintf(taken, sizeof taken, "%s/shot00_exp0.raw", folder);
            assert_int_equal(rename(path, taken), 0);
            cap_tether_next_name(next, folder);
            assert_string_equal(next, "shot01");
            assert_int_equal(remove(taken), 0);
        } else {
            assert_int_equal(remove(path), 0);
        }
    }
    assert_int_equal(rmdir(folder), 0);
}

static void test_time_that_the_camera_lacks(void **state)
{
    (void)state;
    const double far[1] = {1 / 60.0}, twice[2] = {1 / 125.0, 1 / 120.0};
    struct memory m = memory_of_times(-1);
    struct error err = {0};
    char folder[64], path[100];
    int warnings;
    folder_of_test(folder);
    assert_int_equal(shoot(&m, folder, far, 1, &warnings, &err), STATUS_OK);
    assert_int_equal(warnings, 1);
    snprintf(path, sizeof path, "%s/ball_exp0.raw", folder);
    assert_int_equal(remove(path), 0);
    assert_int_equal(shoot(&m, folder, twice, 2, &warnings, &err), STATUS_DATA);
    assert_non_null(strstr(err.text, "1/125"));
    assert_int_equal(rmdir(folder), 0);
}

static void test_failure_ends_it(void **state)
{
    (void)state;
    const double seconds[2] = {1 / 500.0, 1 / 125.0};
    struct memory m = memory_of_times(0);
    struct error err = {0};
    char folder[64];
    int warnings;
    folder_of_test(folder);
    assert_int_equal(shoot(&m, folder, seconds, 2, &warnings, &err), STATUS_IO);
    assert_string_equal(err.text, "the battery is empty");
    m = (struct memory){.name = camera_times, .names = 1};  // bulb alone
    assert_int_equal(shoot(&m, folder, seconds, 2, &warnings, &err), STATUS_DATA);
    assert_int_equal(rmdir(folder), 0);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 3];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_name, NULL, NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_bracket);
    tests[ROWS + 1] = (struct CMUnitTest)cmocka_unit_test(test_time_that_the_camera_lacks);
    tests[ROWS + 2] = (struct CMUnitTest)cmocka_unit_test(test_failure_ends_it);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
