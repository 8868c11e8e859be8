/* samples_read.c -- measurements as lines of text, in degrees.
 *
 *      theta_i theta_o phi r g b              phi = azimuth(wo) - azimuth(wi), 180 is the mirror
 * side theta_i phi_i theta_o phi_o r g b
 *
 * Columns are told apart by blanks, tabs, commas or semicolons; a first line may name them, in any
 * order and among others, `f` standing for r, g and b at once; theta_h, theta_d, phi_d do too. '#'
 * begins a comment.
 */
#include "formats.h"
#include "scatter.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const char gaps[] = " \t\r\n,;";
static const char *const names[] = {"theta_i", "theta_o", "phi", "phi_i", "phi_o", "theta_h",
                                    "theta_d", "phi_d",   "r",   "g",     "b",     "f"};
enum column {
    THETA_I,
    THETA_O,
    PHI,
    PHI_I,
    PHI_O,
    THETA_H,
    THETA_D,
    PHI_D,
    RED,
    GREEN,
    BLUE,
    GREY,
    COLUMNS,
    FIELDS_MAX = 64
};

// A file under way.
struct reading {
    int field[COLUMNS];  // which field of a line is this column; -1: none
    int fields;          // of a line, 0: not known yet
    struct scattered *sample;
    int count, room;
    const char *path;
    struct error *err;
};

static int split(char *line, char *word[FIELDS_MAX])
{
    int count = 0;
    char *rest = NULL;
    line[strcspn(line, "#")] = '\0';
    for (char *w = strtok_r(line, gaps, &rest); w && count < FIELDS_MAX;
         w = strtok_r(NULL, gaps, &rest))
        word[count++] = w;
    return count;
}

static bool is_number(const char *word)
{
    char *end;
    double value = strtod(word, &end);
    return !*end && isfinite(value);
}

static void use(struct reading *r, const enum column *columns, int count)
{
    for (int i = 0; i < COLUMNS; i++)
        r->field[i] = -1;
    for (int i = 0; i < count; i++)
        r->field[columns[i]] = i;
    r->fields = count;
}

static bool has(const struct reading *r, enum column a, enum column b, enum column c)
{
    return r->field[a] >= 0 && r->field[b] >= 0 && r->field[c] >= 0;
}

// The columns by their names. false: they do not make a measurement.
static bool use_names(struct reading *r, char *word[], int count)
{
    use(r, NULL, 0);
    r->fields = count;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < COLUMNS; k++)
            if (strcmp(word[i], names[k]) == 0)
                r->field[k] = i;
    bool angles = has(r, THETA_I, THETA_O, PHI) || has(r, THETA_H, THETA_D, PHI_D)
                  || (has(r, THETA_I, THETA_O, PHI_I) && r->field[PHI_O] >= 0);
    return angles && (has(r, RED, GREEN, BLUE) || r->field[GREY] >= 0);
}

static bool use_count(struct reading *r, int count)
{
    static const enum column six[] = {THETA_I, THETA_O, PHI, RED, GREEN, BLUE};
    static const enum column seven[] = {THETA_I, PHI_I, THETA_O, PHI_O, RED, GREEN, BLUE};
    if (count == 6)
        use(r, six, 6);
    else if (count == 7)
        use(r, seven, 7);
    return count == 6 || count == 7;
}

static double degrees(const struct reading *r, char *word[], enum column column)
{
    return r->field[column] < 0 ? 0 : strtod(word[r->field[column]], NULL) * CAP_PI / 180;
}

static vec3 direction(double theta, double phi)
{
    return (vec3){sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
}

static struct scattered measurement(const struct reading *r, char *word[])
{
    struct scattered s = {.f = {0}};
    if (has(r, THETA_I, THETA_O, THETA_O)) {
        double phi = degrees(r, word, PHI) + degrees(r, word, PHI_O) - degrees(r, word, PHI_I);
        s.wi = direction(degrees(r, word, THETA_I), 0);
        s.wo = direction(degrees(r, word, THETA_O), phi);
    } else {
        half_diff a = {degrees(r, word, THETA_H), degrees(r, word, THETA_D),
                       degrees(r, word, PHI_D)};
        rec_directions(a, &s.wi, &s.wo);
    }
    for (int c = 0; c < 3; c++)
        s.f[c] = fmax(0, strtod(word[r->field[r->field[GREY] >= 0 ? (int)GREY : RED + c]], NULL));
    return s;
}

static enum status add(struct reading *r, const struct scattered *s)
{
    if (r->count == r->room) {
        int room = r->room ? 2 * r->room : 1024;
        struct scattered *grown =
            room > 1 << 26 ? NULL : realloc(r->sample, (size_t)room * sizeof *grown);
        if (!grown)
            return cap_fail(r->err, STATUS_MEMORY, "%s: no memory for its measurements", r->path);
        r->sample = grown;
        r->room = room;
    }
    r->sample[r->count++] = *s;
    return STATUS_OK;
}

static enum status read_line(struct reading *r, char *line, long row)
{
    char *word[FIELDS_MAX];
    int count = split(line, word), numbers = 0;
    for (int i = 0; i < count; i++)
        numbers += is_number(word[i]);
    if (!count)
        return STATUS_OK;
    if (!r->fields && numbers < count)
        return use_names(r, word, count)
                   ? STATUS_OK
                   : cap_fail(r->err, STATUS_FORMAT,
                              "%s: line %ld: columns theta_i theta_o phi (or theta_i phi_i theta_o "
                              "phi_o, or theta_h theta_d phi_d) and r g b (or f) are wanted",
                              r->path, row);
    if (!r->fields && !use_count(r, count))
        return cap_fail(r->err, STATUS_FORMAT,
                        "%s: line %ld: \"theta_i theta_o phi r g b\" or \"theta_i phi_i theta_o "
                        "phi_o r g b\" is wanted, in degrees",
                        r->path, row);
    if (count != r->fields || numbers < count)
        return cap_fail(r->err, STATUS_FORMAT, "%s: line %ld: %d numbers are wanted", r->path, row,
                        r->fields);
    struct scattered s = measurement(r, word);
    return add(r, &s);
}

static enum status samples_read(struct brdf *brdf, const char *path, struct error *err)
{
    struct reading r = {.path = path, .err = err};
    char *line = NULL;
    size_t room = 0;
    enum status status = STATUS_OK;
    FILE *file = fopen(path, "r");
    if (!file)
        return cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    for (long row = 1; !status && getline(&line, &room, file) >= 0; row++)
        status = read_line(&r, line, row);
    if (!status && ferror(file))
        status = cap_fail(err, STATUS_IO, "%s: %s", path, strerror(errno));
    free(line);
    fclose(file);
    if (!status)
        return rec_scatter_brdf(brdf, r.sample, r.count, path, err);
    free(r.sample);
    return status;
}

// Its first line of words or numbers is one that read_line takes.
static bool samples_probe(const char *start, size_t size)
{
    struct reading r = {.path = ""};
    if (strlen(start) < size)
        return false;
    char *copy = strdup(start), *rest = NULL;
    bool yes = false, told = false;
    for (char *line = copy ? strtok_r(copy, "\n", &rest) : NULL; line && !told;
         line = strtok_r(NULL, "\n", &rest)) {
        char *word[FIELDS_MAX];
        int count = split(line, word), numbers = 0;
        for (int i = 0; i < count; i++)
            numbers += is_number(word[i]);
        told = count > 0;
        yes = told && (numbers < count ? use_names(&r, word, count) : use_count(&r, count));
    }
    free(copy);
    return yes;
}

const struct format rec_format_samples = {"measurements as text", samples_probe, samples_read};
