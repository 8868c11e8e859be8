/* Files appear whole or not at all; folders are made with their parents. */
#include "capture.h"
#include "near.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static char folder[] = "/tmp/test_files_XXXXXX";
static char *path;

static int make_folder(void **state)
{
    (void)state;
    path = mkdtemp(folder) ? cap_path(folder, "file") : NULL;
    return path ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    remove(path);
    free(path);
    return rmdir(folder);  // fails if a file was left aside
}

static void expect_content(const char *expected)
{
    char text[100];
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    assert_string_equal(text, expected);
}

static void write_file(const char *text)
{
    struct atomic_file file;
    assert_int_equal(cap_file_begin(&file, path, true, NULL), STATUS_OK);
    fputs(text, file.stream);
    assert_int_equal(cap_file_commit(&file, NULL), STATUS_OK);
}

static void test_the_old_file_stays_until_the_new_one_is_whole(void **state)
{
    (void)state;
    struct atomic_file file;
    write_file("old");
    assert_int_equal(cap_file_begin(&file, path, true, NULL), STATUS_OK);
    fputs("new", file.stream);
    fflush(file.stream);
    expect_content("old");
    assert_int_equal(cap_file_commit(&file, NULL), STATUS_OK);
    expect_content("new");
}

static void test_an_abandoned_file_leaves_the_old_one(void **state)
{
    (void)state;
    struct atomic_file file;
    write_file("old");
    assert_int_equal(cap_file_begin(&file, path, true, NULL), STATUS_OK);
    fputs("new", file.stream);
    cap_file_abandon(&file);
    expect_content("old");
}

static void test_a_full_disk_leaves_the_old_file(void **state)
{
    (void)state;
    struct atomic_file file;
    struct error err = {0};
    struct rlimit before, small;
    write_file("old");
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small = before;
    small.rlim_cur = 10;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    assert_int_equal(cap_file_begin(&file, path, true, NULL), STATUS_OK);
    fputs("more than ten bytes", file.stream);
    enum status status = cap_file_commit(&file, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(status, STATUS_IO);
    assert_non_null(strstr(err.text, path));
    expect_content("old");
}

static void test_folders_come_with_their_parents(void **state)
{
    (void)state;
    char *deep = cap_path(folder, "a/b//c/"), *part;
    assert_int_equal(cap_make_folder(deep, NULL), STATUS_OK);
    assert_int_equal(cap_make_folder(deep, NULL), STATUS_OK);  // it may be there
    free(deep);
    static const char *const parts[] = {"a/b/c", "a/b", "a"};
    for (int i = 0; i < 3; i++) {
        part = cap_path(folder, parts[i]);
        assert_int_equal(rmdir(part), 0);
        free(part);
    }
}

static void test_a_file_is_no_folder(void **state)
{
    (void)state;
    struct error err = {0};
    char *below = cap_path(path, "x");
    write_file("old");
    assert_int_equal(cap_make_folder(path, &err), STATUS_IO);
    assert_non_null(strstr(err.text, "is not a folder"));
    assert_int_equal(cap_make_folder(below, &err), STATUS_IO);
    free(below);
}

static void test_stories_nest(void **state)
{
    (void)state;
    struct error err = {0};
    assert_int_equal(cap_fail(&err, STATUS_IO, "%s: %d", "a.exr", 7), STATUS_IO);
    assert_int_equal(cap_fail_within(&err, "view %d", 12), STATUS_IO);
    assert_string_equal(err.text, "view 12: a.exr: 7");
    assert_int_equal(cap_fail(NULL, STATUS_DATA, "nobody listens"), STATUS_DATA);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_old_file_stays_until_the_new_one_is_whole),
        cmocka_unit_test(test_an_abandoned_file_leaves_the_old_one),
        cmocka_unit_test(test_a_full_disk_leaves_the_old_file),
        cmocka_unit_test(test_folders_come_with_their_parents),
        cmocka_unit_test(test_a_file_is_no_folder),
        cmocka_unit_test(test_stories_nest),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
