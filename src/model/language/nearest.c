/* SPDX-License-Identifier: BSD-3-Clause */
/* Edit distance with transpositions of neighbours (optimal string alignment), three rows of the table kept. */
#include "model/language/nearest.h"
#include <stdint.h>
#include <string.h>
#include <strings.h>

enum { LONGEST = 48 };

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

static int distance(const char *a, const char *b)
{
    int rows[3][LONGEST + 1];
    int *before = rows[0], *last = rows[1], *now = rows[2];
    int la = (int)strlen(a), lb = (int)strlen(b);
    for (int j = 0; j <= lb; j++)
        before[j] = last[j] = j;
    for (int i = 1; i <= la; i++) {
        now[0] = i;
        for (int j = 1; j <= lb; j++) {
            int change = last[j - 1] + (a[i - 1] != b[j - 1]);
            now[j] = smaller(change, smaller(last[j], now[j - 1]) + 1);
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = smaller(now[j], before[j - 2] + 1);
        }
        int *free_row = before;
        before = last;
        last = now;
        now = free_row;
    }
    return last[lb];
}

kmp_nearest kmp_nearest_begin(const char *word)
{
    const size_t length = strlen(word); /* words of one letter have no near ones, long words several letters off */
    return (kmp_nearest){.word = word, .distance = length < 2 ? 1 : length < 4 ? 2 : length < 7 ? 3 : 4};
}

void kmp_nearest_offer(kmp_nearest *nearest, const char *known)
{
    size_t length = strlen(nearest->word), other = strlen(known);
    size_t more = length > other ? length - other : other - length; /* so far apart at least */
    if (other > LONGEST || length > LONGEST || more >= (size_t)nearest->distance)
        return;
    int d = strcasecmp(known, nearest->word) == 0 ? 0 : distance(nearest->word, known);
    if (d < nearest->distance) {
        nearest->distance = d;
        nearest->best = known;
    }
}

void kmp_nearest_suggest(const kmp_nearest *nearest, kmp_text *sentence)
{
    if (nearest->best)
        kmp_text_printf(sentence, "; did you mean '%s'?", nearest->best);
}

/* -- lists ----------------------------------------------------------------------------------------- */

const char *kmp_name_at(kmp_name_list names, int k)
{
    return *(const char *const *)(const void *)((const char *)names.list + (size_t)k * names.size);
}

int kmp_name_find(kmp_name_list names, const char *name)
{
    for (int k = 0; k < names.count; k++)
        if (strcmp(kmp_name_at(names, k), name) == 0)
            return k;
    return -1;
}

static int group_of(kmp_name_list names, ptrdiff_t at, int k)
{
    return at < 0 ? 0 : *(const int *)(const void *)((const char *)names.list + (size_t)k * names.size + at);
}

static size_t slot_of(const kmp_name_index *index, kmp_name_list names, ptrdiff_t group_at, int group, const char *name)
{
    size_t at = (kmp_text_hash(name) ^ (uint32_t)group * 0x9e3779b9u) & (index->size - 1);
    while (index->slots[at] && (group_of(names, group_at, index->slots[at] - 1) != group ||
                                strcmp(kmp_name_at(names, index->slots[at] - 1), name) != 0))
        at = (at + 1) & (index->size - 1);
    return at;
}

/* False: no memory. */
static bool grow_index(kmp_name_index *index, kmp_arena *arena, int count)
{
    size_t size = index->size ? index->size : 64;
    while (size < 2 * (size_t)count)
        size *= 2;
    if (size > index->size) {
        int *slots = kmp_arena_alloc(arena, size, sizeof *slots);
        if (!slots)
            return false;
        *index = (kmp_name_index){slots, size, 0};
    }
    return true;
}

int kmp_index_find(kmp_name_index *index, kmp_arena *arena, kmp_name_list names, ptrdiff_t group_at, int group,
                   const char *name)
{
    if (!grow_index(index, arena, names.count))
        return -1;
    for (; index->held < names.count; index->held++) {
        int k = index->held;
        size_t at = slot_of(index, names, group_at, group_of(names, group_at, k), kmp_name_at(names, k));
        if (!index->slots[at])
            index->slots[at] = k + 1;
    }
    int found = index->slots[slot_of(index, names, group_at, group, name)] - 1;
    return found < names.count ? found : -1;
}

void kmp_nearest_offer_all(kmp_nearest *nearest, kmp_name_list names)
{
    for (int k = 0; k < names.count; k++)
        kmp_nearest_offer(nearest, kmp_name_at(names, k));
}

kmp_nearest kmp_nearest_of(const char *word, kmp_name_list names)
{
    kmp_nearest nearest = kmp_nearest_begin(word);
    kmp_nearest_offer_all(&nearest, names);
    return nearest;
}

void kmp_name_list_print(kmp_text *text, kmp_name_list names, const char *between, const char *last)
{
    for (int k = 0; k < names.count; k++)
        if (kmp_name_find(names, kmp_name_at(names, k)) == k)
            kmp_text_printf(text, "%s%s", k == 0 ? "" : k + 1 < names.count ? between : last, kmp_name_at(names, k));
}

int kmp_word_find(const char *word, kmp_name_list names, const char *kind, kmp_text *complaint)
{
    int found = kmp_name_find(names, word);
    if (found >= 0)
        return found;
    kmp_nearest nearest = kmp_nearest_of(word, names);
    kmp_text_printf(complaint, "unknown %s '%s'; available: ", kind, word);
    kmp_name_list_print(complaint, names, ", ", ", ");
    kmp_nearest_suggest(&nearest, complaint);
    return names.count;
}
