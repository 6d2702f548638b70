/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/rope.h"
#include "model/data/model.h"
#include <string.h>

bool kmp_rope_part(const kmp_rope *rope, int *first, kmp_rope *part)
{
    int last = *first + 1;
    if (last >= rope->count)
        return false;
    while (rope->parts ? rope->places[last].turn != 0 : last < rope->count - 1)
        last++;
    *part = *rope;
    part->places += *first;
    part->count = last - *first + 1;
    part->plane = 0;
    while (part->plane < part->count && part->places[part->plane].turn == 0)
        part->plane++;
    part->plane = part->plane < part->count ? part->plane : -1;
    *first = last;
    return true;
}

kmp_contact_words kmp_contact_words_of(const kempe_model *model, const char *contact)
{
    for (int k = 0; k < model->rope_count; k++)
        if (strcmp(model->ropes[k].name, contact) == 0)
            return (kmp_contact_words){"rope", "becomes taut", "becomes slack"};
    return (kmp_contact_words){"contact", "closes", "opens"};
}
