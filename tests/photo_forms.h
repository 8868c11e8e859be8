/* photo_forms.h -- what tests of forms of photographs share: a file, what is put in, reading it. */
#ifndef GONIOCAM_PHOTO_FORMS_H
#define GONIOCAM_PHOTO_FORMS_H

#include "photo.h"
#include "synthetic.h"

#include <unistd.h>

enum { WIDTH = 40, HEIGHT = 31, PIXELS = WIDTH * HEIGHT };

static char path[] = "/tmp/test_forms_XXXXXX";

static inline int make_file(void **state)
{
    (void)state;
    int file = mkstemp(path);
    return file < 0 ? -1 : close(file);
}

static inline int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

/* What is put in: in 8 bits, or in parts of 1 that a half holds exactly. */
static inline int code_at(int x, int y, int c)
{
    return (7 * x + 11 * y + 83 * c) % 256;
}

static inline double part_at(int x, int y, int c)
{
    return code_at(x, y, c) / 256.0;
}

/* Opens path and reads all of it: [height][width][channels]; the caller frees. */
static inline float *read_all(struct photo *info)
{
    struct photo_file *file = NULL;
    struct error err = {0};
    if (photo_open(&file, path, &err))
        fail_msg("%s", err.text);
    *info = file->info;
    info->name = NULL;
    float *dn = malloc((size_t)info->width * info->height * info->channels * sizeof *dn);
    assert_non_null(dn);
    if (photo_read(file, dn, info->height, &err))
        fail_msg("%s", err.text);
    photo_close(file);
    return dn;
}

static inline void expect_refused(const char *story)
{
    struct photo_file *file = NULL;
    struct error err = {0};
    assert_int_equal(photo_open(&file, path, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, path));
    if (!strstr(err.text, story))
        fail_msg("'%s' does not say '%s'", err.text, story);
}

/* The bits of a half that holds v >= 0. */
static inline uint16_t half_of(double v)
{
    int exponent;
    if (v == 0)
        return 0;
    double fraction = frexp(v, &exponent);  // v = fraction 2^exponent, fraction in [1/2, 1)
    return (uint16_t)((exponent + 14) << 10 | (int)((2 * fraction - 1) * 1024));
}

#endif
