/* team.c -- several processes at one job: what they tell each other.
 *
 * Members run the same program on machines of the same kind, so values travel as they are in
 * memory; pointers travel as what they point to.
 */
#include "team.h"

#include "lookup.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

struct team *rec_team = NULL;
int rec_team_threads = 0;

static void tell(void *data, size_t size)
{
    if (size > 0)
        rec_team->tell(rec_team, data, size);
}

void rec_team_tell(void *data, size_t size)
{
    if (rec_team)
        tell(data, size);
}

/* ---- agreement ------------------------------------------------------------------------------- */

static void first_failure(void *context, const void *data, size_t size)
{
    struct error *all = context, one;
    if (size != sizeof one)
        return;
    memcpy(&one, data, size);
    if (!all->status)
        *all = one;
}

enum status rec_team_agree(enum status status, struct error *err)
{
    if (!rec_team)
        return status;
    struct error mine = {0}, all = {0};
    if (status)
        cap_fail(&mine, status, "%s", err ? err->text : "");
    rec_team->hear(rec_team, &mine, sizeof mine, first_failure, &all);
    tell(&all, sizeof all);
    return all.status ? cap_fail(err, all.status, "%s", all.text) : STATUS_OK;
}

static void tell_all(void *team, void *data, size_t size)
{
    (void)team;
    tell(data, size);
}

void rec_team_next_stage(struct run *run)
{
    if (!rec_team)
        return;
    rec_team->next_stage(rec_team);
    run->take = rec_team->take;
    run->tell = tell_all;
    run->alone = rec_team_alone;
    run->follows = !rec_leads();
    run->team = rec_team;
}

void rec_team_alone(struct run *run, bool begins)
{
    if (!rec_team || !rec_leads() || !rec_team->alone)
        return;
    rec_team->alone(rec_team, begins);
    run->threads =
        begins ? run->threads * rec_team->neighbours : run->threads / rec_team->neighbours;
    omp_set_num_threads(run->threads);
}

struct flags {
    bool *flag;
    int count;
};

static void any(void *context, const void *data, size_t size)
{
    struct flags *all = context;
    const bool *flag = data;
    for (int i = 0; i < all->count && size == (size_t)all->count * sizeof *flag; i++)
        all->flag[i] = all->flag[i] || flag[i];
}

void rec_team_any(bool *flag, int count)
{
    struct flags all = {flag, count};
    if (rec_team)
        rec_team->hear(rec_team, flag, (size_t)count * sizeof *flag, any, &all);
}

static void add_warnings(void *run, const void *texts, size_t size)
{
    for (const char *text = texts, *end = text + size; text < end; text += strlen(text) + 1)
        cap_warned(run, text);
}

void rec_team_hear_warnings(struct run *run)
{
    if (!rec_team)
        return;
    size_t size = 0, at = 0;
    for (int i = 0; i < run->warnings; i++)
        size += strlen(run->warning[i]) + 1;
    char *texts = malloc(size + 1);
    for (int i = 0; texts && i < run->warnings; at += strlen(run->warning[i++]) + 1)
        strcpy(texts + at, run->warning[i]);
    rec_team->hear(rec_team, texts, at, add_warnings, run);
    free(texts);
}

/* ---- the calibration --------------------------------------------------------------------------
 */

// An array of the leader's, at *array; the others get room for it. false: no memory here.
static bool tell_array(void **array, size_t count, size_t size)
{
    if (!rec_leads())
        *array = calloc(count + 1, size);
    size_t here = *array != NULL || count == 0, least = here;
    // A member without memory still takes part: it hears into nothing.
    void *room = *array ? *array : malloc(count * size + 1);
    if (!room)
        abort();  // not even for that: the team cannot go on
    tell(room, count * size);
    if (room != *array)
        free(room);
    return least;
}

static bool tell_text(char **text)
{
    size_t size = rec_leads() && *text ? strlen(*text) + 1 : 0;
    tell(&size, sizeof size);
    if (!rec_leads())
        *text = NULL;  // the leader's address
    return size == 0 || tell_array((void **)text, size, 1);
}

static bool tell_names(struct calibration *c)
{
    bool ok = true;
    for (int i = 0; i < c->cameras; i++)
        ok = tell_text(&c->camera[i].name) && ok;
    for (int i = 0; i < c->lamps; i++)
        ok = tell_text(&c->lamp[i].name) && ok;
    for (int i = 0; i < c->views; i++) {
        ok = tell_text(&c->view[i].name) && ok;
        if (!rec_leads()) {
            c->view[i].tag = NULL;
            c->view[i].tags = 0;
        }
    }
    return ok;
}

