/* eval_lines.c -- a BRDF as a filter: lines of angles to lines of colours.
 *
 * Method.   What has come in is cut into pieces at the ends of lines, one for each thread, and the
 *           answers are written in order. Within a piece, lines are answered 256 at a time.
 */
#include "eval_lines.h"

#include "charconv_shim.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { BLOCK = 1 << 21, BATCH = 256, LINE = 3 * NUMBER_CHARACTERS, PIECES = 64 };

// Part of the text, and its answers.
struct piece {
    const char *begin, *end;
    char *answer;
    size_t size, room;
    long lines;  // met, the wrong one too
    bool wrong, full;
};

// Pairs of directions that wait for an answer.
struct batch {
    vec3 wi[BATCH], wo[BATCH];
    double f[BATCH][3];
    size_t count;
};

static const char *skip_blank(const char *text, const char *end)
{
    while (text < end && (*text == ' ' || *text == '\t' || *text == '\r'))
        text++;
    return text;
}

// Three angles in degrees, and nothing after them but a comment.
static bool angles_of(const char *text, const char *end, double angle[3])
{
    for (int k = 0; k < 3; k++) {
        text = skip_blank(text, end);
        if (!rec_number_read(&text, end, &angle[k]) || !isfinite(angle[k]))
            return false;
        if (text < end && !strchr(" \t\r#", *text))
            return false;
    }
    text = skip_blank(text, end);
    bool upright = angle[0] >= 0 && angle[0] <= 90 && angle[1] >= 0 && angle[1] <= 90;
    return upright && (text == end || *text == '#');
}

static void ask(struct batch *batch, const double angle[3])
{
    const double degree = CAP_PI / 180;
    double theta_i = angle[0] * degree, theta_o = angle[1] * degree, phi = angle[2] * degree;
    double across = sin(theta_o);
    batch->wi[batch->count] = (vec3){sin(theta_i), 0, angle[0] < 90 ? cos(theta_i) : 0};
    batch->wo[batch->count++] =
        (vec3){across * cos(phi), across * sin(phi), angle[1] < 90 ? cos(theta_o) : 0};
}

static void answer(struct piece *piece, struct batch *batch, const struct brdf *brdf)
{
    if (piece->size + BATCH * LINE > piece->room) {
        size_t room = 2 * piece->room + BATCH * LINE;
        char *more = realloc(piece->answer, room);
        if (!more) {
            piece->full = true;
            return;
        }
        piece->answer = more;
        piece->room = room;
    }
    rec_brdf_eval_many(brdf, batch->wi, batch->wo, batch->f, batch->count);
    char *to = piece->answer + piece->size;
    for (size_t i = 0; i < batch->count; i++)
        for (int c = 0; c < 3; c++) {
            to += rec_number_write(to, batch->f[i][c]);
            *to++ = c < 2 ? ' ' : '\n';
        }
    piece->size = (size_t)(to - piece->answer);
    batch->count = 0;
}

static void work(struct piece *piece, const struct brdf *brdf)
{
    struct batch batch = {.count = 0};
    piece->size = 0;
    for (const char *line = piece->begin; line < piece->end && !piece->wrong && !piece->full;) {
        const char *end = memchr(line, '\n', (size_t)(piece->end - line));
        double angle[3];
        end = end ? end : piece->end;
        const char *text = skip_blank(line, end);
        piece->lines++;
        line = end + 1;
        if (text == end || *text == '#')
            continue;
        piece->wrong = !angles_of(text, end, angle);
        if (piece->wrong)
            continue;
        ask(&batch, angle);
        if (batch.count == BATCH)
            answer(piece, &batch, brdf);
    }
    if (batch.count)
        answer(piece, &batch, brdf);
}

// Cut the text after ends of lines.
static void cut(struct piece *piece, int pieces, const char *begin, const char *end)
{
    const char *from = begin;
    for (int k = 0; k < pieces; k++) {
        const char *to = begin + (end - begin) / pieces * (k + 1);
        to = k == pieces - 1 || to < from ? end : memchr(to, '\n', (size_t)(end - to));
        to = !to ? end : to < end ? to + 1 : end;
        piece[k].begin = from;
        piece[k].end = from = to;
        piece[k].lines = 0;
        piece[k].wrong = piece[k].full = false;
    }
}

// Answer the text, which ends with a whole line; *lines are those before it.
static enum status work_all(struct piece *piece, int pieces, const struct brdf *brdf, FILE *out,
                            long *lines, struct error *err)
{
    static const char *const wanted = "line %ld: \"theta_i theta_o phi\" is wanted, in degrees, "
                                      "both thetas from 0 to 90";
#pragma omp parallel for num_threads(pieces)
    for (int k = 0; k < pieces; k++)
        work(&piece[k], brdf);
    for (int k = 0; k < pieces; k++) {
        *lines += piece[k].lines;
        if (fwrite(piece[k].answer, 1, piece[k].size, out) != piece[k].size)
            return cap_fail(err, STATUS_IO, "standard output: %s", strerror(errno));
        if (piece[k].full)
            return cap_fail(err, STATUS_MEMORY, "no memory for answers");
        if (piece[k].wrong)
            return cap_fail(err, STATUS_FORMAT, wanted, *lines);
    }
    if (fflush(out) != 0)
        return cap_fail(err, STATUS_IO, "standard output: %s", strerror(errno));
    return STATUS_OK;
}

// Text that has come and is not answered yet.
struct waiting {
    char *text;
    size_t size, room;
};

// Read what is there, at least something. *ended: no more will come.
static enum status read_more(struct waiting *w, int in, bool *ended, struct error *err)
{
    if (w->room - w->size < BLOCK) {
        char *more = realloc(w->text, 2 * w->room + BLOCK);
        if (!more)
            return cap_fail(err, STATUS_MEMORY, "no memory for a line");
        w->text = more;
        w->room = 2 * w->room + BLOCK;
    }
    ssize_t got;
    do
        got = read(in, w->text + w->size, BLOCK);
    while (got < 0 && errno == EINTR);
    if (got < 0)
        return cap_fail(err, STATUS_IO, "standard input: %s", strerror(errno));
    w->size += (size_t)got;
    *ended = got == 0;
    return STATUS_OK;
}

enum status rec_eval_lines(const struct brdf *brdf, int in, FILE *out, int threads,
                           struct error *err)
{
    enum status status = STATUS_OK;
    struct waiting w = {0};
    struct piece piece[PIECES] = {0};
    bool ended = false;
    long lines = 0;
    while (!status && !ended) {
        status = read_more(&w, in, &ended, err);
        const char *last = !status && !ended ? memrchr(w.text, '\n', w.size) : NULL;
        size_t whole = ended ? w.size : last ? (size_t)(last + 1 - w.text) : 0;
        if (status || !whole)
            continue;
        int most = threads < PIECES ? threads : PIECES;
        int pieces = whole > (size_t)most * 4096 ? most : 1;
        cut(piece, pieces, w.text, w.text + whole);
        status = work_all(piece, pieces, brdf, out, &lines, err);
        w.size -= whole;
        memmove(w.text, w.text + whole, w.size);
    }
    for (int k = 0; k < PIECES; k++)
        free(piece[k].answer);
    free(w.text);
    return status;
}
