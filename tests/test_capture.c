/* A whole capture, from photographs to radiance maps: what is damaged is left out and named, and
 * the maps do not depend on the number of threads. */
#include "capture.h"
#include "synthetic.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

enum { WIDTH = 96, HEIGHT = 64, COUNT = 3 * WIDTH * HEIGHT, SHOTS = 2, FRAMES = 3 };

static const struct chip chip = {128, 12.6, 5, 48000, 4095};
static char folder[32], out[64];
static struct run run;

static const char yaml[] = "goniocam: 1\nlights:\n- {name: a, photos: \"s0_*\"}\n"
                           "- {name: b, photos: [\"s1_*\"]}\nphotos: {pattern: \"s*.tif\"}\n";

static double scene(int x, int y)  // electrons a second
{
    return 2e3 * pow(10, 3.5 * x / WIDTH) * (1 + 0.2 * (y & 8));
}

static void put_text(const char *name, const char *text)
{
    char *path = cap_path(folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
    free(path);
}

static void put_photo(const char *name, double nominal, double seconds, uint64_t seed)
{
    static uint16_t rgb[COUNT];
    struct tiff_form form = {16, 3, COMPRESSION_ADOBE_DEFLATE, 0, false, nominal};
    char *path = cap_path(folder, name);
    for (int i = 0; i < COUNT; i++)
        rgb[i] = chip_expose(&chip, scene(i / 3 % WIDTH, i / 3 / WIDTH) * seconds, &seed);
    write_tiff(path, rgb, WIDTH, HEIGHT, &form);
    free(path);
}

static int set_up(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/test_capture_XXXXXX");
    if (!mkdtemp(folder))
        return -1;
    snprintf(out, sizeof out, "%s/out", folder);
    put_text("capture.yaml", yaml);
    for (int s = 0; s < SHOTS; s++)
        for (int f = 0; f < FRAMES; f++) {
            char name[32];
            snprintf(name, sizeof name, "s%d_%d.tif", s, f);
            put_photo(name, pow(4, f) / 64, pow(4, f) / 64, (uint64_t)(10 * s + f));
        }
    cap_run_begin(&run, 1, true);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    char command[160];
    cap_run_end(&run);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

/* Read and merge; what is found wrong is in *err. */
static enum status merge(struct error *err)
{
    struct capture capture = {0};
    enum status status = cap_capture_read(&capture, folder, &run, err);
    if (!status)
        status = cap_merge(&capture, out, NULL, NULL, &run, err);
    cap_capture_free(&capture);
    return status;
}

static char *map_path(const char *shot)
{
    char *path;
    assert_true(asprintf(&path, "%s/radiance/%s.exr", out, shot) > 0);
    return path;
}

static bool has_map(const char *shot)
{
    char *path = map_path(shot);
    bool there = access(path, R_OK) == 0;
    free(path);
    return there;
}

static bool was_warned_of(const char *text)
{
    for (int i = 0; i < run.warnings; i++)
        if (strstr(run.warning[i], text))
            return true;
    return false;
}

static void truncate_photo(const char *name, long keep)
{
    char *path = cap_path(folder, name);
    assert_int_equal(truncate(path, keep), 0);
    free(path);
}

/* Is every map of the scene, within its own variance? */
static void expect_right_map(const char *shot)
{
    struct radiance map = {0};
    struct error err = {0};
    char *path = map_path(shot);
    if (cap_radiance_read(&map, path, &err))
        fail_msg("%s", err.text);
    double chi2 = 0;
    int count = 0;
    for (int i = 0; i < COUNT; i++) {
        double truth = scene(i / 3 % WIDTH, i / 3 / WIDTH) / chip.full_well;
        if (isinf(map.variance[i]))
            continue;
        double z = ((double)map.value[i] - truth) / sqrt((double)map.variance[i]);
        chi2 += z * z;
        count++;
    }
    assert_true(count > COUNT / 2);
    assert_near(chi2 / count, 1, 0.1);
    free(path);
    cap_radiance_free(&map);
}

static void test_maps_are_right(void **state)
{
    (void)state;
    struct error err = {0};
    if (merge(&err))
        fail_msg("%s", err.text);
    expect_right_map("s0_0");
    expect_right_map("s1_0");
    assert_int_equal(run.warnings, 0);
}

static void *read_bytes(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    void *bytes = malloc(*size);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static void test_threads_change_no_byte(void **state)
{
    (void)state;
    size_t size[2];
    void *bytes[2];
    char *path = map_path("s1_0");
    for (int i = 0; i < 2; i++) {
        run.threads = i == 0 ? 1 : 3;
        assert_int_equal(merge(NULL), STATUS_OK);
        bytes[i] = read_bytes(path, &size[i]);
        remove(path);
    }
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(bytes[0], bytes[1], size[0]);
    free(bytes[0]);
    free(bytes[1]);
    free(path);
}

static void test_finished_maps_are_kept(void **state)
{
    (void)state;
    struct stat first, second, changed;
    char *path = map_path("s0_0");
    assert_int_equal(merge(NULL), STATUS_OK);
    assert_int_equal(stat(path, &first), 0);
    assert_int_equal(merge(NULL), STATUS_OK);
    assert_int_equal(stat(path, &second), 0);
    assert_true(first.st_ino == second.st_ino);  // a new file would be another inode
    put_photo("s0_1.tif", 4.0 / 64, 4.0 / 64, 77);
    assert_int_equal(merge(NULL), STATUS_OK);
    assert_int_equal(stat(path, &changed), 0);
    assert_true(first.st_ino != changed.st_ino || first.st_mtim.tv_nsec != changed.st_mtim.tv_nsec);
    free(path);
}

static void test_damaged_photographs_are_left_out_and_named(void **state)
{
    (void)state;
    struct error err = {0};
    truncate_photo("s0_2.tif", 400);  // its directory is gone
    char *path = cap_path(folder, "s1_1.tif");
    FILE *file = fopen(path, "r+b");  // its directory is whole, a strip is not
    assert_non_null(file);
    fseek(file, 2000, SEEK_SET);
    for (int i = 0; i < 300; i++)
        fputc(0xA5, file);
    fclose(file);
    free(path);
    if (merge(&err))
        fail_msg("%s", err.text);
    assert_true(was_warned_of("s0_2.tif"));
    assert_true(was_warned_of("s1_1.tif"));
    expect_right_map("s0_0");
    expect_right_map("s1_0");
}

static void test_a_shot_without_readable_frames_is_left_out(void **state)
{
    (void)state;
    for (int f = 0; f < FRAMES; f++) {
        char name[16];
        snprintf(name, sizeof name, "s1_%d.tif", f);
        truncate_photo(name, 300);
    }
    assert_int_equal(merge(NULL), STATUS_OK);
    assert_true(has_map("s0_0"));
    assert_false(has_map("s1_0"));
}

static void expect_story(enum status expected, const char *story)
{
    struct error err = {0};
    assert_int_equal(merge(&err), expected);
    if (!strstr(err.text, story))
        fail_msg("'%s' lacks '%s'", err.text, story);
}

static void test_no_photographs(void **state)
{
    (void)state;
    put_text("capture.yaml", "goniocam: 1\nphotos: {pattern: \"*.tiff\"}\n");
    expect_story(STATUS_IO, "no photographs");
    for (int s = 0; s < SHOTS; s++)
        for (int f = 0; f < FRAMES; f++) {
            char name[16];
            snprintf(name, sizeof name, "s%d_%d.tif", s, f);
            truncate_photo(name, 0);
        }
    put_text("capture.yaml", "goniocam: 1\n");
    expect_story(STATUS_IO, "none of 6 photographs can be read");
}

static void test_no_exposure_time_and_its_override(void **state)
{
    (void)state;
    put_photo("s1_2.tif", 0, 16.0 / 64, 5);
    expect_story(STATUS_DATA, "s1_2.tif: no exposure time");
    char text[400];
    snprintf(text, sizeof text, "%soverrides:\n- {photos: s1_2.*, exposure_time: 0.25}\n", yaml);
    put_text("capture.yaml", text);
    // A time in EXIF alone makes it another shot; the lamp and all else are the same.
    assert_int_equal(merge(NULL), STATUS_OK);
}

static void test_lamps(void **state)
{
    (void)state;
    put_text("capture.yaml", "goniocam: 1\nlights: [{name: a, photos: \"s0_*\"}]\n");
    expect_story(STATUS_DATA, "s1_0.tif belongs to no lamp");
    put_text("capture.yaml", "goniocam: 1\nlights: [{name: a, photos: \"s*\"},"
                             " {name: b, photos: \"s1*\"}]\n");
    expect_story(STATUS_DATA, "s1_0.tif belongs to two lamps, a and b");
}

static void test_missing_calibration_frames(void **state)
{
    (void)state;
    put_text("capture.yaml", "goniocam: 1\nflat: nowhere.tif\n");
    expect_story(STATUS_IO, "no file matches `flat`");
}

static void test_output_that_is_no_folder(void **state)
{
    (void)state;
    put_text("file", "");
    snprintf(out, sizeof out, "%s/file", folder);
    expect_story(STATUS_IO, "file");
}

/* As on a full disk: no file may grow over 20 kB, and a map has 144 kB. */
static void test_a_full_disk_leaves_nothing(void **state)
{
    (void)state;
    struct rlimit before, small;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small = before;
    small.rlim_cur = 20000;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    struct error err = {0};
    enum status status = merge(&err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(status, STATUS_IO);
    assert_non_null(strstr(err.text, "cannot be written"));
    assert_false(has_map("s0_0"));
    assert_false(has_map("s1_0"));
    char *path;  // rmdir() fails if anything is left
    assert_true(asprintf(&path, "%s/radiance", out) > 0);
    assert_int_equal(rmdir(path), 0);
    free(path);
}

static void test_the_hash_knows_every_byte(void **state)
{
    (void)state;
    struct capture capture = {0};
    char first[33], second[33], third[33];
    assert_int_equal(cap_capture_read(&capture, folder, &run, NULL), STATUS_OK);
    assert_int_equal(cap_capture_hash(first, &capture, NULL), STATUS_OK);
    struct photo swap = capture.photo[0];  // another order
    capture.photo[0] = capture.photo[1];
    capture.photo[1] = swap;
    assert_int_equal(cap_capture_hash(second, &capture, NULL), STATUS_OK);
    assert_string_equal(first, second);
    put_photo("s0_0.tif", 1.0 / 64, 1.0 / 64, 4711);
    assert_int_equal(cap_capture_hash(third, &capture, NULL), STATUS_OK);
    assert_string_not_equal(first, third);
    cap_capture_free(&capture);
}

int main(void)
{
#define EACH(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        EACH(test_maps_are_right),
        EACH(test_threads_change_no_byte),
        EACH(test_finished_maps_are_kept),
        EACH(test_damaged_photographs_are_left_out_and_named),
        EACH(test_a_shot_without_readable_frames_is_left_out),
        EACH(test_no_photographs),
        EACH(test_no_exposure_time_and_its_override),
        EACH(test_lamps),
        EACH(test_missing_calibration_frames),
        EACH(test_output_that_is_no_folder),
        EACH(test_a_full_disk_leaves_nothing),
        EACH(test_the_hash_knows_every_byte),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
