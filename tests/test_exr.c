/* Radiance maps: what is written reads back to the last bit, and nothing else passes for one. */
#include "exr.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 37, HEIGHT = 19, COUNT = WIDTH * HEIGHT * 3 };

static char folder[] = "/tmp/test_exr_XXXXXX";

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    return rmdir(folder);
}

/* Values that only exact storage keeps: tiny, huge, negative, infinite. */
static struct radiance make_map(void)
{
    struct radiance map = {.width = WIDTH, .height = HEIGHT, .channels = 3};
    map.value = malloc(COUNT * sizeof *map.value);
    map.variance = malloc(COUNT * sizeof *map.variance);
    assert_non_null(map.value);
    assert_non_null(map.variance);
    for (int i = 0; i < COUNT; i++) {
        map.value[i] = (float)(sin(i) * pow(10, i % 60 - 30));
        map.variance[i] = i % 7 ? (float)(1.0 / (i + 1)) : INFINITY;
    }
    return map;
}

static void test_round_trip_is_exact(void **state)
{
    (void)state;
    struct radiance map = make_map(), back = {0};
    struct error err = {0};
    char *path = cap_path(folder, "map.exr");
    assert_int_equal(cap_radiance_write(&map, path, &err), STATUS_OK);
    assert_int_equal(cap_radiance_read(&back, path, &err), STATUS_OK);
    assert_int_equal(back.width, WIDTH);
    assert_int_equal(back.height, HEIGHT);
    assert_memory_equal(map.value, back.value, COUNT * sizeof(float));
    assert_memory_equal(map.variance, back.variance, COUNT * sizeof(float));
    remove(path);
    free(path);
    cap_radiance_free(&map);
    cap_radiance_free(&back);
}

/* Of several blocks of 2 MB. */
static struct radiance make_large_map(float phase)
{
    struct radiance map = {.width = 701, .height = 331, .channels = 3};
    size_t count = 3 * (size_t)map.width * (size_t)map.height;
    map.value = malloc(count * sizeof *map.value);
    map.variance = malloc(count * sizeof *map.variance);
    assert_non_null(map.value);
    assert_non_null(map.variance);
    for (size_t i = 0; i < count; i++) {
        map.value[i] = sinf((float)i + phase);
        map.variance[i] = 1 / ((float)i + 1 + phase);
    }
    return map;
}

static void assert_same_rows(const struct radiance *a, const struct radiance *b)
{
    size_t bytes = 3 * (size_t)a->width * (size_t)a->height * sizeof(float);
    assert_int_equal(b->width, a->width);
    assert_int_equal(b->height, a->height);
    assert_memory_equal(a->value, b->value, bytes);
    assert_memory_equal(a->variance, b->variance, bytes);
}

/* Rows come from several threads, in any order. */
static void test_rows_find_their_places(void **state)
{
    (void)state;
    struct radiance map = make_large_map(0), back = {0};
    const struct exr_header header = {.width = map.width, .height = map.height, .channels = 3};
    char *path = cap_path(folder, "rows.exr");
    struct exr_writer *writer = NULL;
    assert_int_equal(exr_begin(&writer, path, &header, NULL), STATUS_OK);
    int failed = 0;
#pragma omp parallel for num_threads(3) schedule(dynamic) reduction(+ : failed)
    for (int k = 0; k < map.height; k++) {
        int y = k * 97 % map.height;  // 97 and 331 are primes: each row once
        size_t at = 3 * (size_t)y * (size_t)map.width;
        failed += exr_put(writer, y, map.value + at, map.variance + at, NULL) != STATUS_OK;
    }
    assert_int_equal(failed, 0);
    assert_int_equal(exr_end(writer, true, NULL), STATUS_OK);
    assert_int_equal(cap_radiance_read(&back, path, NULL), STATUS_OK);
    assert_same_rows(&map, &back);
    remove(path);
    free(path);
    cap_radiance_free(&map);
    cap_radiance_free(&back);
}

/* What a map is loaded into may have held another one. */
static void test_loaded_one_after_the_other(void **state)
{
    (void)state;
    char *path = cap_path(folder, "loaded.exr");
    for (int k = 0; k < 3; k++) {
        struct radiance map = make_large_map((float)k), back = {0};
        const int low[2] = {-3, -3}, end[2] = {map.width + 3, map.height + 3};
        assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
        assert_int_equal(cap_radiance_open(&back, path, NULL), STATUS_OK);
        assert_null(back.value);
        assert_int_equal(cap_radiance_load(&back, low, end, NULL), STATUS_OK);
        assert_same_rows(&map, &back);
        cap_radiance_free(&map);
        cap_radiance_free(&back);
    }
    cap_radiance_forget();
    remove(path);
    free(path);
}

