/* sample.c -- some rows of all shots of a camera.
 *
 * Each shot gives a few bands of rows: at least 16 bands in all, so that few shots show the whole
 * scene too. Strips that lie elsewhere are not decoded. Bands begin where a cell of a mosaic
 * begins. A shot whose bands fell beside what is lit, so that they show less than another shot's of
 * how its frames compare, is read again in more of them.
 */
#include "sample.h"
#include "bracket.h"

#include <stdlib.h>
#include <string.h>

enum { PIXELS = 400000, BANDS_MIN = 16, ROWS_MIN = 4 };
enum { MORE = 4, TELLING_MIN = 2000 };  // times as many bands; photosites that compare two frames

/* What one shot gives: `bands` bands of `rows` rows, which begin at multiples of `cell`. */
struct plan {
    int bands, rows, cell;
    int threads;  // for the frames of a shot
};

static struct plan make_plan(int shots, int width, int height, const char *cfa)
{
    int cell = *cfa ? cap_cfa_side(cfa) : 2, least = ROWS_MIN * (*cfa ? cell : 1);
    struct plan plan = {.bands = (BANDS_MIN + shots - 1) / shots, .cell = cell, .threads = 1};
    plan.rows = PIXELS / shots / plan.bands / width / cell * cell;
    plan.rows = plan.rows > least ? plan.rows : least;
    if (plan.bands * plan.rows >= height)
        plan = (struct plan){1, height, cell, 1};
    return plan;
}

static void free_sample(struct bracket_sample *s)
{
    for (int f = 0; s->dn && f < s->frames; f++)
        free(s->dn[f]);
    free(s->dn);
    free(s->time);
    free(s->photo);
    *s = (struct bracket_sample){0};
}

/* An empty sample with room for so many photosites. false: no memory; to be freed all the same. */
static bool make_room(struct bracket_sample *s, int frames, size_t room, int shot)
{
    const size_t n = (size_t)frames;
    *s = (struct bracket_sample){.frames = frames, .shot = shot};
    s->time = calloc(n, sizeof *s->time);
    s->photo = calloc(n, sizeof *s->photo);
    s->dn = calloc(n, sizeof *s->dn);
    bool ok = s->time && s->photo && s->dn;
    for (size_t f = 0; ok && f < n; f++)
        ok = (s->dn[f] = malloc((room + 1) * sizeof **s->dn)) != NULL;
    return ok;
}

static bool make_sample(struct bracket_sample *s, const struct bracket *b, size_t room, int shot)
{
    bool ok = make_room(s, b->frames, room, shot);
    for (int f = 0; ok && f < b->frames; f++) {
        s->time[f] = b->time[f];
        s->photo[f] = b->photo[f];
    }
    return ok;
}

/* Sort the band's photosites into channels. */
static void append_band(struct bracket_sample *const s[3], const struct bracket *b, int rows,
                        const char *cfa)
{
    size_t pixels = (size_t)rows * (size_t)b->width, at[3] = {0};
    for (int f = 0; f < b->frames; f++) {
        for (int c = 0; c < 3; c++)
            at[c] = s[c]->photosites;
        if (b->channels == 3)
            for (size_t i = 0; i < pixels; i++)
                for (int c = 0; c < 3; c++)
                    s[c]->dn[f][at[c] + i] = b->dn[f][3 * i + (size_t)c];
        for (int y = 0; b->channels == 1 && y < rows; y++)
            for (int x = 0; x < b->width; x++) {
                int c = cap_cfa_channel(cfa, x, y);
                s[c]->dn[f][at[c]++] = b->dn[f][(size_t)y * b->width + x];
            }
    }
    for (int c = 0; c < 3; c++)
        s[c]->photosites = b->channels == 3 ? s[c]->photosites + pixels : at[c];
}

