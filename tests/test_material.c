/* test_material.c -- sums, tables and published materials of scenes. */
#include "near.h"
#include "scene_material.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double grey[] = {0.5, 0.25, 1}, plastic[] = {0.3, 0.2, 0.1, 0.3, 1.5};

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

static void test_parts_add_up(void **state)
{
    (void)state;
    struct material sum = sam_material(rec_model_find("ggx"), plastic);
    sum.part[1] = sam_material(rec_model_find("lambert"), grey).part[0];
    sum.part[1].scale[2] = 3;
    sum.parts = 2;
    vec3 wi = direction(0.5, 0), wo = direction(0.4, 2);
    double f[3], g[3];
    sam_material_eval(&sum, wi, wo, f);
    rec_model_find("ggx")->eval(plastic, wi, wo, g);
    assert_near(f[0], g[0] + 0.5 / CAP_PI, 1e-15);
    assert_near(f[2], g[2] + 3 / CAP_PI, 1e-15);
    assert_false(sam_material_mirrors(&sum));
}

/** A table of f at the middles of bins. */
static struct merl table_of(const struct material *material)
{
    struct merl table = {malloc(3 * (size_t)MERL_BINS * sizeof(double))};
    assert_non_null(table.value);
    for (int bin = 0; bin < MERL_BINS; bin++) {
        vec3 wi, wo;
        double f[3] = {-1, -1, -1};
        rec_directions(rec_merl_center(bin), &wi, &wo);
        if (rec_merl_above(bin))
            sam_material_eval(material, wi, wo, f);
        for (size_t c = 0; c < 3; c++)
            table.value[c * MERL_BINS + (size_t)bin] = f[c];
    }
    return table;
}

// A table answers as its model does: exactly at the middles of bins, and between them as well as a
// line does; and the same after swapping the directions.
static void test_table_of_a_model(void **state)
{
    (void)state;
    struct material model = sam_material(rec_model_find("ggx"), plastic);
    struct material table = {.parts = 1};
    table.part[0] =
        (struct material_part){.table = {.table = table_of(&model)}, .scale = {1, 1, 1}};
    assert_int_equal(rec_brdf_prepare(&table.part[0].table, NULL), STATUS_OK);
    double f[3], g[3];
    vec3 wi, wo;
    for (int bin = 0; bin < MERL_BINS; bin += 997) {
        if (!rec_merl_above(bin))
            continue;
        rec_directions(rec_merl_center(bin), &wi, &wo);
        sam_material_eval(&model, wi, wo, f);
        sam_material_eval(&table, wi, wo, g);
        assert_near(g[1], f[1], 1e-6 * f[1]);  // tables are held in floats
    }
    for (int i = 0; i < 400; i++) {
        wi = direction(1.2 * (i % 20) / 20, 0);
        wo = direction(1.2 * (i / 20) / 20, 0.3 + 0.1 * i);
        sam_material_eval(&model, wi, wo, f);
        sam_material_eval(&table, wi, wo, g);
        assert_near(g[1] / f[1], 1, 5e-3);  // half a bin's bend of a lobe of width 0.3
        sam_material_eval(&table, wo, wi, f);
        assert_near(g[1], f[1], 1e-6 * f[1]);
    }
    sam_material_free(&table);
}

// ---- SCENE.yaml

static char folder[] = "/tmp/test_material_XXXXXX", scene_path[64], data_path[64], table_path[64];

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static enum status read_text(struct material *material, const char *text, bool may_mirror,
                             struct error *err)
{
    struct doc *doc;
    write_text(scene_path, text);
    *material = (struct material){0};
    *err = (struct error){0};
    assert_int_equal(sam_doc_open(&doc, scene_path, err), STATUS_OK);
    doc_node root = sam_doc_root(doc);
    sam_doc_text(doc, root, "materials", "");
    sam_read_material(material, doc, sam_doc_need(doc, root, "material"), may_mirror);
    return sam_doc_close(doc, err);
}

static void test_published_material(void **state)
{
    (void)state;
    struct material material;
    struct error err;
    write_text(data_path, "{\"abc\": {\"tin\": {\"kD\": [0.1, 0.2, 0.3], \"A\": [5, 6, 7],"
                          " \"B\": 100, \"C\": 1.5, \"ior\": 1.5}}}");
    assert_int_equal(
        read_text(&material, "materials: data.json\nmaterial: {abc: tin}\n", false, &err),
        STATUS_OK);
    double f[3];
    vec3 n = {0, 0, 1};
    sam_material_eval(&material, n, n, f);
    assert_near(f[1], (0.2 + 0.04 * 6) / CAP_PI, 1e-14);
}

