/* test_report.c -- the report of what is there, and of what is not; tests/report.py opens whole
 * ones in a browser. */
#include "near.h"
#include "report.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/goniocam_report_XXXXXX", *out, *page_path;

static char *read_text(const char *path)
{
    FILE *in = fopen(path, "rb");
    char *text = NULL;
    size_t size = 0;
    if (in && getdelim(&text, &size, '\0', in) < 0)
        text[0] = '\0';
    if (in)
        fclose(in);
    return text;
}

static void write_text(const char *name, const char *text)
{
    char *path = cap_path(out, name);
    FILE *to = fopen(path, "wb");
    assert_non_null(to);
    fputs(text, to);
    fclose(to);
    free(path);
}

// A folder with a white table and nothing else; its name is no good HTML.
static int make_folder(void **state)
{
    (void)state;
    struct merl table = {malloc(3 * (size_t)MERL_BINS * sizeof(double))};
    if (!mkdtemp(folder) || !table.value)
        return -1;
    out = cap_path(folder, "a<b&c");
    page_path = cap_path(out, "report.html");
    for (int i = 0; i < 3 * MERL_BINS; i++)
        table.value[i] = rec_merl_above(i % MERL_BINS) ? 0.25 : -1;
    char *path = cap_path(out, "brdf.binary");
    int failed = mkdir(out, 0777) || rec_merl_write(&table, path, NULL);
    free(path);
    rec_merl_free(&table);
    return failed;
}

static int remove_folder(void **state)
{
    (void)state;
    static const char *const names[] = {"brdf.binary", "report.html", "run.json"};
    for (int i = 0; i < 3; i++) {
        char *path = cap_path(out, names[i]);
        unlink(path);
        free(path);
    }
    rmdir(out);
    rmdir(folder);
    free(out);
    free(page_path);
    return 0;
}

static void test_a_table_alone_has_a_report_that_says_what_is_missing(void **state)
{
    (void)state;
    assert_int_equal(rec_report(out, 1, NULL), STATUS_OK);
    char *page = read_text(page_path);
    assert_non_null(page);
    assert_null(strstr(page, "<!--@"));  // every mark was replaced
    assert_non_null(strstr(page, "<title>a&lt;b&amp;c: BRDF report</title>"));
    assert_non_null(strstr(page, "There is no run.json"));
    assert_non_null(strstr(page, "There is no calibration.yaml"));
    assert_non_null(strstr(page, "There is no fits.yaml"));
    assert_non_null(strstr(page, "There is no bins.h5"));
    assert_non_null(strstr(page, "data-name=\"measured table\""));
    assert_null(strstr(page, " nan"));
    assert_null(strstr(page, ";nan"));
    free(page);
}

static void test_warnings_stand_in_the_page_with_advice(void **state)
{
    (void)state;
    write_text(
        "run.json",
        "{\"version\": \"1\", \"warnings\": [\"tag 7 is not where capture.yaml says <b>\"]}");
    assert_int_equal(rec_report(out, 1, NULL), STATUS_OK);
    char *page = read_text(page_path);
    assert_non_null(strstr(page, "tag 7 is not where capture.yaml says &lt;b&gt;"));
    assert_non_null(strstr(page, rec_report_advice("tag 7 is not where capture.yaml says")));
    free(page);
}

static void test_a_damaged_story_is_told_and_leaves_the_old_report(void **state)
{
    (void)state;
    struct error err = {0};
    char *before = read_text(page_path);
    write_text("run.json", "{\"version\": ");
    assert_int_equal(rec_report(out, 1, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "run.json"));
    char *after = read_text(page_path);
    assert_string_equal(before, after);
    free(before);
    free(after);
    assert_int_equal(rec_report("/nowhere/at/all", 1, &err), STATUS_IO);
}

static void test_advice_fits_the_warning(void **state)
{
    (void)state;
    const char *other = rec_report_advice("something new");
    static const char *const warnings[] = {
        "shot3: no tag of family tag36h11 found: left out",
        "lamp a: its direction by board alone is 0.40 degrees off (6.0 sigma): look for other "
        "light",
        "camera c: the focal length is uncertain by 1.0 %: take photographs",
        "2.0 % of the photosites disagree with their neighbours and were left out",
    };
    for (size_t i = 0; i < sizeof warnings / sizeof *warnings; i++)
        assert_string_not_equal(rec_report_advice(warnings[i]), other);
}

static void test_numbers_of_the_story_are_found_by_their_keys(void **state)
{
    (void)state;
    struct report r = {.story = json_pack("{s:{s:f}}", "checks", "stray_part", 0.25)};
    assert_near(rec_report_number(&r, "checks", "stray_part", NULL), 0.25, 0);
    assert_true(isnan(rec_report_number(&r, "checks", "nothing", NULL)));
    assert_true(isnan(rec_report_number(&r, "nothing", "nothing", NULL)));
    json_decref(r.story);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_table_alone_has_a_report_that_says_what_is_missing),
        cmocka_unit_test(test_warnings_stand_in_the_page_with_advice),
        cmocka_unit_test(test_a_damaged_story_is_told_and_leaves_the_old_report),
        cmocka_unit_test(test_advice_fits_the_warning),
        cmocka_unit_test(test_numbers_of_the_story_are_found_by_their_keys),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