static enum status read_bands(struct bracket_sample *const s[3], struct bracket *b,
                              const struct plan *plan, int index, const char *cfa, int *bad)
{
    // Multiples of the golden ratio, modulo 1, spread evenly for any number of shots.
    double place = index * 0.6180339887498949;
    enum status status = STATUS_OK;
    for (int k = 0; k < plan->bands && !status; k++) {
        double at = (k + place - floor(place)) / plan->bands;
        int top = (int)(at * (b->height - plan->rows)) / plan->cell * plan->cell;
        status = bracket_seek(b, top, bad, NULL);
        if (!status)
            status = bracket_read(b, plan->rows, bad, NULL);
        if (!status)
            append_band(s, b, plan->rows, cfa);
    }
    return status;
}

/* Once, with the frames that are not to be skipped; on failure s[] are empty. */
static enum status try_shot(struct bracket_sample *const s[3], const struct bracket_choice *choice,
                            const struct plan *plan, int index, int *bad)
{
    struct bracket b = {0};
    enum status status = bracket_open(&b, choice, plan->rows, bad, NULL);
    b.threads = plan->threads;
    size_t room = (size_t)plan->bands * (size_t)plan->rows * (size_t)b.width;
    int shot = (int)(choice->shot - choice->capture->shot);
    for (int c = 0; c < 3 && !status; c++)
        if (!make_sample(s[c], &b, room, shot))
            status = STATUS_MEMORY;
    const char *cfa = choice->capture->photo[choice->shot->photo[0]].cfa;
    if (!status)
        status = read_bands(s, &b, plan, index, cfa, bad);
    for (int c = 0; c < 3 && (status || b.frames == 0); c++)
        free_sample(s[c]);
    bracket_close(&b);
    return status;
}

static void read_shot(struct bracket_sample *const s[3], const struct capture *capture,
                      const struct shot *shot, const double *seconds, const struct plan *plan,
                      int index)
{
    bool *skip = calloc((size_t)capture->photos, sizeof *skip);
    struct bracket_choice choice = {capture, shot, skip, seconds, NULL};
    for (bool again = skip != NULL; again;) {
        int bad = -1;
        again = try_shot(s, &choice, plan, index, &bad) != STATUS_OK && bad >= 0;
        if (again)
            skip[bad] = true;
    }
    free(skip);
}

static float brightest(const struct sample_set *set, int shots)
{
    float most = 0;
    for (int k = 0; k < 3 * shots; k++) {
        const struct bracket_sample *s = &set->channel[k % 3][k / 3];
        for (size_t i = 0; s->frames > 0 && i < s->photosites; i++)
            most = fmaxf(most, s->dn[s->frames - 1][i]);
    }
    return most;
}

/* Pairs of neighbouring frames that enough photosites compare: in the middle of the range in sum.
 */
static int count_telling(const struct sample_set *set, int shot, float white, bool encoded)
{
    int pairs = 0;
    for (int f = 1; f < set->channel[0][shot].frames; f++) {
        int count = 0;
        for (int c = 0; c < 3; c++) {
            const struct bracket_sample *s = &set->channel[c][shot];
            for (size_t i = 0; i < s->photosites; i++) {
                float a = s->dn[f - 1][i] / white, b = s->dn[f][i] / white;
                float sum = encoded ? a * a + b * b : a + b;  // sRGB is about a square
                count += sum > 0.15f && sum < 0.85f;
            }
        }
        pairs += count >= TELLING_MIN;
    }
    return pairs;
}

/* Shots to be read again, poor[]: those that tell less than others do. */
static bool find_poor(bool *poor, const struct sample_set *set, int shots, bool encoded)
{
    const float white = brightest(set, shots);
    int most = 0;
    bool any = false;
    for (int k = 0; k < shots; k++) {
        int telling = count_telling(set, k, white, encoded);
        most = telling > most ? telling : most;
    }
    for (int k = 0; k < shots; k++) {
        int frames = set->channel[0][k].frames, telling = count_telling(set, k, white, encoded);
        poor[k] = frames > 1 && telling < (most < frames ? most : frames - 1);
        any = any || poor[k];
    }
    return any;
}

/* Those of poor[], or all where it is NULL. */
static void read_shots(struct sample_set *set, const struct capture *capture, const int *shot,
                       int shots, const bool *poor, const double *seconds, const struct plan *plan,
                       int teams)
{
#pragma omp parallel for schedule(dynamic) num_threads(teams)
    for (int k = 0; k < shots; k++) {
        struct bracket_sample *const s[3] = {&set->channel[0][k], &set->channel[1][k],
                                             &set->channel[2][k]};
        if (poor && !poor[k])
            continue;
        for (int c = 0; c < 3; c++)
            free_sample(s[c]);
        read_shot(s, capture, &capture->shot[shot[k]], seconds, plan, k);
    }
}

