/* per_channel.c -- models with a shape of its own in each channel: "NAME_rgb" of a model NAME.
 *
 * Every number of NAME becomes three; channel c is what NAME says with the numbers of channel c.
 * They are made of rec_models_all when the first is asked for.
 */
#include "lobes.h"
#include "models.h"

#include <pthread.h>
#include <string.h>

enum { VARIANTS_MAX = 24, ROWS = 12, NAME = 40 };

// Each has functions of its own, since a model's functions know of no context.
#define VARIANT_LIST(X)                                                                            \
    X(0)                                                                                           \
    X(1)                                                                                           \
    X(2)                                                                                           \
    X(3)                                                                                           \
    X(4)                                                                                           \
    X(5)                                                                                           \
    X(6)                                                                                           \
    X(7)                                                                                           \
    X(8)                                                                                           \
    X(9)                                                                                           \
    X(10)                                                                                          \
    X(11)                                                                                          \
    X(12)                                                                                          \
    X(13)                                                                                          \
    X(14)                                                                                          \
    X(15)                                                                                          \
    X(16)                                                                                          \
    X(17)                                                                                          \
    X(18)                                                                                          \
    X(19)                                                                                          \
    X(20)                                                                                          \
    X(21)                                                                                          \
    X(22)                                                                                          \
    X(23)

static struct variant {
    struct model model;
    const struct model *base;
    struct parameter parameter[ROWS];
    char name[NAME];
    int size;  // of the base
} variant[VARIANTS_MAX];
static int variants;

// The base's numbers of channel c.
static void take(const struct variant *v, const double *parameters, int c, double *base)
{
    int k = 0;
    for (const struct parameter *p = v->base->parameter; p->name; p++, parameters += 3)
        for (int i = 0; i < p->size; i++)
            base[k++] = parameters[c];
}

static void eval(const struct variant *v, const double *parameters, vec3 wi, vec3 wo, double f[3])
{
    for (int c = 0; c < 3; c++) {
        double base[MODEL_PARAMETERS_MAX], one[3];
        take(v, parameters, c, base);
        v->base->eval(base, wi, wo, one);
        f[c] = one[c];
    }
}

// In channel c a number of the base moves f[c] alone, a colour's three together.
static void slopes(const struct variant *v, const double *parameters, vec3 wi, vec3 wo, double f[3],
                   double *slope)
{
    const int size = rec_model_size(&v->model);
    for (int k = 0; k < 3 * size; k++)
        slope[k] = 0;
    for (int c = 0; c < 3; c++) {
        double base[MODEL_PARAMETERS_MAX], one[3], of_base[3 * MODEL_PARAMETERS_MAX];
        take(v, parameters, c, base);
        v->base->slopes(base, wi, wo, one, of_base);
        f[c] = one[c];
        const double *from = of_base + c * v->size;
        double *to = slope + c * size + c;
        for (const struct parameter *p = v->base->parameter; p->name; p++, to += 3)
            for (int i = 0; i < p->size; i++)
                *to += *from++;
    }
}

// The lobes of the channel in the middle serve all: the density holds for any.
static int lobes(const struct variant *v, const double *parameters, vec3 wi, struct lobe *lobe)
{
    double base[MODEL_PARAMETERS_MAX];
    take(v, parameters, 1, base);
    return v->base->lobes(base, wi, lobe);
}

#define VARIANT_FUNCTIONS(i)                                                                       \
    static void eval_##i(const double *p, vec3 wi, vec3 wo, double f[3])                           \
    {                                                                                              \
        eval(&variant[i], p, wi, wo, f);                                                           \
    }                                                                                              \
    static void slopes_##i(const double *p, vec3 wi, vec3 wo, double f[3], double *slope)          \
    {                                                                                              \
        slopes(&variant[i], p, wi, wo, f, slope);                                                  \
    }                                                                                              \
    static int lobes_##i(const double *p, vec3 wi, struct lobe *lobe)                              \
    {                                                                                              \
        return lobes(&variant[i], p, wi, lobe);                                                    \
    }
VARIANT_LIST(VARIANT_FUNCTIONS)

#define VARIANT_ROW(i) {eval_##i, slopes_##i, lobes_##i},
static const struct {
    void (*eval)(const double *, vec3, vec3, double[3]);
    void (*slopes)(const double *, vec3, vec3, double[3], double *);
    int (*lobes)(const double *, vec3, struct lobe *);
} functions[VARIANTS_MAX] = {VARIANT_LIST(VARIANT_ROW)};

// A model that has something to be split, and not too much.
static bool splits(const struct model *base)
{
    int rows = 0, numbers = 0;
    for (const struct parameter *p = base->parameter; p->name; p++, rows++)
        numbers += p->size == 1;
    return numbers > 0 && rows < ROWS && 3 * rows <= MODEL_PARAMETERS_MAX;
}

static void make_all(void)
{
    for (const struct model *const *m = rec_models_all; *m && variants < VARIANTS_MAX; m++) {
        struct variant *v = &variant[variants];
        if (!splits(*m))
            continue;
        v->base = *m;
        v->size = rec_model_size(*m);
        for (int k = 0; (*m)->parameter[k].name; k++) {
            v->parameter[k] = (*m)->parameter[k];
            v->parameter[k].size = 3;
        }
        snprintf(v->name, sizeof v->name, "%s_rgb", (*m)->name);
        v->model = (struct model){v->name,
                                  (*m)->source,
                                  v->parameter,
                                  functions[variants].eval,
                                  (*m)->slopes ? functions[variants].slopes : NULL,
                                  functions[variants].lobes};
        variants++;
    }
}

static void be_made(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, make_all);
}

const struct model *rec_model_per_channel(const struct model *base)
{
    be_made();
    for (int i = 0; i < variants; i++)
        if (variant[i].base == base)
            return &variant[i].model;
    return base;
}

const struct model *rec_model_per_channel_find(const char *name)
{
    be_made();
    for (int i = 0; i < variants; i++)
        if (strcmp(variant[i].name, name) == 0)
            return &variant[i].model;
    return NULL;
}

const struct model *rec_model_shared(const struct model *model)
{
    be_made();
    for (int i = 0; i < variants; i++)
        if (&variant[i].model == model)
            return variant[i].base;
    return NULL;
}

void rec_model_split(const struct model *base, const double *shared, double *split)
{
    for (const struct parameter *p = base->parameter; p->name; shared += p->size, p++, split += 3)
        for (int c = 0; c < 3; c++)
            split[c] = shared[p->size == 3 ? c : 0];
}
