/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/shorten/variants.h"
#include "base/memory.h"
#include <string.h>

/* The bytes of all motions, then those of all closures, then two. */
static size_t motion_ways(const kempe_model *model)
{
    return 5 * (size_t)model->motion_count;
}

static size_t all_ways(const kempe_model *model)
{
    return motion_ways(model) + 4 * (size_t)model->closure_count + 2;
}

bool kmp_ways_init(kmp_ways *ways, const kempe_model *model)
{
    size_t n = (size_t)model->motion_count;
    uint8_t *all = KMP_NEW(uint8_t, all_ways(model));
    *ways = (kmp_ways){0};
    if (all)
        *ways = (kmp_ways){.stay = all,
                           .about = all + n,
                           .origin = all + 2 * n,
                           .give = all + 3 * n,
                           .lump = all + 4 * n,
                           .way = all + motion_ways(model),
                           .spread = all + all_ways(model) - 2,
                           .apart = all + all_ways(model) - 1};
    return all;
}

void kmp_ways_free(kmp_ways *ways)
{
    kmp_free(ways->stay);
    *ways = (kmp_ways){0};
}

void kmp_ways_copy(kmp_ways *to, const kmp_ways *from, const kempe_model *model)
{
    memcpy(to->stay, from->stay, all_ways(model));
    to->by_q = from->by_q;
    to->by_qd = from->by_qd;
}

bool kmp_ways_same(const kmp_ways *a, const kmp_ways *b, const kempe_model *model)
{
    return memcmp(a->stay, b->stay, all_ways(model)) == 0;
}

bool kmp_ways_plain(const kmp_ways *ways, const kempe_model *model)
{
    for (size_t k = 0; k < motion_ways(model); k++)
        if (ways->stay[k])
            return false;
    return !*ways->spread;
}
