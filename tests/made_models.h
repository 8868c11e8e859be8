/* made_models.h -- random physical parameters for any model, for tests. */
#ifndef GONIOCAM_MADE_MODELS_H
#define GONIOCAM_MADE_MODELS_H

#include "models.h"
#include "random.h"

#include <string.h>

static inline double between(struct random *random, double low, double high)
{
    return low + (high - low) * sam_uniform(random);
}

/** Sizes of lobes that measured materials have, and no more energy than there is: bodies and gloss
 *  each at most half of it, gloss as each model counts it. */
static inline void draw(const struct model *model, struct random *random, double *value)
{
    double *at = value;
    for (const struct parameter *p = model->parameter; p->name; p++)
        for (int c = 0; c < p->size; c++, at++) {
            *at = between(random, p->low, p->high);
            if (!strcmp(p->name, "albedo") || !strcmp(p->name, "kD") || !strcmp(p->name, "rhoD")
                || !strcmp(p->name, "base") || !strcmp(p->name, "sheen"))
                *at *= 0.5;
            else if (!strcmp(p->name, "kd"))
                *at *= 0.4;
            else if (!strcmp(p->name, "alpha") || !strcmp(p->name, "alpha_2"))
                *at = between(random, 0.05, 0.4);
            else if (!strcmp(p->name, "f0") || !strcmp(p->name, "f0_2"))
                *at *= 0.25;
            else if (!strcmp(p->name, "roughness"))
                *at = between(random, 0.25, 1);
            else if (!strcmp(p->name, "clearcoat_gloss"))
                *at *= 0.2;
            else if (!strcmp(p->name, "ior"))
                *at = between(random, 1.2, 1.8);
            else if (!strcmp(p->name, "n") || !strcmp(p->name, "ke"))
                *at = between(random, 2, 100);
            else if (!strcmp(p->name, "B"))
                *at = between(random, 25, 1e3);
        }
}

/** What cannot be drawn one by one. */
static inline void tie(const struct model *model, struct random *random, double *v)
{
    for (int c = 0; c < 3; c++) {
        if (!strcmp(model->name, "blinn_phong")) {  // half of the normalised lobe
            double e = v[6 + c];
            v[3 + c] =
                between(random, 0, 0.5) * (e + 2) * (e + 4) / (8 * CAP_PI * (pow(2, -e / 2) + e));
        } else if (!strcmp(model->name, "lafortune")) {  // a Phong lobe of albedo up to 1/2
            double n = v[9 + c], cz = pow((n + 1) / (4 * CAP_PI), 1 / n);
            v[6 + c] = between(random, 0, cz);
            v[3 + c] = between(random, -1, 1) * v[6 + c];
        } else if (!strcmp(model->name, "abc")) {  // a quarter of a lobe of its width: A ~ B C / 4
            v[7] = 1.5 + 0.5 * v[7] / 10;
            v[3 + c] = between(random, 0, 0.1) * v[6] * (v[7] - 1);
        } else if (!strcmp(model->name, "sgd")) {
            v[3 + c] = between(random, 0, 0.4);
            v[9 + c] = between(random, 0, 1.1);
            v[12 + c] = between(random, 0, 0.3);
            v[15 + c] = between(random, 0, v[12 + c]);
            v[18 + c] = between(random, 1, 3);
            v[21 + c] = 0.05;
            v[24 + c] = between(random, 5, 30);
            v[27 + c] = between(random, 0, 0.3);
        }
    }
}

static inline void draw_all(const struct model *model, struct random *random, double *value)
{
    draw(model, random, value);
    tie(model, random, value);
}

#endif
