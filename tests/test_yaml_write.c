/* YAML that we write: numbers keep all their bits, text stays text, a full disk is told. */
#include "capture.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/test_yaml_XXXXXX";

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

static void read_text(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    text[fread(text, 1, size - 1, file)] = '\0';
    fclose(file);
}

static void test_document(void **state)
{
    (void)state;
    struct yaml_out *out = NULL;
    char *path = cap_path(folder, "a.yaml"), text[1000];
    assert_int_equal(cap_yaml_begin(&out, path, NULL), STATUS_OK);
    cap_yaml_text(out, "name", "shot 1");
    cap_yaml_int(out, "count", -3);
    cap_yaml_numbers(out, "center", (const double[]){0.1, -2, 1e-7}, 3);
    cap_yaml_list(out, "tags");
    cap_yaml_flow_map(out, NULL);
    cap_yaml_int(out, "id", 4);
    cap_yaml_number(out, "size", 24.5);
    cap_yaml_close(out);
    cap_yaml_close(out);
    cap_yaml_map(out, "sample");
    cap_yaml_text(out, "shape", "sphere");
    cap_yaml_close(out);
    assert_int_not_equal(access(path, F_OK), 0);  // not before it is complete
    assert_int_equal(cap_yaml_end(out, true, NULL), STATUS_OK);
    read_text(path, text, sizeof text);
    assert_string_equal(text, "name: shot 1\ncount: -3\ncenter: [0.1, -2, 1.0e-07]\ntags:\n"
                              "- {id: 4, size: 24.5}\nsample:\n  shape: sphere\n");
    remove(path);
    free(path);
}

static void test_numbers_keep_their_bits(void **state)
{
    (void)state;
    static const double numbers[] = {1.0 / 3, 0.1,   5e-324,    1.7976931348623157e308, -1e22,
                                     123456,  1e15,  0.25,      6.02214076e23,          2e-5,
                                     100,     1e100, -0.000123, 9007199254740993.0,     0};
    enum { N = sizeof numbers / sizeof *numbers };
    for (int i = 0; i < N; i++) {
        struct yaml_out *out = NULL;
        char *path = cap_path(folder, "n.yaml"), text[100];
        assert_int_equal(cap_yaml_begin(&out, path, NULL), STATUS_OK);
        cap_yaml_number(out, "x", numbers[i]);
        assert_int_equal(cap_yaml_end(out, true, NULL), STATUS_OK);
        read_text(path, text, sizeof text);
        assert_near(strtod(text + 3, NULL), numbers[i], 0);
        // YAML 1.1 knows no exponent without a point.
        assert_true(!strchr(text, 'e') || strchr(text, '.'));
        remove(path);
        free(path);
    }
}

static void test_text_stays_text(void **state)
{
    (void)state;
    static const char *const texts[] = {"12", "true", "No", "", "-", "1e5", "~", "a: b", "#a"};
    enum { N = sizeof texts / sizeof *texts };
    for (int i = 0; i < N; i++) {
        struct yaml_out *out = NULL;
        char *path = cap_path(folder, "t.yaml"), text[100];
        assert_int_equal(cap_yaml_begin(&out, path, NULL), STATUS_OK);
        cap_yaml_text(out, "x", texts[i]);
        assert_int_equal(cap_yaml_end(out, true, NULL), STATUS_OK);
        read_text(path, text, sizeof text);
        assert_true(text[3] == '"' || text[3] == '\'');
        remove(path);
        free(path);
    }
}

static void test_abandoned_documents_leave_nothing(void **state)
{
    (void)state;
    struct yaml_out *out = NULL;
    char *path = cap_path(folder, "b.yaml");
    assert_int_equal(cap_yaml_begin(&out, path, NULL), STATUS_OK);
    cap_yaml_list(out, "unfinished");
    assert_int_equal(cap_yaml_end(out, false, NULL), STATUS_OK);
    assert_int_not_equal(access(path, F_OK), 0);
    free(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_document),
        cmocka_unit_test(test_numbers_keep_their_bits),
        cmocka_unit_test(test_text_stays_text),
        cmocka_unit_test(test_abandoned_documents_leave_nothing),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
