/* team.h -- several processes at one job: who they are, and what they tell each other.
 *
 * Every member runs the same program, rec_reconstruct(): shots are dealt out one by one as members
 * become free, the leader (rank 0) alone calibrates, fits and writes. Functions without a team
 * (NULL, the usual case) do nothing and say that this process leads.
 */
#ifndef GONIOCAM_TEAM_H
#define GONIOCAM_TEAM_H

#include "bins.h"
#include "consensus.h"
#include "gather.h"

/** A team, by whoever connects its members (mpi.c; tests). All members call in the same order. */
struct team {
    int rank, ranks;
    int neighbours;  // members on this machine, itself too
    /** Deal the items of the next stage anew. */
    void (*next_stage)(struct team *team);
    /** Is this item of the stage mine? Once yes in all the team. Any thread. */
    bool (*take)(void *team, int item);
    /** The leader's bytes to all. */
    void (*tell)(struct team *team, void *data, size_t size);
    /** Every member's bytes to the leader, which hears them one after another. */
    void (*hear)(struct team *team, const void *data, size_t size,
                 void (*heard)(void *context, const void *data, size_t size), void *context);
    /** The leader's turn alone begins or ends: its neighbours' cores are its own until then. */
    void (*alone)(struct team *team, bool begins);
};

/** The team of this process: NULL, but for goniocam-mpi. */
extern struct team *rec_team;

/** Threads of this process where --threads does not say: 0, one a core. */
extern int rec_team_threads;

static inline bool rec_leads(void)
{
    return !rec_team || rec_team->rank == 0;
}

/** Every member's status and story become those of the first that failed. */
enum status rec_team_agree(enum status status, struct error *err);
/** The items of a new stage are to be dealt. */
void rec_team_next_stage(struct run *run);
/** The leader works alone from here, with the threads of its neighbours; or no longer. */
void rec_team_alone(struct run *run, bool begins);
/** flag [count] of the leader: set where any member's is. */
void rec_team_any(bool *flag, int count);
/** Whatever members warned of stands in the leader's list too. */
void rec_team_hear_warnings(struct run *run);
/** The leader's calibration, without tags, to all; the others' must be empty. STATUS_MEMORY. */
enum status rec_team_tell_calibration(struct calibration *calibration, struct error *err);
/** The leader's bytes become all members'. */
void rec_team_tell(void *data, size_t size);
/** The leader's consensus and its fit to all. *fit is room for the fit. STATUS_MEMORY. */
enum status rec_team_tell_consensus(struct consensus *consensus, struct fit *fit,
                                    struct error *err);
/** Add all members' sums to the leader's. STATUS_MEMORY. */
enum status rec_team_sum(struct tally *tally, struct census *census, struct error *err);

#endif
