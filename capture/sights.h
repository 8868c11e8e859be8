/* sights.h -- the same photosites in shots of different views. */
#ifndef GONIOCAM_SIGHTS_H
#define GONIOCAM_SIGHTS_H

#include "sensor.h"

enum { SIGHTS_MAX = 8, SIGHTS_LEAST = 3 };  // views; a photosite is kept that stands out in 3

/** A value of the image that stands out in some views; bit k of the masks is view k. */
struct sight {
    size_t at, cell;  // value [height][width][channels]; its cell in sights->cell
    unsigned odd, bright, tested;
    unsigned dim, lit;  // where a leak, a lack of light would show
};
struct sight_count {
    double odd, tested;
};

/** What views tell of photosites. Owns sight and cell; {0} is empty; sights_free(). */
struct sights {
    int views;
    double photosites;    // values that were looked at
    struct sight *sight;  // [sights], ascending by at: those odd in at least SIGHTS_LEAST
    size_t sights;
    struct sight_count *cell;  // [cells][views]
    struct sight_count all[SIGHTS_MAX];
    double structure[SIGHTS_MAX][SIGHTS_MAX];  // products of the image's coarse structure
    // Of photosites in smooth light, relative to their neighbours' mean, by channel: products of
    // views j < k, their squares and number; squares of one view that noise does not explain,
    // their squares and number.
    double product[3][SIGHTS_MAX][SIGHTS_MAX], product2[3][SIGHTS_MAX][SIGHTS_MAX];
    double pairs[3][SIGHTS_MAX][SIGHTS_MAX];
    double first[3][SIGHTS_MAX][SIGHTS_MAX], second[3][SIGHTS_MAX][SIGHTS_MAX];  // sums of j, of k
    double excess[3][SIGHTS_MAX], excess2[3][SIGHTS_MAX], smooth[3][SIGHTS_MAX];
    double explained[3][SIGHTS_MAX];  // the squares that noise does explain
};

/** Read the longest frames of up to SIGHTS_MAX shots of a camera. Of fewer than SIGHTS_LEAST shots
 *  some rows tell of smooth light alone. views is 0 where nothing can be read. STATUS_MEMORY. */
enum status sights_read(struct sights *sights, const struct capture *capture, int camera,
                        const struct sensor *sensor, const bool *left_out, const struct run *run,
                        struct error *err);
void sights_free(struct sights *sights);
#endif
