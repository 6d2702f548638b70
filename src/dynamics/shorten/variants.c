/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/shorten/variants.h"
#include "base/memory.h"
#include <limits.h>
#include <string.h>

/* The bytes of all motions, then those of all closures, then one. */
static size_t motion_savings(const kempe_model *model)
{
    return 5 * (size_t)model->motion_count;
}

static size_t savings_size(const kempe_model *model)
{
    return motion_savings(model) + 4 * (size_t)model->closure_count + 1;
}

bool kmp_savings_init(kmp_savings *savings, const kempe_model *model)
{
    size_t n = (size_t)model->motion_count;
    uint8_t *all = KMP_NEW(uint8_t, savings_size(model));
    *savings = (kmp_savings){0};
    if (all)
        *savings = (kmp_savings){.stay = all,
                                 .about = all + n,
                                 .origin = all + 2 * n,
                                 .give = all + 3 * n,
                                 .lump = all + 4 * n,
                                 .point = all + motion_savings(model),
                                 .apart = all + savings_size(model) - 1};
    return all;
}

void kmp_savings_clear(kmp_savings *savings, const kempe_model *model)
{
    memset(savings->stay, 0, savings_size(model));
    savings->by_q = savings->by_qd = (kmp_tangent_method)0;
    savings->patterns = 0;
}

void kmp_savings_free(kmp_savings *savings)
{
    kmp_free(savings->stay);
    *savings = (kmp_savings){0};
}

void kmp_savings_put(kmp_bytes *bytes, const kmp_savings *savings, const kempe_model *model)
{
    size_t size = savings->stay ? savings_size(model) : 0;
    kmp_bytes_put_int(bytes, (int64_t)size);
    kmp_bytes_put(bytes, savings->stay, size);
    kmp_bytes_put_int(bytes, savings->by_q);
    kmp_bytes_put_int(bytes, savings->by_qd);
    kmp_bytes_put_int(bytes, savings->patterns);
}

void kmp_savings_take(kmp_byte_source *source, kmp_savings *savings, const kempe_model *model)
{
    int size = kmp_bytes_take_count(source, 1);
    *savings = (kmp_savings){0};
    if (size > 0)
        source->failed = source->failed || (size_t)size != savings_size(model) || !kmp_savings_init(savings, model);
    if (savings->stay)
        kmp_bytes_take(source, savings->stay, (size_t)size);
    savings->by_q = (kmp_tangent_method)kmp_bytes_take_int(source, 0, KMP_TANGENT_COMPOSITE);
    savings->by_qd = (kmp_tangent_method)kmp_bytes_take_int(source, 0, KMP_TANGENT_COMPOSITE);
    savings->patterns = (unsigned)kmp_bytes_take_int(source, 0, INT_MAX);
}

void kmp_savings_copy(kmp_savings *to, const kmp_savings *from, const kempe_model *model)
{
    memcpy(to->stay, from->stay, savings_size(model));
    to->by_q = from->by_q;
    to->by_qd = from->by_qd;
    to->patterns = from->patterns;
}

void kmp_savings_copy_dynamics(kmp_savings *to, const kmp_savings *from, const kempe_model *model)
{
    memcpy(to->stay, from->stay, motion_savings(model));
    *to->apart = *from->apart;
    to->patterns = from->patterns;
}

bool kmp_savings_same(const kmp_savings *a, const kmp_savings *b, const kempe_model *model)
{
    return memcmp(a->stay, b->stay, savings_size(model)) == 0;
}

bool kmp_savings_plain(const kmp_savings *savings, const kempe_model *model)
{
    for (size_t k = 0; k < motion_savings(model); k++)
        if (savings->stay[k])
            return false;
    return true;
}
