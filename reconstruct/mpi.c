/* mpi.c -- goniocam-mpi: `reconstruct` by several processes, under mpirun or srun.
 *
 * Method.   Shots are dealt by a thread of rank 0, one at a time: whoever is free asks for it. The
 *           thread looks for questions a thousand times a second, which costs nothing, while MPI's
 *           own waiting would cost a core. Only rank 0 calibrates, fits and writes the results;
 *           radiance maps are written by whoever makes them, so all need the same folder.
 * Failures. A member that fails says why through rank 0, and all end. A member that dies takes the
 *           others with it (MPI's own rule); maps that were finished are kept for the next run.
 */
#include "team.h"

#include <mpi.h>
#include <omp.h>
#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { TAG_ASK = 1, TAG_ANSWER, TAG_SIZE, TAG_DATA, STAGES_MAX = 8, ITEMS_MAX = 1 << 20 };

/** What rank 0 has dealt out. */
struct dealer {
    pthread_mutex_t mutex;  // of dealt
    pthread_t thread;
    unsigned char (*dealt)[ITEMS_MAX];  // [STAGES_MAX]
    bool stop;
};

/** A team over MPI. team comes first: a struct team * is a struct mpi_team *. */
struct mpi_team {
    struct team team;
    int stage;             // of this member
    cpu_set_t own, all;    // cores: this process's, and those of all on this machine
    pthread_mutex_t asks;  // one question at a time
    struct dealer dealer;
};

/* ---- dealing ----------------------------------------------------------------------------------
 */

static bool deal(struct dealer *dealer, int stage, int item)
{
    if (stage >= STAGES_MAX || item >= ITEMS_MAX)
        MPI_Abort(MPI_COMM_WORLD, 1);
    pthread_mutex_lock(&dealer->mutex);
    bool yes = !dealer->dealt[stage][item];
    dealer->dealt[stage][item] = 1;
    pthread_mutex_unlock(&dealer->mutex);
    return yes;
}