/* How many photosites share their colour, the file tells; of one that does not, each has its own.
 */
static void test_chroma(void **state)
{
    (void)state;
    struct radiance map = make_map(), back = {0};
    char *path = cap_path(folder, "map.exr");
    for (int n = 0; n <= 2; n += 2) {
        map.chroma[0] = map.chroma[1] = n;
        assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
        assert_int_equal(cap_radiance_read(&back, path, NULL), STATUS_OK);
        assert_int_equal(back.chroma[0], n);
        cap_radiance_free(&back);
        assert_int_equal(cap_radiance_open(&back, path, NULL), STATUS_OK);
        assert_int_equal(back.chroma[1], n);
        cap_radiance_free(&back);
    }
    remove(path);
    free(path);
    cap_radiance_free(&map);
}

/* A mosaic keeps one value a photosite; spread out, the others are no measurements. */
static void test_mosaic(void **state)
{
    (void)state;
    struct radiance map = make_map(), stored = {0}, spread = {0};
    struct error err = {0};
    char *path = cap_path(folder, "mosaic.exr");
    map.channels = 1;
    strcpy(map.cfa, "RGGB");
    for (int i = 0; i < WIDTH * HEIGHT; i++) {  // every channel is of one colour
        map.value[i] = (float)(1 + cap_radiance_channel(&map, i % WIDTH, i / WIDTH));
        map.variance[i] = 0.25f;
    }
    assert_int_equal(cap_radiance_write(&map, path, &err), STATUS_OK);
    assert_int_equal(cap_radiance_read_stored(&stored, path, &err), STATUS_OK);
    assert_int_equal(stored.channels, 1);
    assert_string_equal(stored.cfa, "RGGB");
    assert_memory_equal(map.value, stored.value, WIDTH * HEIGHT * sizeof(float));
    assert_int_equal(cap_radiance_read(&spread, path, &err), STATUS_OK);
    assert_int_equal(spread.channels, 3);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        int own = cap_radiance_channel(&spread, i % WIDTH, i / WIDTH);
        for (int c = 0; c < 3; c++) {
            assert_near(spread.value[3 * i + c], 1 + c, 1e-6);
            assert_true(c == own ? spread.variance[3 * i + c] == 0.25f
                                 : isinf(spread.variance[3 * i + c]));
        }
    }
    remove(path);
    free(path);
    cap_radiance_free(&map);
    cap_radiance_free(&stored);
    cap_radiance_free(&spread);
}

// What a map in its file tells of each photosite is what the map in memory holds.
static void expect_same(const char *path, bool mapped)
{
    struct radiance whole = {0}, map = {0};
    assert_int_equal(cap_radiance_read(&whole, path, NULL), STATUS_OK);
    assert_int_equal(cap_radiance_open(&map, path, NULL), STATUS_OK);
    assert_int_equal(map.file != NULL, mapped);
    assert_int_equal(map.width, whole.width);
    assert_int_equal(map.height, whole.height);
    assert_string_equal(map.cfa, whole.cfa);
    for (int y = 0; y < map.height; y++) {
        float row[2][3 * WIDTH], one[2][3];
        const size_t at = 3 * (size_t)(y * WIDTH);
        cap_radiance_row(&map, y, 2, WIDTH, row[0], row[1]);
        assert_memory_equal(row[0], whole.value + at + 6, (3 * WIDTH - 6) * sizeof(float));
        assert_memory_equal(row[1], whole.variance + at + 6, (3 * WIDTH - 6) * sizeof(float));
        for (int x = 0; x < map.width; x++) {
            cap_radiance_at(&map, x, y, one[0], one[1]);
            assert_memory_equal(one[0], whole.value + at + 3 * x, sizeof one[0]);
            assert_memory_equal(one[1], whole.variance + at + 3 * x, sizeof one[1]);
        }
    }
    cap_radiance_free(&map);
    const int low[2] = {-3, 4}, end[2] = {20, HEIGHT + 1};
    assert_int_equal(cap_radiance_open(&map, path, NULL), STATUS_OK);
    assert_int_equal(cap_radiance_load(&map, low, end, NULL), STATUS_OK);
    for (int y = 4; y < HEIGHT; y++) {
        const size_t at = 3 * (size_t)(y * WIDTH);
        assert_memory_equal(map.value + at, whole.value + at, 60 * sizeof(float));
        assert_memory_equal(map.variance + at, whole.variance + at, 60 * sizeof(float));
    }
    cap_radiance_free(&map);
    cap_radiance_free(&whole);
}

