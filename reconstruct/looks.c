/* looks.c -- the photosites of all shots, looked at until what they say of each other settles.
 *
 * Method.   The first look takes photosites as they come; what its bins say of their neighbours
 *           (consensus.c) tells strays and true scatter in the next. Where the lit board shines on
 *           the sample, each look also predicts that light through the table that the look before
 *           it found, filled by the best fit, and takes it out: until no bin changes by more than
 *           a part of its sigma. Whether it is there at all, where calib could not see it,
 *           the samples tell (bounce_strength.c), and how well it is known.
 */
#include "looks.h"

#include "lookup.h"
#include "quantile.h"
#include "team.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LOOKS_MAX = 5 };
static const double SHARPER = 0.9;   // a sigma less than this part is worth a look
static const double SETTLED = 0.25;  // of a bin's sigma: 95 % of the bins change by less

static enum status gather(struct job *j, const char *stage, const struct consensus *consensus,
                          struct samples_file *samples, struct error *err)
{
    struct board_extent board;
    bool has_board = rec_job_board(&board, j);
    cap_stage(j->run, stage, j->calibration.views);
    rec_team_next_stage(j->run);
    bool fine = consensus && j->fine.grid.theta_h > 0;
    return rec_gather(&j->bins, fine ? &j->fine : NULL, &j->census, &j->calibration,
                      has_board ? &board : NULL, &j->blockers, consensus, samples, j->out, j->run,
                      err);
}

// samples.h5; of a member that does not lead, its part of it.
static char *samples_path(const struct job *j, int rank)
{
    char name[40];
    snprintf(name, sizeof name, rank ? "samples.h5.part%d" : "samples.h5", rank);
    return cap_path(j->out, name);
}

// The members' parts, once they are complete.
static enum status join_samples(const struct job *j, struct samples_file *samples,
                                struct error *err)
{
    enum status status = STATUS_OK;
    for (int rank = 1; rec_team && rank < rec_team->ranks && !status; rank++) {
        char *path = samples_path(j, rank);
        status = path ? rec_samples_adopt(samples, path, err)
                      : cap_fail(err, STATUS_MEMORY, "no memory for a path");
        free(path);
    }
    return status;
}

// The last look: its samples are kept in samples.h5 where that is asked for.
static enum status gather_kept(struct job *j, const struct consensus *consensus, struct error *err)
{
    struct samples_file samples;
    if (!j->keep_samples)
        return gather(j, "samples again", consensus, NULL, err);
    char *path = samples_path(j, rec_team ? rec_team->rank : 0);
    enum status status = path ? rec_samples_begin(&samples, path, err)
                              : cap_fail(err, STATUS_MEMORY, "no memory for a path");
    const bool begun = !status;
    free(path);
    status = rec_team_agree(status, err);
    if (!status)
        status = gather(j, "samples again", consensus, &samples, err);
    struct error story = {0};
    if (begun && !rec_leads() && rec_samples_end(&samples, !status, &story) && !status)
        status = cap_fail(err, story.status, "%s", story.text);
    status = rec_team_agree(status, err);
    if (!status && rec_leads())
        status = join_samples(j, &samples, err);
    if (begun && rec_leads() && rec_samples_end(&samples, !status, &story) && !status)
        status = cap_fail(err, story.status, "%s", story.text);
    return rec_team_agree(status, err);
}

static bool board_shines(const struct job *j)
{
    return j->calibration.surroundings.count > 0 && j->calibration.surroundings.strength > 0;
}

// The table of the bins so far, ready to be evaluated in all directions.
static enum status make_table(struct lookup **table, const struct job *j, struct error *err)
{
    struct merl merl = {0};
    enum status status = rec_fill(&merl, NULL, &j->bins, &j->fits.fit[0], j->run, err);
    if (!status)
        status = rec_lookup_make(table, &merl, err);
    rec_merl_free(&merl);
    return status;
}

// The leader's: what the bins of a look say. The fit stays where it is in j->fits: the consensus is
// relative to it.
static enum status learn(struct job *j, struct consensus *consensus, const double strength[2],
                         double caution, int look, struct error *err)
{
    enum status status;
    rec_consensus_free(consensus);
    cap_stage(j->run, "fit", 0);
    // Bins that hold the board's light may ask for another model than f alone.
    if (look == 1)
        rec_fits_free(&j->fits);
    if (j->fits.count > 0) {
        rec_bins_align(&j->bins, &j->fits.fit[0]);
        status = rec_fit_again(&j->fits, &j->bins, j->run, err);
    } else {
        status = rec_fit(&j->fits, &j->bins, NULL, 0, j->run, err);
    }
    if (status)
        return status;
    rec_bins_align(&j->bins, &j->fits.fit[0]);
    rec_bins_widen(&j->bins, &j->fits.fit[0]);
    status = rec_consensus_make(consensus, &j->bins, &j->fits.fit[0], strength, j->run, err);
    consensus->bounce_caution = caution;
    if (!status && board_shines(j))
        status = make_table(&consensus->table, j, err);
    return status;
}

