/* Long files: they hold what was written, however it came, and tell when they cannot. */
#include "long_file.h"
#include "near.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BLOCK = LONG_FILE_BLOCK };

static char folder[] = "/var/tmp/test_long_file_XXXXXX", path[64];

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(path, sizeof path, "%s/long", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    remove(path);
    return rmdir(folder);
}

static unsigned char byte_at(size_t i)
{
    return (unsigned char)(i * 2654435761u >> 13);
}

/* A row is a length, and the length of the pieces that it is written in. */
static const struct row {
    const char *name;
    size_t size, piece;
    bool past_cache;
} rows[] = {
    {"nothing", 0, 1, false},
    {"less than a block", 1000, 7, false},
    {"less than a block, past the cache", 1000, 7, true},
    {"a block", BLOCK, 4096, false},
    {"a byte more", BLOCK + 1, 1000, false},
    {"a byte more, past the cache", BLOCK + 1, 1000, true},
    {"two blocks in one piece", 2 * (size_t)BLOCK, 2 * (size_t)BLOCK, true},
    {"long, and a multiple of the disk's unit", 6 * (size_t)BLOCK, 100003, true},
    {"long, and odd", 5 * (size_t)BLOCK + 12345, 144008, true},
    {"long, through the cache", 5 * (size_t)BLOCK + 12345, 144008, false},
};
enum { ROWS = sizeof rows / sizeof *rows };

/* The begin is left out, and filled in last, as a table is. */
static bool write_row(const struct row *r, const unsigned char *data)
{
    struct long_file *file = long_file_begin(path, r->size, r->past_cache);
    assert_non_null(file);
    size_t late = r->size < 500 ? r->size : 500;
    bool written = true;
    for (size_t at = late; at < r->size; at += r->piece) {
        size_t left = r->size - at, n = left < r->piece ? left : r->piece;
        written = long_file_write(file, data + at, n, at) && written;
    }
    written = long_file_write(file, data, late, 0) && written;
    return long_file_end(file, written) && written;
}

static void test_row(void **state)
{
    const struct row *r = *state;
    unsigned char *data = malloc(r->size + 1), *back = malloc(r->size + 1);
    assert_non_null(data);
    assert_non_null(back);
    for (size_t i = 0; i < r->size; i++)
        data[i] = byte_at(i);
    assert_true(write_row(r, data));
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fread(back, 1, r->size + 1, file), r->size);
    assert_memory_equal(data, back, r->size);
    fclose(file);
    free(data);
    free(back);
}

static void test_a_gap_is_refused(void **state)
{
    (void)state;
    struct long_file *file = long_file_begin(path, 0, false);
    assert_non_null(file);
    assert_true(long_file_write(file, "x", 1, BLOCK));
    assert_false(long_file_write(file, "x", 1, BLOCK + 2));
    assert_false(long_file_write(file, "x", 1, BLOCK));  // that place has gone by
    assert_true(long_file_end(file, false));
}

static void test_a_folder_that_is_not_there(void **state)
{
    (void)state;
    assert_null(long_file_begin("/nowhere/at/all", 0, true));
    assert_int_equal(errno, ENOENT);
}

/* /dev/full takes everything and has room for nothing. */
static void test_a_full_disk_is_told(void **state)
{
    (void)state;
    unsigned char *data = calloc(1, BLOCK);
    assert_non_null(data);
    struct long_file *file = long_file_begin("/dev/full", 0, false);
    assert_non_null(file);
    bool written = true;
    for (int k = 0; k < 4 && written; k++)
        written = long_file_write(file, data, BLOCK, (uint64_t)k * BLOCK);
    written = long_file_end(file, true) && written;
    assert_false(written);
    assert_int_equal(errno, ENOSPC);
    free(data);
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 3];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_row, NULL, NULL, (void *)&rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_a_gap_is_refused);
    tests[ROWS + 1] = (struct CMUnitTest)cmocka_unit_test(test_a_folder_that_is_not_there);
    tests[ROWS + 2] = (struct CMUnitTest)cmocka_unit_test(test_a_full_disk_is_told);
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
