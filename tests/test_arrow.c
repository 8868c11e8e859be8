/* test_arrow.c -- covariances by blocks beside the inverse of the whole normal matrix. */
#include "arrow.h"
#include "dense.h"
#include "near.h"

#include <stdlib.h>
#include <string.h>

enum { LENS = 3, PLACES = 2, POSES = 5, POSE = 2, TERMS = 20, ROWS = 4, ALL = 64 };

/** A linear residual of a lens, a pose and perhaps a place: rows of random numbers. */
struct row {
    double by[3][ROWS * LENS];
    int size[3];
};

static bool evaluate(const void *context, double const *const *value, double *residual,
                     double **jacobian)
{
    const struct row *r = context;
    for (int k = 0; k < ROWS; k++)
        residual[k] = 0.5;
    for (int b = 0; b < 3; b++)
        if (value[b] && jacobian && jacobian[b] && r->size[b])
            memcpy(jacobian[b], r->by[b], (size_t)(ROWS * r->size[b]) * sizeof(double));
    return true;
}

struct scene {
    double lens[LENS], place[PLACES][POSE], pose[POSES][POSE];
    double lens_c[LENS * LENS], place_c[PLACES][POSE * POSE], pose_c[POSES][POSE * POSE];
    bool held[LENS];
    struct row row[TERMS];
    struct ceres_parameter parameter[1 + POSES + PLACES];
    struct ceres_term term[TERMS];
    struct ceres_problem problem;
};

static double deviate(void)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += rand() / (double)RAND_MAX;
    return sum;
}

/** Sizes of the columns differ a thousandfold, as those of a lens do. */
static void make_scene(struct scene *s, double cauchy)
{
    memset(s, 0, sizeof *s);
    srand(5);
    s->held[1] = true;
    s->parameter[0] = (struct ceres_parameter){
        .value = s->lens, .size = LENS, .held = s->held, .covariance = s->lens_c};
    for (int i = 0; i < POSES; i++)
        s->parameter[1 + i] = (struct ceres_parameter){
            .value = s->pose[i], .size = POSE, .eliminate = true, .covariance = s->pose_c[i]};
    for (int i = 0; i < PLACES; i++)
        s->parameter[1 + POSES + i] = (struct ceres_parameter){
            .value = s->place[i], .size = POSE, .covariance = s->place_c[i]};
    for (int t = 0; t < TERMS; t++) {
        struct row *r = &s->row[t];
        r->size[0] = LENS;
        r->size[1] = r->size[2] = POSE;
        for (int b = 0; b < 3; b++)
            for (int k = 0; k < ROWS * r->size[b]; k++)
                r->by[b][k] = deviate() * (b == 0 && k % LENS == 0 ? 1000 : 1);
        s->term[t] = (struct ceres_term){.evaluate = evaluate,
                                         .context = r,
                                         .residuals = ROWS,
                                         .parameters = 3,
                                         .parameter = {0, 1 + t % POSES, 1 + POSES + t % PLACES},
                                         .cauchy = cauchy};
    }
    s->problem = (struct ceres_problem){.parameter = s->parameter,
                                        .term = s->term,
                                        .parameters = 1 + POSES + PLACES,
                                        .terms = TERMS};
}

/** Column of number e of parameter i in the whole matrix; the held one is left out. */
static int column_of(int i, int e)
{
    return i == 0 ? (e == 0 ? 0 : 1) : 2 + (i - 1) * POSE + e;
}

/** The inverse of the whole normal matrix times `weight`. */
static int whole_inverse(const struct scene *s, double weight, double *inverse)
{
    const int n = 2 + (POSES + PLACES) * POSE;
    double h[ALL * ALL] = {0};
    for (int t = 0; t < TERMS; t++)
        for (int k = 0; k < ROWS; k++) {
            double row[ALL] = {0};
            for (int b = 0; b < 3; b++)
                for (int e = 0; e < s->row[t].size[b]; e++)
                    if (b > 0 || e != 1)
                        row[column_of(s->term[t].parameter[b], e)] =
                            s->row[t].by[b][k * s->row[t].size[b] + e];
            for (int i = 0; i < n; i++)
                for (int j = 0; j < n; j++)
                    h[i * n + j] += weight * row[i] * row[j];
        }
    assert_true(dense_cholesky(n, h));
    dense_inverse(n, h, inverse);
    return n;
}

static void compare(const struct scene *s, double weight)
{
    double inverse[ALL * ALL];
    int n = whole_inverse(s, weight, inverse);
    for (int i = 0; i < 1 + POSES + PLACES; i++) {
        const struct ceres_parameter *p = &s->parameter[i];
        for (int a = 0; a < p->size; a++)
            for (int b = 0; b < p->size; b++) {
                int row = column_of(i, a), column = column_of(i, b);
                double expected = i == 0 && (a == 1 || b == 1) ? 0 : inverse[row * n + column];
                double least = sqrt(inverse[row * n + row] * inverse[column * n + column]);
                assert_near(p->covariance[a * p->size + b], expected, 1e-9 * least);
            }
    }
}

static void blocks_are_those_of_the_whole_inverse(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, 0);
    assert_int_equal(arrow_covariance(&s.problem, NULL), STATUS_OK);
    compare(&s, 1);
}

/** Cauchy's loss weighs a term by 1/(1 + |r|^2/a^2): here |r|^2 is 1 for all. */
static void loss_takes_weight(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, 2);
    assert_int_equal(arrow_covariance(&s.problem, NULL), STATUS_OK);
    compare(&s, 0.8);
}

/** A place that only ever moves with the lens, and a pose that no term moves, are not determined.
 */
static void undetermined_unknowns_are_told(void **state)
{
    (void)state;
    struct scene s;
    make_scene(&s, 0);
    for (int t = 0; t < TERMS; t++)
        for (int k = 0; k < ROWS; k++)
            s.row[t].by[2][k * POSE] = s.row[t].by[0][k * LENS] / 3;
    assert_int_equal(arrow_covariance(&s.problem, NULL), STATUS_DATA);
    make_scene(&s, 0);
    for (int t = 0; t < TERMS; t += POSES)
        memset(s.row[t].by[1], 0, sizeof s.row[t].by[1]);
    assert_int_equal(arrow_covariance(&s.problem, NULL), STATUS_DATA);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_are_those_of_the_whole_inverse),
        cmocka_unit_test(loss_takes_weight),
        cmocka_unit_test(undetermined_unknowns_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
