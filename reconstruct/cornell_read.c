/* cornell_read.c -- text tables of the Cornell program of computer graphics, as pbrt reads them.
 *
 * Layout.   Numbers; '#' begins a comment. How many wavelengths, then the wavelengths (nm), then of
 *           each measurement theta_i phi_i theta_o phi_o (radians) and f at each wavelength. Angles
 *           beyond a quarter turn from the normal tell a file in degrees.
 */
#include "formats.h"
#include "scatter.h"
#include "spectrum.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { WAVELENGTHS_MAX = 1000 };

struct numbers {
    double *value;
    size_t count;
};

static enum status add(struct numbers *numbers, double value, const char *path, struct error *err)
{
    if ((numbers->count & (numbers->count - 1)) == 0) {  // full at each power of two
        size_t room = numbers->count ? 2 * numbers->count : 1;
        double *grown = realloc(numbers->value, room * sizeof *grown);
        if (!grown)
            return cap_fail(err, STATUS_MEMORY, "%s: no memory to read it", path);
        numbers->value = grown;
    }
    numbers->value[numbers->count++] = value;
    return STATUS_OK;
}

static enum status add_line(struct numbers *numbers, char *line, long row, const char *path,
                            struct error *err)
{
    line[strcspn(line, "#")] = '\0';
    for (;;) {
        while (isspace((unsigned char)*line))
            line++;
        if (!*line)
            return STATUS_OK;
        char *end;
        double value = strtod(line, &end);
        if (end == line || !isfinite(value))
            return cap_fail(err, STATUS_FORMAT, "%s: line %ld: a number is wanted", path, row);
        enum status status = add(numbers, value, path, err);
        if (status)
            return status;
        line = end;
    }
}

static enum status read_numbers(struct numbers *numbers, const char *path, struct error *err)
{
    FILE *file = fopen(path, "r");
    char *line = NULL;
    size_t room = 0;
    enum status status = STATUS_OK;
    if (!file)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    for (long row = 1; !status && getline(&line, &room, file) >= 0; row++)
        status = add_line(numbers, line, row, path, err);
    if (!status && ferror(file))
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    free(line);
    fclose(file);
    return status;
}

// Numbers as they stand in the file, taken apart.
struct layout {
    const double *wavelength, *row;  // [wavelengths], [rows][4 + wavelengths]
    int wavelengths, rows;
};

static enum status take_apart(struct layout *l, const struct numbers *n, const char *path,
                              struct error *err)
{
    double first = n->count ? n->value[0] : 0;
    if (!(first >= 1 && first <= WAVELENGTHS_MAX && first == floor(first)))
        return cap_fail(err, STATUS_FORMAT, "%s: it begins with no number of wavelengths", path);
    size_t wavelengths = (size_t)first, width = 4 + wavelengths;
    if (n->count < 1 + wavelengths + width || (n->count - 1 - wavelengths) % width != 0)
        return cap_fail(
            err, STATUS_FORMAT,
            "%s: %zu wavelengths want rows of %zu numbers: some are missing, or too many", path,
            wavelengths, width);
    for (size_t i = 2; i <= wavelengths; i++)
        if (!(n->value[i] > n->value[i - 1]))
            return cap_fail(err, STATUS_FORMAT, "%s: its wavelengths do not ascend", path);
    size_t rows = (n->count - 1 - wavelengths) / width;
    if (rows > 1 << 26)
        return cap_fail(err, STATUS_FORMAT, "%s: more than 2^26 measurements", path);
    *l = (struct layout){n->value + 1, n->value + 1 + wavelengths, (int)wavelengths, (int)rows};
    return STATUS_OK;
}

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

// rgb of a row's spectrum; three wavelengths or more make a colour, fewer are grey.
static void color(double f[3], const double *spectrum, double (*weight)[3], int count)
{
    f[0] = f[1] = f[2] = 0;
    for (int k = 0; k < count; k++)
        for (int c = 0; c < 3; c++)
            f[c] += spectrum[k] * (count < 3 ? 1.0 / count : weight[k][c]);
    for (int c = 0; c < 3; c++)
        f[c] = fmax(0, f[c]);
}

static enum status make(struct brdf *brdf, const struct layout *l, const char *path,
                        struct error *err)
{
    double weight[WAVELENGTHS_MAX][3], unit = 1;
    struct scattered *sample = malloc((size_t)l->rows * sizeof *sample);
    if (!sample)
        return cap_fail(err, STATUS_MEMORY, "%s: no memory", path);
    rec_spectrum_weights(weight, l->wavelength, l->wavelengths);
    for (int i = 0; i < l->rows; i++) {
        const double *row = l->row + (size_t)i * (size_t)(4 + l->wavelengths);
        if (row[0] > 1.6 || row[2] > 1.6)
            unit = CAP_PI / 180;
    }
    for (int i = 0; i < l->rows; i++) {
        const double *row = l->row + (size_t)i * (size_t)(4 + l->wavelengths);
        sample[i].wi = direction(row[0] * unit, row[1] * unit);
        sample[i].wo = direction(row[2] * unit, row[3] * unit);
        color(sample[i].f, row + 4, weight, l->wavelengths);
    }
    return rec_scatter_brdf(brdf, sample, l->rows, path, err);
}

static enum status cornell_read(struct brdf *brdf, const char *path, struct error *err)
{
    struct numbers numbers = {0};
    struct layout layout;
    enum status status = read_numbers(&numbers, path, err);
    if (!status)
        status = take_apart(&layout, &numbers, path, err);
    if (!status)
        status = make(brdf, &layout, path, err);
    free(numbers.value);
    return status;
}

// The next number, behind comments; NAN: none.
static double next_number(const char **text)
{
    for (;;) {
        while (isspace((unsigned char)**text))
            ++*text;
        if (**text != '#')
            break;
        *text += strcspn(*text, "\n");
    }
    char *end;
    double value = strtod(*text, &end);
    if (end == *text)
        return NAN;
    *text = end;
    return value;
}

// A count, and as many wavelengths of light as the start shows.
static bool cornell_probe(const char *start, size_t size)
{
    if (strlen(start) < size)
        return false;
    double count = next_number(&start);
    if (!(count >= 1 && count <= WAVELENGTHS_MAX && count == floor(count)))
        return false;
    for (int i = 0; i < (int)count; i++) {
        double nm = next_number(&start);
        if (!*start && i > 0)
            return true;  // more of them than the start holds
        if (!(nm >= 200 && nm <= 3000))
            return false;
    }
    return true;
}

const struct format rec_format_cornell = {"text table with wavelengths (Cornell, pbrt)",
                                          cornell_probe, cornell_read};
