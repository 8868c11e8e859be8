/* Command lines: options anywhere, in all spellings, and what is wrong is told. */
#include "capture.h"
#include "near.h"

#include <string.h>

static const struct option options[] = {
    {"output", "OUT", "", 'o'},
    {"samples", NULL, "", 0},
    {0},
};
static const struct command command = {"merge", "CAPTURE -o OUT", "", options, NULL};

static bool parse(struct arguments *args, struct error *err, int argc, const char **argv)
{
    return cap_arguments_parse(args, &command, argc, (char **)argv, err);
}
#define PARSE(args, err, ...)                                                                      \
    parse(args, err, sizeof((const char *[]){__VA_ARGS__}) / sizeof(char *),                       \
          (const char *[]){__VA_ARGS__})

static void test_spellings(void **state)
{
    (void)state;
    struct arguments args;
    struct error err = {0};
    int threads;
    assert_true(PARSE(&args, &err, "merge", "-o", "out", "in", "--samples", "--threads=3"));
    assert_int_equal(args.count, 1);
    assert_string_equal(args.positional[0], "in");
    assert_string_equal(cap_option(&args, "output"), "out");
    assert_string_equal(cap_option(&args, "samples"), "");
    assert_null(cap_option(&args, "quiet"));
    assert_true(cap_option_int(&args, "threads", 1, 64, 0, &threads));
    assert_int_equal(threads, 3);
    assert_true(PARSE(&args, &err, "merge", "--output", "-", "--", "-o"));
    assert_string_equal(cap_option(&args, "output"), "-");
    assert_string_equal(args.positional[0], "-o");
    assert_true(cap_option_int(&args, "threads", 1, 64, 7, &threads));
    assert_int_equal(threads, 7);
}

static struct row {
    const char *name, *a, *b, *story;
} rows[] = {
    {"unknown option", "--outputs", "x", "'--outputs'"},
    {"unknown letter", "-x", "x", "'-x'"},
    {"the beginning of a name", "--out", "x", "'--out'"},
    {"no value", "in", "-o", "--output needs a value"},
    {"a value for a flag", "--samples=3", "in", "--samples takes no value"},
    {"an option twice", "--quiet", "-q", "--quiet is given twice"},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_refused(void **state)
{
    const struct row *r = *state;
    struct arguments args;
    struct error err = {0};
    assert_false(PARSE(&args, &err, "merge", r->a, r->b));
    assert_non_null(strstr(err.text, r->story));
}

static void test_numbers_have_bounds(void **state)
{
    (void)state;
    static const char *const wrong[] = {"0", "65", "three", "3x", "", "99999999999999999999"};
    for (int i = 0; i < 6; i++) {
        struct arguments args;
        struct error err = {0};
        int threads;
        assert_true(PARSE(&args, &err, "merge", "--threads", wrong[i]));
        assert_false(cap_option_int(&args, "threads", 1, 64, 0, &threads));
    }
}

int main(void)
{
    struct CMUnitTest tests[ROWS + 2];
    for (int i = 0; i < ROWS; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_refused, NULL, NULL, &rows[i]};
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(test_spellings);
    tests[ROWS + 1] = (struct CMUnitTest)cmocka_unit_test(test_numbers_have_bounds);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