enum status sample_read(struct sample_set *set, const struct capture *capture, int camera,
                        const double *seconds, const struct run *run, struct error *err)
{
    struct sample_set made = {0};
    int *shot = calloc((size_t)capture->shots, sizeof *shot), shots = 0;
    bool *poor = calloc((size_t)capture->shots, sizeof *poor), ok = shot && poor;
    for (int c = 0; c < 3; c++)
        ok = (made.channel[c] = calloc((size_t)capture->shots, sizeof *made.channel[c])) && ok;
    for (int s = 0; ok && s < capture->shots; s++)
        if (capture->shot[s].camera == camera)
            shot[shots++] = s;
    const struct camera_kind *kind = &capture->camera[camera];
    if (ok && shots > 0) {
        snprintf(made.cfa, sizeof made.cfa, "%s",
                 capture->photo[capture->shot[shot[0]].photo[0]].cfa);
        struct plan plan = make_plan(shots, kind->width, kind->height, made.cfa);
        made.width = kind->width;
        made.rows = plan.rows;
        // Frames of a mosaic are decoded at once, and large then: those of one shot at a time.
        int teams = *made.cfa ? 1 : shots < run->threads ? shots : run->threads;
        plan.threads = run->threads / teams;
        read_shots(&made, capture, shot, shots, NULL, seconds, &plan, teams);
        plan.bands *= MORE;
        bool encoded = capture->photo[capture->shot[shot[0]].photo[0]].encoded;
        bool curve =
            encoded && capture->response == RESPONSE_RECOVER;  // all shots tell it together
        if (!curve && plan.bands * plan.rows < kind->height
            && find_poor(poor, &made, shots, encoded))
            read_shots(&made, capture, shot, shots, poor, seconds, &plan, teams);
    }
    for (int k = 0; ok && k < shots; k++) {  // those that could be read move to the front
        if (made.channel[0][k].frames == 0)
            continue;
        for (int c = 0; c < 3 && made.samples < k; c++) {
            made.channel[c][made.samples] = made.channel[c][k];
            made.channel[c][k] = (struct bracket_sample){0};
        }
        made.samples++;
    }
    free(shot);
    free(poor);
    enum status status = STATUS_OK;
    if (!ok)
        status = cap_fail(err, STATUS_MEMORY, "%s", capture->folder);
    else if (made.samples == 0)
        status = cap_fail(err, STATUS_DATA, "%s: no shot can be read to find the sensor's levels",
                          capture->folder);
    if (status)
        sample_free(&made);
    else
        *set = made;
    return status;
}

static bool copy_sample(struct bracket_sample *to, const struct bracket_sample *from)
{
    bool ok = make_room(to, from->frames, from->photosites, from->shot);
    to->photosites = from->photosites;
    for (int f = 0; ok && f < from->frames; f++) {
        to->time[f] = from->time[f];
        to->photo[f] = from->photo[f];
        memcpy(to->dn[f], from->dn[f], from->photosites * sizeof **to->dn);
    }
    return ok;
}

bool sample_copy(struct sample_set *copy, const struct sample_set *set)
{
    struct sample_set made = *set;
    bool ok = true;
    for (int c = 0; c < 3; c++)
        ok = (made.channel[c] = calloc((size_t)set->samples, sizeof *made.channel[c])) && ok;
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < set->samples && ok; k++)
            ok = copy_sample(&made.channel[c][k], &set->channel[c][k]);
    if (ok)
        *copy = made;
    else
        sample_free(&made);
    return ok;
}

void sample_free(struct sample_set *set)
{
    for (int c = 0; c < 3; c++) {
        for (int k = 0; set->channel[c] && k < set->samples; k++)
            free_sample(&set->channel[c][k]);
        free(set->channel[c]);
    }
    *set = (struct sample_set){0};
}