enum status rec_team_tell_calibration(struct calibration *calibration, struct error *err)
{
    if (!rec_team)
        return STATUS_OK;
    struct calibration c = *calibration;
    tell(&c, sizeof c);
    size_t glow = (size_t)c.lamps * (size_t)c.surroundings.count;
    bool ok = tell_array((void **)&c.camera, (size_t)c.cameras, sizeof *c.camera);
    ok = tell_array((void **)&c.view, (size_t)c.views, sizeof *c.view) && ok;
    ok = tell_array((void **)&c.lamp, (size_t)c.lamps, sizeof *c.lamp) && ok;
    ok = tell_array((void **)&c.surroundings.glow, glow, sizeof *c.surroundings.glow) && ok;
    ok = tell_array((void **)&c.tag, (size_t)c.tags, sizeof *c.tag) && ok;
    ok = tell_text(&c.family) && ok;
    ok = tell_text(&c.sample.file) && ok;
    enum status status = rec_team_agree(
        ok ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for the calibration"), err);
    if (!status && !tell_names(&c))
        status = cap_fail(err, STATUS_MEMORY, "no memory for the calibration");
    if (!rec_leads())
        c.sample.mesh = NULL;  // the leader's address
    if (!status && !rec_leads() && c.sample.shape == SHAPE_MESH)
        status = cal_sample_load(&c.sample, err);
    if (!rec_leads())
        *calibration = c;
    return rec_team_agree(status, err);
}

/* ---- the consensus ----------------------------------------------------------------------------
 */

enum status rec_team_tell_consensus(struct consensus *consensus, struct fit *fit, struct error *err)
{
    if (!rec_team)
        return STATUS_OK;
    struct consensus c = *consensus;
    char model[64] = "";
    if (rec_leads()) {
        *fit = *c.fit;
        snprintf(model, sizeof model, "%s", fit->model->name);
    }
    tell(&c.bounce_scatter, sizeof c.bounce_scatter);
    tell(&c.bounce_caution, sizeof c.bounce_caution);
    tell(fit, sizeof *fit);
    tell(model, sizeof model);
    fit->model = rec_model_find(model);
    c.fit = fit;
    tell(&c.bins, sizeof c.bins);
    bool ok = tell_array((void **)&c.slot, MERL_BINS, sizeof *c.slot);
    ok = tell_array((void **)&c.say, (size_t)c.bins, sizeof *c.say) && ok;
    size_t tables = c.table != NULL;
    tell(&tables, sizeof tables);
    c.table = rec_leads() ? c.table : NULL;
    ok = tell_array((void **)&c.table, tables, rec_lookup_size()) && ok;
    *consensus = c;
    return rec_team_agree(
        ok ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "no memory for the bins' neighbours"), err);
}

/* ---- sums -------------------------------------------------------------------------------------
 */

/** How a tally travels: the census, then as many of these as there are bins. Of mosaics, each is
 *  followed by its mosaic_sums. */
struct parcel {
    int32_t bin, mosaic;
    struct bin_sums sums;
};

struct sum {
    struct tally *tally;
    struct census *census;
    enum status status;
};

static void add_parcels(void *context, const void *data, size_t size)
{
    struct sum *to = context;
    struct census census;
    memcpy(&census, data, sizeof census);
    rec_census_add(to->census, &census);
    const char *at = (const char *)data + sizeof census, *end = (const char *)data + size;
    while (at < end && !to->status) {
        struct parcel parcel;
        struct mosaic_sums mosaic;
        memcpy(&parcel, at, sizeof parcel);
        at += sizeof parcel;
        if (parcel.mosaic) {
            memcpy(&mosaic, at, sizeof mosaic);
            at += sizeof mosaic;
        }
        to->status = rec_tally_add_sums(to->tally, parcel.bin, &parcel.sums,
                                        parcel.mosaic ? &mosaic : NULL, NULL);
    }
}

static char *pack(size_t *size, const struct tally *tally, const struct census *census)
{
    const size_t more = tally->mosaic ? sizeof *tally->mosaic : 0;
    *size = sizeof *census + (size_t)tally->count * (sizeof(struct parcel) + more);
    char *data = calloc(1, *size), *at = data ? data + sizeof *census : NULL;
    if (!data)
        return NULL;
    memcpy(data, census, sizeof *census);
    for (int bin = 0; tally->slot && bin < rec_grid_bins(tally->grid); bin++)
        if (tally->slot[bin]) {
            struct parcel parcel = {bin, more > 0, tally->sums[tally->slot[bin] - 1]};
            memcpy(at, &parcel, sizeof parcel);
            at += sizeof parcel;
            if (more)
                memcpy(at, rec_tally_mosaic(tally, bin), more);
            at += more;
        }
    return data;
}

enum status rec_team_sum(struct tally *tally, struct census *census, struct error *err)
{
    if (!rec_team)
        return STATUS_OK;
    size_t size = 0;
    char *data = rec_leads() ? NULL : pack(&size, tally, census);
    enum status status = STATUS_OK;
    if (!rec_leads() && !data)
        status = cap_fail(err, STATUS_MEMORY, "no memory to hand over %d bins", tally->count);
    status = rec_team_agree(status, err);
    if (!status) {
        struct sum sum = {tally, census, STATUS_OK};
        rec_team->hear(rec_team, data, size, add_parcels, &sum);
        if (sum.status)
            status = cap_fail(err, sum.status, "no memory for all members' bins");
    }
    free(data);
    return rec_team_agree(status, err);
}
