/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/shorten/variants.h"
#include "base/memory.h"
#include <string.h>

static size_t closure_ways(const kempe_model *model)
{
    return 4 * (size_t)model->closure_count;
}

bool kmp_ways_init(kmp_ways *ways, const kempe_model *model)
{
    int n = model->motion_count;
    *ways = (kmp_ways){.stay = KMP_NEW(bool, n),
                       .about = KMP_NEW(bool, n),
                       .origin = KMP_NEW(uint8_t, n),
                       .give = KMP_NEW(uint8_t, n),
                       .lump = KMP_NEW(uint8_t, n),
                       .way = KMP_NEW(uint8_t, closure_ways(model))};
    return ways->stay && ways->about && ways->origin && ways->give && ways->lump && ways->way;
}

void kmp_ways_free(kmp_ways *ways)
{
    kmp_free(ways->stay);
    kmp_free(ways->about);
    kmp_free(ways->origin);
    kmp_free(ways->give);
    kmp_free(ways->lump);
    kmp_free(ways->way);
    *ways = (kmp_ways){0};
}

void kmp_ways_copy(kmp_ways *to, const kmp_ways *from, const kempe_model *model)
{
    size_t n = (size_t)model->motion_count;
    memcpy(to->stay, from->stay, n * sizeof *to->stay);
    memcpy(to->about, from->about, n * sizeof *to->about);
    memcpy(to->origin, from->origin, n);
    memcpy(to->give, from->give, n);
    memcpy(to->lump, from->lump, n);
    memcpy(to->way, from->way, closure_ways(model));
    to->spread = from->spread;
    to->apart = from->apart;
    to->by_q = from->by_q;
    to->by_qd = from->by_qd;
}

bool kmp_ways_same(const kmp_ways *a, const kmp_ways *b, const kempe_model *model)
{
    size_t n = (size_t)model->motion_count;
    bool links = memcmp(a->stay, b->stay, n * sizeof *a->stay) == 0 &&
                 memcmp(a->about, b->about, n * sizeof *a->about) == 0 && memcmp(a->origin, b->origin, n) == 0;
    bool masses = memcmp(a->give, b->give, n) == 0 && memcmp(a->lump, b->lump, n) == 0;
    return links && masses && memcmp(a->way, b->way, closure_ways(model)) == 0 && a->spread == b->spread &&
           a->apart == b->apart;
}

bool kmp_ways_plain(const kmp_ways *ways, const kempe_model *model)
{
    for (int k = 0; k < model->motion_count; k++)
        if (ways->stay[k] || ways->about[k] || ways->origin[k] || ways->give[k] || ways->lump[k])
            return false;
    return !ways->spread;
}