// Straight down f = (rhoD + rhoS F kap exp(-alpha) / (pi alpha^p)) / pi with the kap that is given,
// whatever normalises D.
static void test_published_kap_counts(void **state)
{
    (void)state;
    struct material material;
    struct error err;
    write_text(data_path,
               "{\"sgd\": {\"tin\": {\"rhoD\": [0.1, 0.2, 0.3], \"rhoS\": [0.5, 0.5, 0.5],"
               " \"alpha\": [0.1, 0.1, 0.1], \"p\": [0.5, 0.5, 0.5], \"F0\": [0.3, 0.3, 0.3],"
               " \"F1\": [0.1, 0.1, 0.1], \"kap\": [20, 30, 40], \"lambda\": [2, 2, 2],"
               " \"c\": [0.1, 0.1, 0.1], \"k\": [9, 9, 9], \"theta0\": [0.2, 0.2, 0.2]}}}");
    assert_int_equal(
        read_text(&material, "materials: data.json\nmaterial: {sgd: tin}\n", false, &err),
        STATUS_OK);
    double f[3], lobe = exp(-0.1) / (CAP_PI * sqrt(0.1));
    vec3 n = {0, 0, 1};
    sam_material_eval(&material, n, n, f);
    assert_near(f[0], (0.1 + 0.5 * 0.2 * 20 * lobe) / CAP_PI, 1e-12);
    assert_near(f[2], (0.3 + 0.5 * 0.2 * 40 * lobe) / CAP_PI, 1e-12);
}

static void test_sum_and_mirror(void **state)
{
    (void)state;
    struct material m;
    struct error err;
    const char *text = "material:\n- {model: lambert, albedo: 0.5, scale: 0.5}\n- {mirror: 0.8}\n";
    assert_int_equal(read_text(&m, text, true, &err), STATUS_OK);
    assert_int_equal(m.parts, 1);
    assert_true(sam_material_mirrors(&m));
    assert_near(m.mirror[2], 0.8, 0);
    assert_near(m.part[0].scale[1], 0.5, 0);
    assert_int_equal(read_text(&m, text, false, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, ":3: mirror: "));
}

static void test_table_from_a_file(void **state)
{
    (void)state;
    struct material m, matt = sam_material(rec_model_find("lambert"), grey);
    struct merl table = table_of(&matt);
    struct error err;
    double f[3];
    assert_int_equal(rec_merl_write(&table, table_path, &err), STATUS_OK);
    rec_merl_free(&table);
    assert_int_equal(read_text(&m, "material: {table: t.binary, scale: 2}\n", false, &err), 0);
    sam_material_eval(&m, direction(0.3, 1), direction(1.1, 2), f);
    assert_near(f[1], 2 * 0.25 / CAP_PI, 1e-7);
    sam_material_free(&m);
}

static struct row {
    const char *name, *text, *story;
} rows[] = {
    {"no data file named", "material: {sgd: gold}\n", "the key 'materials' is missing"},
    {"no data file", "materials: none.json\nmaterial: {sgd: gold}\n", "none.json"},
    {"no such material", "materials: data.json\nmaterial: {sgd: gold}\n", "has no 'gold'"},
    {"no table", "material: {table: none.binary}\n", "none.binary: No such file"},
    {"too many",
     "material: [{mirror: 1}, {model: lambert, albedo: 0}, {model: lambert, albedo: 0},"
     " {model: lambert, albedo: 0}, {model: lambert, albedo: 0},"
     " {model: lambert, albedo: 0}]\n",
     "a sum of at most 4"},
    {"none", "material: []\n", "at least one"},
    {"a parameter of another model", "material: {model: oren_nayar, albedo: 1, sigma: 0, n: 3}\n",
     "unknown key 'n'"},
};
enum { ROWS = sizeof rows / sizeof *rows };

static void test_errors(void **state)
{
    const struct row *r = *state;
    struct material m;
    struct error err;
    assert_int_equal(read_text(&m, r->text, true, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, scene_path));
    assert_non_null(strstr(err.text, r->story));
    sam_material_free(&m);
}

static int set_up(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(scene_path, sizeof scene_path, "%s/scene.yaml", folder);
    snprintf(data_path, sizeof data_path, "%s/data.json", folder);
    snprintf(table_path, sizeof table_path, "%s/t.binary", folder);
    return 0;
}

static int clear(void **state)
{
    (void)state;
    unlink(scene_path);
    unlink(data_path);
    unlink(table_path);
    return rmdir(folder);
}

int main(void)
{
    static const struct CMUnitTest fixed[] = {
        cmocka_unit_test(test_parts_add_up),       cmocka_unit_test(test_table_of_a_model),
        cmocka_unit_test(test_published_material), cmocka_unit_test(test_published_kap_counts),
        cmocka_unit_test(test_sum_and_mirror),     cmocka_unit_test(test_table_from_a_file),
    };
    enum { FIXED = sizeof fixed / sizeof *fixed };
    struct CMUnitTest tests[FIXED + ROWS];
    memcpy(tests, fixed, sizeof fixed);
    for (int i = 0; i < ROWS; i++)
        tests[FIXED + i] = (struct CMUnitTest){rows[i].name, test_errors, NULL, NULL, &rows[i]};
    return cmocka_run_group_tests(tests, set_up, clear);
}
