/* evenness.c -- how unequal the photosites of a sensor are, and which of them are dead.
 *
 * Method.   Of an evenly lit surface, a photosite and the mean of its two neighbours of the same
 *           channel in its row differ by d, whose variance is 1.5 times that of one: photon and
 *           read noise, which are known, and (r x)^2 of the photosites' unequal response (PRNU).
 *           Vignetting is no matter: over three photosites it is a line. What lies outside its four
 *           neighbours by a quarter of their light is no photosite to measure with.
 * Accuracy. r^2 of N photosites of relative noise s is good to about s^2 sqrt(2 / N): 0.01 % for
 *           s of 1 % and a megapixel. Pictures that were demosaiced show less of it, as they have
 *           less of it.
 *
 * EMVA Standard 1288, "Characterization of Image Sensors and Cameras".
 */
#include "evenness.h"

#include <stdlib.h>
#include <string.h>

static const double ODD = 0.25;  // part of its neighbours' light
static const double REACH = 6;   // deviations, of photosites as unequal as can be
static const double UNEQUAL_MAX =
    0.01;  // of a sensor; more is the texture of what was photographed

static int channel_at(int i, int y, const char *cfa)
{
    return *cfa ? cap_cfa_channel(cfa, i, y) : i % 3;
}

/* The next value of the row in the same channel, to the right (way 1) or left (-1); -1: none. */
static int next_of(int i, int way, int count, int y, const char *cfa)
{
    int step = *cfa ? 1 : 3, c = channel_at(i, y, cfa);
    for (i += way * step; i >= 0 && i < count; i += way * step)
        if (channel_at(i, y, cfa) == c)
            return i;
    return -1;
}

/* Two on either side of value i: far left, left, right, far right. false: the row ends there. */
static bool find_neighbours(int at[4], int i, int count, int y, const char *cfa)
{
    at[1] = next_of(i, -1, count, y, cfa);
    at[2] = next_of(i, 1, count, y, cfa);
    at[0] = at[1] < 0 ? -1 : next_of(at[1], -1, count, y, cfa);
    at[3] = at[2] < 0 ? -1 : next_of(at[2], 1, count, y, cfa);
    return at[0] >= 0 && at[3] >= 0;
}

static enum status note_defect(struct evenness *e, size_t at, struct error *err)
{
    if ((e->defects & (e->defects + 1)) == 0) {  // full: 0, 1, 3, 7, ... of them
        size_t room = 2 * e->defects + 1;
        size_t *grown = realloc(e->defect, room * sizeof *grown);
        if (!grown)
            return cap_fail(err, STATUS_MEMORY, "%zu defective photosites", room);
        e->defect = grown;
    }
    e->defect[e->defects++] = at;
    return STATUS_OK;
}

enum status evenness_add(struct evenness *to, struct evenness_sums *sums, const float *row,
                         int count, int y, const char *cfa, const struct sensor *sensor,
                         struct error *err)
{
    for (int i = 0; i < count; i++) {
        int at[4], c = channel_at(i, y, cfa);
        if (!find_neighbours(at, i, count, y, cfa))
            continue;
        double x = row[i], left = row[at[1]], right = row[at[2]], mean = (left + right) / 2;
        double read2 = sensor->read_noise[c] * sensor->read_noise[c];
        double noise = read2 + fmax(mean, 0) / sensor->gain[c], d = x - mean;
        double far = row[at[0]], near = row[at[3]];
        double low = fmin(fmin(left, right), fmin(far, near));
        double high = fmax(fmax(left, right), fmax(far, near));
        double off = x < low ? low - x : x > high ? x - high : 0;
        if (off > ODD * fabs(mean) && off > REACH * sqrt(noise)) {
            enum status status = note_defect(to, (size_t)y * (size_t)count + (size_t)i, err);
            if (status)
                return status;
            continue;
        }
        if (mean <= 0 || fmax(mean, x) + sensor->black[c] >= sensor->usable[c]
            || d * d > REACH * REACH * 1.5 * (noise + UNEQUAL_MAX * UNEQUAL_MAX * mean * mean))
            continue;
        // Photosites of equal weight where the lens leaves less light: of the signal squared.
        sums->excess[c] += (d * d / 1.5 - noise) / (mean * mean);
        sums->count[c]++;
    }
    return STATUS_OK;
}

void evenness_end(struct evenness *to, const struct evenness_sums *sums)
{
    for (int c = 0; c < 3; c++) {
        double mean = sums->count[c] > 0 ? sums->excess[c] / sums->count[c] : 0;
        to->relative[c] = fmin(sqrt(fmax(mean, 0)), UNEQUAL_MAX);
    }
}

void evenness_free(struct evenness *e)
{
    free(e->defect);
    *e = (struct evenness){0};
}

enum status evenness_read(struct evenness *evenness, const char *path, const struct sensor *sensor,
                          const struct curve *curve, struct error *err)
{
    struct photo_file *file = NULL;
    struct evenness made = {0};
    struct evenness_sums sums = {{0}, {0}};
    enum status status = photo_open(&file, path, err);
    if (status)
        return status;
    const struct photo *info = &file->info;
    const int count = info->channels * info->width;
    float *row = malloc((size_t)count * sizeof *row);
    if (!row)
        status = cap_fail(err, STATUS_MEMORY, "%s", path);
    for (int y = 0; y < info->height && !status; y++) {
        status = photo_read(file, row, 1, err);
        for (int i = 0; i < count && !status; i++) {
            int c = channel_at(i, y, info->cfa);
            row[i] = (info->encoded ? curve->dn[c][(unsigned char)row[i]] : row[i])
                     - (float)sensor->black[c];
        }
        if (!status)
            status = evenness_add(&made, &sums, row, count, y, info->cfa, sensor, err);
    }
    if (!status) {
        evenness_end(&made, &sums);
        *evenness = made;
        made = (struct evenness){0};  // the caller's now
    }
    evenness_free(&made);
    free(row);
    photo_close(file);
    return status;
}

void evenness_mark(const struct evenness *e, int y, int count, float *variance)
{
    size_t begin = (size_t)y * (size_t)count, low = 0, high = e->defects;
    while (low < high) {  // the first one not before the row
        size_t middle = (low + high) / 2;
        if (e->defect[middle] < begin)
            low = middle + 1;
        else
            high = middle;
    }
    for (; low < e->defects && e->defect[low] < begin + (size_t)count; low++)
        variance[e->defect[low] - begin] = INFINITY;
}
