/* shot_turns.c -- lamps or cameras that take turns within a bracket, brackets with an exposure too
 * many or too few; and doubts about shots.
 *
 * Where lamps take turns photograph by photograph, a b a b, each photograph begins a shot by the
 * rule of shots.c. Then the photographs of every lamp and camera are grouped by themselves; that is
 * taken where it gives brackets of one size nearly everywhere.
 *
 * One exposure that was repeated, or is missing, shifts all brackets behind it by that rule: shots
 * would be made of two views. Their exposures then come in turned orders, 1 2 0 for 0 1 2. Where
 * that is so, a bracket begins where its order falls back, in the order that gives most whole ones.
 */
#include "shots.h"

#include <stdlib.h>
#include <string.h>

/* Groups under construction: the shot of each photograph. */
struct turns {
    int *shot_of;  // [photos]
    int *first;    // [photos] first photograph of the open shot of each lamp and camera
    int *count;    // [photos] photographs of each shot
    int shots, open;
};

static bool time_repeats(const struct turns *turns, const struct capture *capture, int shot, int i)
{
    for (int k = 0; k < i; k++)
        if (turns->shot_of[k] == shot
            && shots_same_times(capture->photo[k].exposure_time, capture->photo[i].exposure_time))
            return true;
    return false;
}

static void take_photo(struct turns *turns, const struct capture *capture, int i)
{
    int key = 0;
    while (key < turns->open
           && shots_difference(&capture->photo[turns->first[key]], &capture->photo[i]))
        key++;
    bool fresh = key == turns->open;
    int shot = fresh ? 0 : turns->shot_of[turns->first[key]];
    if (fresh || time_repeats(turns, capture, shot, i)) {
        shot = turns->shots++;
        turns->first[key] = i;
        turns->open += fresh;
    }
    turns->shot_of[i] = shot;
    turns->count[shot]++;
}

/* The count that most shots have. */
static int usual_of(const int *count, int shots)
{
    int usual = 0, most = 0;
    for (int k = 0; k < shots; k++) {
        int same = 0;
        for (int j = 0; j < shots; j++)
            same += count[j] == count[k];
        if (same > most) {
            most = same;
            usual = count[k];
        }
    }
    return usual;
}

bool shots_take_turns(int *shot_of, const struct capture *capture)
{
    size_t photos = (size_t)capture->photos;
    struct turns turns = {shot_of, calloc(photos, sizeof(int)), calloc(photos, sizeof(int)), 0, 0};
    bool ok = turns.first && turns.count;
    for (int i = 0; ok && i < capture->photos; i++)
        take_photo(&turns, capture, i);
    int usual = ok ? usual_of(turns.count, turns.shots) : 0, others = 0;
    for (int k = 0; ok && k < turns.shots; k++)
        others += turns.count[k] != usual;
    ok = ok && turns.open > 1 && usual > 1 && 4 * others <= turns.shots;
    free(turns.first);
    free(turns.count);
    return ok;
}

enum { ORDER_MAX = 64 };

/* The exposure times of a bracket, in the order in which they are taken. */
struct order {
    double time[ORDER_MAX];
    int count;
};

static double time_of(const struct capture *capture, const struct shot *shot, int k)
{
    return capture->photo[shot->photo[k]].exposure_time;
}

static bool has_order(const struct capture *capture, const struct shot *shot,
                      const struct order *order)
{
    bool same = shot->photos == order->count;
    for (int k = 0; k < shot->photos && same; k++)
        same = shots_same_times(time_of(capture, shot, k), order->time[k]);
    return same;
}