static void *deal_all(void *data)
{
    struct dealer *dealer = data;
    const struct timespec nap = {0, 1000000};
    for (bool stop = false; !stop;) {
        int there = 0, ask[2];
        MPI_Status from;
        MPI_Iprobe(MPI_ANY_SOURCE, TAG_ASK, MPI_COMM_WORLD, &there, &from);
        if (there) {
            MPI_Recv(ask, 2, MPI_INT, from.MPI_SOURCE, TAG_ASK, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
            int answer = deal(dealer, ask[0], ask[1]);
            MPI_Send(&answer, 1, MPI_INT, from.MPI_SOURCE, TAG_ANSWER, MPI_COMM_WORLD);
            continue;
        }
        nanosleep(&nap, NULL);
        pthread_mutex_lock(&dealer->mutex);
        stop = dealer->stop;
        pthread_mutex_unlock(&dealer->mutex);
    }
    return NULL;
}

static bool take(void *data, int item)
{
    struct mpi_team *t = data;
    if (t->team.rank == 0)
        return deal(&t->dealer, t->stage, item);
    int ask[2] = {t->stage, item}, answer = 0;
    pthread_mutex_lock(&t->asks);
    MPI_Send(ask, 2, MPI_INT, 0, TAG_ASK, MPI_COMM_WORLD);
    MPI_Recv(&answer, 1, MPI_INT, 0, TAG_ANSWER, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    pthread_mutex_unlock(&t->asks);
    return answer != 0;
}

static void next_stage(struct team *team)
{
    ((struct mpi_team *)team)->stage++;
}

/* ---- telling and hearing --------------------------------------------------------------------- */

enum { PIECE = 1 << 28 };  // MPI counts in int

static int piece(size_t left)
{
    return left < PIECE ? (int)left : PIECE;
}

// While rank 0 works alone the others wait, a hundred times a second instead of all the time.
static void wait_for_leader(const struct team *team)
{
    const struct timespec nap = {0, 10000000};
    MPI_Request request;
    int done = 0;
    MPI_Ibarrier(MPI_COMM_WORLD, &request);
    for (MPI_Test(&request, &done, MPI_STATUS_IGNORE); !done;
         MPI_Test(&request, &done, MPI_STATUS_IGNORE))
        nanosleep(&nap, NULL);
    (void)team;
}

static void tell(struct team *team, void *data, size_t size)
{
    wait_for_leader(team);
    for (size_t at = 0; at < size; at += (size_t)piece(size - at))
        MPI_Bcast((char *)data + at, piece(size - at), MPI_BYTE, 0, MPI_COMM_WORLD);
}

static void hear_one(int rank, void (*heard)(void *context, const void *data, size_t size),
                     void *context)
{
    unsigned long long size = 0;
    MPI_Recv(&size, 1, MPI_UNSIGNED_LONG_LONG, rank, TAG_SIZE, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    char *data = malloc(size + 1);
    if (!data) {
        fprintf(stderr, "goniocam: no memory for %llu bytes of rank %d\n", size, rank);
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    for (size_t at = 0; at < size; at += (size_t)piece(size - at))
        MPI_Recv(data + at, piece(size - at), MPI_BYTE, rank, TAG_DATA, MPI_COMM_WORLD,
                 MPI_STATUS_IGNORE);
    heard(context, data, size);
    free(data);
}

static void hear(struct team *team, const void *data, size_t size,
                 void (*heard)(void *context, const void *data, size_t size), void *context)
{
    wait_for_leader(team);
    if (team->rank == 0) {
        if (data)
            heard(context, data, size);
        for (int rank = 1; rank < team->ranks; rank++)
            hear_one(rank, heard, context);
        return;
    }
    unsigned long long bytes = size;
    MPI_Send(&bytes, 1, MPI_UNSIGNED_LONG_LONG, 0, TAG_SIZE, MPI_COMM_WORLD);
    for (size_t at = 0; at < size; at += (size_t)piece(size - at))
        MPI_Send((const char *)data + at, piece(size - at), MPI_BYTE, 0, TAG_DATA, MPI_COMM_WORLD);
}

/* ---- beginning and end ----------------------------------------------------------------------- */

static bool begin(struct mpi_team *t)
{
    *t = (struct mpi_team){
        .team = {.next_stage = next_stage, .take = take, .tell = tell, .hear = hear}};
    MPI_Comm_rank(MPI_COMM_WORLD, &t->team.rank);
    MPI_Comm_size(MPI_COMM_WORLD, &t->team.ranks);
    pthread_mutex_init(&t->asks, NULL);
    if (t->team.rank != 0)
        return true;
    pthread_mutex_init(&t->dealer.mutex, NULL);
    t->dealer.dealt = calloc(STAGES_MAX, sizeof *t->dealer.dealt);
    return t->dealer.dealt && pthread_create(&t->dealer.thread, NULL, deal_all, &t->dealer) == 0;
}

static void end(struct mpi_team *t)
{
    wait_for_leader(&t->team);
    if (t->team.rank != 0)
        return;
    pthread_mutex_lock(&t->dealer.mutex);
    t->dealer.stop = true;
    pthread_mutex_unlock(&t->dealer.mutex);
    pthread_join(t->dealer.thread, NULL);
    free(t->dealer.dealt);
}

// mpirun may have bound each process to cores of its own.
static void alone(struct team *team, bool begins)
{
    const struct mpi_team *t = (const struct mpi_team *)team;
    sched_setaffinity(0, sizeof t->all, begins ? &t->all : &t->own);
}

// The processes of one machine share its cores, unless mpirun gave each its own.
static void share_cores(struct mpi_team *t)
{
    MPI_Comm machine;
    int members = 1, cores = omp_get_num_procs();
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    MPI_Comm_size(machine, &members);
    if (sched_getaffinity(0, sizeof t->own, &t->own) == 0) {
        MPI_Allreduce(&t->own, &t->all, sizeof t->own, MPI_BYTE, MPI_BOR, machine);
        t->team.alone = alone;
    }
    t->team.neighbours = members;
    MPI_Comm_free(&machine);
    if (cores == sysconf(_SC_NPROCESSORS_ONLN))
        rec_team_threads = cores > members ? cores / members : 1;
}

static const struct command *reconstruct_command(void)
{
    const struct command *c = rec_commands;
    while (strcmp(c->name, "reconstruct") != 0)
        c++;
    return c;
}

static int run(int argc, char **argv, bool leads)
{
    const struct command *command = reconstruct_command();
    struct arguments args;
    struct error err = {0};
    if (argc < 2 || strcmp(argv[1], command->name) != 0)
        cap_fail(&err, STATUS_DATA, "the one command is %s", command->name);
    else if (cap_arguments_parse(&args, command, argc - 1, argv + 1, &err)
             && !cap_option(&args, "help")) {
        int code = command->run(&args);
        if (code != 2)
            return code;
    }
    if (leads && err.text[0])
        fprintf(stderr, "goniocam-mpi: %s\n", err.text);
    if (leads)
        fprintf(stderr, "usage: mpirun -n RANKS goniocam-mpi %s %s\n", command->name,
                command->arguments);
    return 2;
}

int main(int argc, char **argv)
{
    static struct mpi_team team;
    int level;
    MPI_Init_thread(&argc, &argv, MPI_THREAD_MULTIPLE, &level);
    if (level < MPI_THREAD_MULTIPLE || !begin(&team)) {
        fprintf(stderr, "goniocam-mpi: this MPI allows no threads, or there is no memory\n");
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    share_cores(&team);
    rec_team = &team.team;
    int code = run(argc, argv, team.team.rank == 0);
    end(&team);
    MPI_Finalize();
    return code;
}
