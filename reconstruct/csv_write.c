/* csv_write.c -- a BRDF as text: every bin in a line, or a model's parameters as JSON.
 *
 * Both are read again: samples_read.c knows the columns by their names, published_read.c the model.
 */
#include "export.h"

#include <jansson.h>
#include <stdlib.h>

static const double degree = CAP_PI / 180;

static void fill_csv(FILE *to, const void *data)
{
    const struct merl *table = data;
    fprintf(to, "theta_h,theta_d,phi_d,r,g,b\n");
    for (int bin = 0; bin < MERL_BINS && !ferror(to); bin++) {
        const double *f = table->value + bin;
        half_diff a = rec_merl_center(bin);
        if (f[0] < 0 || f[MERL_BINS] < 0 || f[2 * MERL_BINS] < 0)
            continue;
        fprintf(to, "%.7g,%.7g,%.7g,%.7g,%.7g,%.7g\n", a.theta_h / degree, a.theta_d / degree,
                a.phi_d / degree, f[0], f[MERL_BINS], f[2 * MERL_BINS]);
    }
}

enum status rec_csv_write(const struct exported *what, const char *path, struct run *run,
                          struct error *err)
{
    struct merl table = {0};
    enum status status = rec_brdf_table(&table, what->brdf, run->threads, err);
    if (!status)
        status = rec_text_write(path, fill_csv, &table, err);
    rec_merl_free(&table);
    return status;
}

/* ---- JSON -------------------------------------------------------------------------------------
 */

static void fill_model(FILE *to, const void *data)
{
    const struct brdf *brdf = data;
    const double *value = brdf->value;
    json_t *parameters = json_object();
    for (const struct parameter *p = brdf->model->parameter; p->name; value += p->size, p++)
        json_object_set_new(parameters, p->name,
                            p->size == 1 ? json_real(*value)
                                         : json_pack("[f, f, f]", value[0], value[1], value[2]));
    json_t *root = json_pack("{s:s, s:o, s:s}", "model", brdf->model->name, "parameters",
                             parameters, "source", brdf->model->source);
    json_dumpf(root, to, JSON_INDENT(2));
    fputc('\n', to);
    json_decref(root);
}

static void write_angles(FILE *to, const char *name, int count, int stride, double (*of)(half_diff))
{
    fprintf(to, "\"%s\": [", name);
    for (int i = 0; i < count; i++)
        fprintf(to, "%s%.9g", i ? ", " : "", of(rec_merl_center(i * stride)) / degree);
    fprintf(to, "],\n");
}

static double theta_h(half_diff a)
{
    return a.theta_h;
}
static double theta_d(half_diff a)
{
    return a.theta_d;
}
static double phi_d(half_diff a)
{
    return a.phi_d;
}

// {"theta_h": [90], "theta_d": [90], "phi_d": [180], "f": [3][90][90][180]}: a row of phi_d a line.
static void fill_table(FILE *to, const void *data)
{
    const struct merl *table = data;
    fprintf(to, "{\n\"unit\": \"1/sr; angles in degrees; f[channel][theta_h][theta_d][phi_d], null "
                "where there is none\",\n");
    write_angles(to, "theta_h", MERL_THETA_H, MERL_THETA_D * MERL_PHI_D, theta_h);
    write_angles(to, "theta_d", MERL_THETA_D, MERL_PHI_D, theta_d);
    write_angles(to, "phi_d", MERL_PHI_D, 1, phi_d);
    fprintf(to, "\"f\": [");
    for (size_t i = 0; i < 3 * (size_t)MERL_BINS && !ferror(to); i++) {
        bool slab = i % ((size_t)MERL_THETA_D * MERL_PHI_D) == 0, row = i % MERL_PHI_D == 0;
        if (row)
            fprintf(to, "%s%s\n%s%s[", i ? "]" : "",
                    i && slab ? (i % MERL_BINS ? "]," : "]],")
                    : i       ? ","
                              : "",
                    i % MERL_BINS == 0 ? "[" : "", slab ? "[" : "");
        if (table->value[i] < 0)
            fprintf(to, "%snull", row ? "" : ",");
        else
            fprintf(to, "%s%.6g", row ? "" : ",", table->value[i]);
    }
    fprintf(to, "]]]]\n}\n");
}

enum status rec_json_write(const struct exported *what, const char *path, struct run *run,
                           struct error *err)
{
    if (what->brdf->model)
        return rec_text_write(path, fill_model, what->brdf, err);
    struct merl table = {0};
    enum status status = rec_brdf_table(&table, what->brdf, run->threads, err);
    if (!status)
        status = rec_text_write(path, fill_table, &table, err);
    rec_merl_free(&table);
    return status;
}