static void test_maps_that_stay_in_their_files(void **state)
{
    (void)state;
    struct radiance map = make_map();
    char *path = cap_path(folder, "map.exr");
    assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
    expect_same(path, true);
    assert_int_equal(exr_write(&map, path, "x", NULL), STATUS_OK);  // another length of the header
    expect_same(path, true);
    map.channels = 1;
    strcpy(map.cfa, "GRBG");
    assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
    expect_same(path, true);
    FILE *file = fopen(path, "r+b");  // rows that change places are not where they are expected
    assert_non_null(file);
    const long rows = 8 + 2 * WIDTH * 4;
    assert_int_equal(fseek(file, -(HEIGHT * rows + HEIGHT * 8), SEEK_END), 0);
    uint64_t place[2];
    assert_int_equal(fread(place, sizeof place, 1, file), 1);
    assert_int_equal(place[1] - place[0], rows);
    assert_int_equal(fseek(file, -(long)sizeof place, SEEK_CUR), 0);
    const uint64_t swapped[2] = {place[1], place[0]};
    assert_int_equal(fwrite(swapped, sizeof swapped, 1, file), 1);
    assert_int_equal(fclose(file), 0);
    struct radiance odd = {0};
    if (cap_radiance_open(&odd, path, NULL) == STATUS_OK)
        assert_null(odd.file);
    cap_radiance_free(&odd);
    assert_int_equal(cap_radiance_open(&odd, "/proc/no_such.exr", NULL), STATUS_IO);
    remove(path);
    free(path);
    cap_radiance_free(&map);
}

static void test_inputs_tell_whether_a_map_is_up_to_date(void **state)
{
    (void)state;
    struct radiance map = make_map();
    char *path = cap_path(folder, "map.exr");
    assert_false(exr_made_from(path, "0123"));  // missing
    assert_int_equal(exr_write(&map, path, "0123", NULL), STATUS_OK);
    assert_true(exr_made_from(path, "0123"));
    assert_false(exr_made_from(path, "0124"));
    assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
    assert_false(exr_made_from(path, "0123"));  // of unknown origin
    remove(path);
    free(path);
    cap_radiance_free(&map);
}

static void expect_unreadable(const char *path, enum status expected)
{
    struct radiance map = {0};
    struct error err = {0};
    assert_int_equal(cap_radiance_read(&map, path, &err), expected);
    assert_non_null(strstr(err.text, path));
    assert_null(map.value);
}

static void test_truncated_foreign_and_missing_files_are_refused(void **state)
{
    (void)state;
    struct radiance map = make_map();
    char *path = cap_path(folder, "map.exr");
    expect_unreadable(path, STATUS_IO);
    assert_int_equal(cap_radiance_write(&map, path, NULL), STATUS_OK);
    assert_int_equal(truncate(path, COUNT * 4), 0);  // half of the values
    expect_unreadable(path, STATUS_FORMAT);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("not an image", file);
    fclose(file);
    expect_unreadable(path, STATUS_FORMAT);
    remove(path);
    free(path);
    cap_radiance_free(&map);
}

static void test_no_room_leaves_no_file(void **state)
{
    (void)state;
    struct radiance map = make_map();
    struct error err = {0};
    assert_int_equal(cap_radiance_write(&map, "/proc/no_such_folder/map.exr", &err), STATUS_IO);
    assert_non_null(strstr(err.text, "/proc/no_such_folder/map.exr"));
    cap_radiance_free(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip_is_exact),
        cmocka_unit_test(test_rows_find_their_places),
        cmocka_unit_test(test_loaded_one_after_the_other),
        cmocka_unit_test(test_chroma),
        cmocka_unit_test(test_mosaic),
        cmocka_unit_test(test_maps_that_stay_in_their_files),
        cmocka_unit_test(test_inputs_tell_whether_a_map_is_up_to_date),
        cmocka_unit_test(test_truncated_foreign_and_missing_files_are_refused),
        cmocka_unit_test(test_no_room_leaves_no_file),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
