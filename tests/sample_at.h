/* sample_at.h -- one photosite's sample, for tests: a strip of which only it is looked at. */
#ifndef GONIOCAM_SAMPLE_AT_H
#define GONIOCAM_SAMPLE_AT_H

#include "strip.h"

static inline struct strip strip_at(int x, int y)
{
    int lane = x % LANES;
    return (struct strip){.x0 = x - lane, .y = y, .from = lane, .to = lane + 1};
}

/** Its fate; *sample is set where it is used. */
static inline enum fate sample_at(reflectance_sample *sample, const struct viewing *viewing,
                                  const struct radiance *map, int x, int y, bool *hit)
{
    struct strip s = strip_at(x, y);
    rec_strip_make(&s, viewing, map);
    *hit = s.hit[x % LANES];
    *sample = rec_strip_sample(&s, x % LANES);
    return s.fate[x % LANES];
}

#endif