// By what, in sigmas, 95 % of the bins that both looks measured changed less.
static double change(const struct bins *before, const struct bins *after)
{
    double *z = malloc((3 * (size_t)after->count + 1) * sizeof *z), typical = 0;
    int n = 0;
    for (int i = 0, k = 0; z && i < after->count; i++) {
        const struct bin *b = &after->bin[i];
        while (k < before->count && before->bin[k].index < b->index)
            k++;
        if (k == before->count || before->bin[k].index != b->index)
            continue;
        for (int c = 0; c < 3; c++)
            if (b->sigma[c] > 0)
                z[n++] = fabs(b->mean[c] - before->bin[k].mean[c]) / b->sigma[c];
    }
    if (n > 0)
        typical = rec_quantile(z, n, 0.95);
    free(z);
    return typical;
}

// Where calib had to take for granted that the board shines, samples may tell that it does not, as
// in renderings of direct light alone. true: it was changed.
static bool weigh_board(struct job *j)
{
    struct surroundings *s = &j->calibration.surroundings;
    if (s->told || s->strength <= rec_bounce_least
        || !rec_trend_none(&j->census.trend, s->strength))
        return false;
    s->strength = s->sigma_strength = rec_bounce_least;
    return true;
}

// Calib's sigma is of what it could not see, the lobe's peak among it. Samples from all sides of
// the board may show that less is wrong. true: much less.
static bool trust_board(struct job *j)
{
    struct surroundings *s = &j->calibration.surroundings;
    const double sigma = rec_trend_sigma(&j->census.trend, s->strength);
    if (!(sigma < SHARPER * s->sigma_strength))
        return false;
    s->sigma_strength = sigma;
    return true;
}

static void tell_board(struct job *j)
{
    struct surroundings *s = &j->calibration.surroundings;
    bounce_strength now = {s->strength, s->sigma_strength};
    rec_team_tell(&now, sizeof now);
    s->strength = now.strength;
    s->sigma_strength = now.sigma;
}

// The leader's: learn from the last look, and is another one needed?
static enum status study(struct job *j, struct consensus *consensus, struct bins *before, int look,
                         double caution, bool *more, struct error *err)
{
    double strength[2] = {j->calibration.surroundings.strength};
    // The bins that samples were compared with had that light taken out as the samples had.
    const bool compared = look > (j->calibration.surroundings.has_lobe ? 0 : 1) && board_shines(j);
    bool changed = compared && weigh_board(j);
    if (compared && !changed)
        changed = trust_board(j);
    *more =
        look == 0
        || (look < LOOKS_MAX && board_shines(j) && (changed || change(before, &j->bins) > SETTLED));
    if (!*more)
        return STATUS_OK;
    strength[1] = j->calibration.surroundings.strength;
    enum status status = learn(j, consensus, strength, caution, look, err);
    rec_bins_free(before);
    *before = j->bins;
    j->bins = (struct bins){0};
    return status;
}

static enum status look(struct job *j, const struct consensus *consensus, bool last,
                        struct error *err)
{
    const struct grid grid = j->fine.grid;
    rec_bins_free(&j->fine);
    rec_bins_free(&j->bins);
    j->fine.grid = grid;
    return last ? gather_kept(j, consensus, err)
                : gather(j, consensus ? "samples again" : "samples", consensus, NULL, err);
}

enum status rec_looks(struct job *j, struct error *err)
{
    struct consensus consensus = {0};
    struct fit fit;
    struct bins before = {0};
    bool more = true, kept = false, lit = board_shines(j);
    const struct surroundings *s = &j->calibration.surroundings;
    const double caution = s->strength > 0 ? s->sigma_strength / s->strength : 0;
    enum status status = look(j, NULL, false, err);
    for (int k = 0; !status && more; k++) {
        rec_team_alone(j->run, true);
        if (rec_leads())
            status = study(j, &consensus, &before, k, caution, &more, err);
        rec_team_alone(j->run, false);
        status = rec_team_agree(status, err);
        rec_team_tell(&more, sizeof more);
        tell_board(j);
        if (!status && more && !rec_leads())
            rec_consensus_free(&consensus);
        if (!status && more)
            status = rec_team_tell_consensus(&consensus, &fit, err);
        kept = !lit;  // one look is enough, and it is this
        if (!status && more)
            status = look(j, &consensus, kept, err);
        more = more && lit;
    }
    if (!status && !kept && j->keep_samples)
        status = look(j, &consensus, true, err);
    rec_consensus_free(&consensus);
    rec_bins_free(&before);
    return status;
}
