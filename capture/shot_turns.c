/* shot_turns.c -- lamps or cameras that take turns within a bracket; and doubts about shots.
 *
 * Where lamps take turns photograph by photograph, a b a b, each photograph begins a shot by the
 * rule of shots.c. Then the photographs of every lamp and camera are grouped by themselves; that is
 * taken where it gives brackets of one size everywhere.
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

bool shots_take_turns(int *shot_of, const struct capture *capture)
{
    size_t photos = (size_t)capture->photos;
    struct turns turns = {shot_of, calloc(photos, sizeof(int)), calloc(photos, sizeof(int)), 0, 0};
    bool ok = turns.first && turns.count;
    for (int i = 0; ok && i < capture->photos; i++)
        take_photo(&turns, capture, i);
    for (int k = 1; ok && k < turns.shots; k++)
        ok = turns.count[k] == turns.count[0];
    ok = ok && turns.open > 1 && turns.count[0] > 1;
    free(turns.first);
    free(turns.count);
    return ok;
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