/* The order of the exposures that most shots have; *others: of as many exposures, another one. */
static struct order usual_order(const struct capture *capture, int *others)
{
    struct order usual = {.count = 0};
    int most = 0, as_many = 0;
    for (int s = 0; s < capture->shots; s++) {
        const struct shot *shot = &capture->shot[s];
        struct order order = {.count = shot->photos};
        if (shot->photos < 2 || shot->photos > ORDER_MAX)
            continue;
        for (int k = 0; k < shot->photos; k++)
            order.time[k] = time_of(capture, shot, k);
        int same = 0;
        for (int j = 0; j < capture->shots; j++)
            same += has_order(capture, &capture->shot[j], &order);
        if (same > most) {
            most = same;
            usual = order;
        }
    }
    for (int s = 0; s < capture->shots; s++)
        as_many += capture->shot[s].photos == usual.count;
    *others = as_many - most;
    return usual;
}

static int place_in(const struct order *order, int turned, double time)
{
    for (int k = 0; k < order->count; k++)
        if (shots_same_times(time, order->time[(k + turned) % order->count]))
            return k;
    return -1;
}

/* Brackets that begin where the order, turned by so many, falls back; returns how many have not
 * all exposures. */
static int split_by(int *shot_of, int *shots, const struct capture *capture,
                    const struct order *order, int turned)
{
    int last = -1, seen = 0, broken = 0;
    *shots = 0;
    for (int i = 0; i < capture->photos; i++) {
        const struct photo *photo = &capture->photo[i];
        int place = place_in(order, turned, photo->exposure_time);
        if (i == 0 || shots_difference(&capture->photo[i - 1], photo)
            || (place >= 0 && place < last)) {
            broken += i > 0 && seen < order->count;
            ++*shots;
            last = -1;
            seen = 0;
        }
        seen += place > last;
        last = place > last ? place : last;
        shot_of[i] = *shots - 1;
    }
    return broken + (seen < order->count);
}

bool shots_fall_back(int *shot_of, const struct capture *capture)
{
    int others, shots, broken = 0, best = -1, least = 0;
    const struct order order = usual_order(capture, &others);
    for (int i = 0; i < capture->photos; i++)
        if (capture->photo[i].missing || capture->photo[i].shot < 0)
            return false;  // one that cannot be read has kept its turn already
    for (int s = 0; s < capture->shots; s++)
        broken += capture->shot[s].photos != order.count;
    if (others == 0 || order.count < 2)
        return false;
    for (int turned = 0; turned < order.count; turned++) {
        int now = split_by(shot_of, &shots, capture, &order, turned);
        if (best < 0 || now < least) {
            best = turned;
            least = now;
        }
    }
    split_by(shot_of, &shots, capture, &order, best);
    return least <= broken;
}

/* The size that more than half of the shots have; 0: none. */
static int usual_count(const struct capture *capture)
{
    for (int k = 0; k < capture->shots; k++) {
        int same = 0;
        for (int j = 0; j < capture->shots; j++)
            same += capture->shot[j].photos == capture->shot[k].photos;
        if (2 * same > capture->shots)
            return capture->shot[k].photos;
    }
    return 0;
}

void shots_warn(const struct capture *capture, struct run *run)
{
    int usual = usual_count(capture), backwards = 0;
    for (int k = 0; k < capture->shots && usual > 0; k++)
        if (capture->shot[k].photos != usual)
            cap_warn(run,
                     "shot %s has %d photographs where most have %d: is an exposure missing, or "
                     "one too many?",
                     capture->shot[k].name, capture->shot[k].photos, usual);
    for (int k = 0; k < capture->shots; k++)
        for (int i = 1; i < capture->shot[k].photos; i++) {
            const struct photo *a = &capture->photo[capture->shot[k].photo[i - 1]];
            const struct photo *b = &capture->photo[capture->shot[k].photo[i]];
            // "2026:11:22 10:00:00" orders as text.
            backwards += *a->taken && *b->taken && strcmp(b->taken, a->taken) < 0;
        }
    if (backwards > 0)
        cap_warn(run,
                 "%d photographs were taken before the one whose name comes first: names decide; "
                 "look whether the brackets are right (merge --dry-run)",
                 backwards);
}
