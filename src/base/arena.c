/* SPDX-License-Identifier: BSD-3-Clause */
/* Blocks are chained from the newest back; only the newest is filled. */
#include "base/arena.h"
#include "base/memory.h"
#include <stdalign.h>
#include <stdint.h>
#include <string.h>

enum { FIRST_SIZE = 1024, MOST_SIZE = 512 * 1024 }; /* many arenas hold a few small arrays, some all of a large model */

struct kmp_arena_block {
    struct kmp_arena_block *before;
    size_t used, size;
    int number; /* of blocks before it */
    bool lent;  /* the caller's, which is not zeroed */
    alignas(max_align_t) unsigned char bytes[];
};

void kmp_arena_free(kmp_arena *arena)
{
    struct kmp_arena_block *block = arena->last;
    while (block) {
        struct kmp_arena_block *before = block->before;
        if (!block->lent)
            kmp_free(block);
        block = before;
    }
    arena->last = NULL;
    arena->failed = false;
}

void kmp_arena_lend(kmp_arena *arena, kmp_arena_lent *room)
{
    struct kmp_arena_block *block = (struct kmp_arena_block *)(void *)room->bytes;
    block->before = NULL;
    block->used = 0;
    block->number = 0;
    block->size = sizeof room->bytes - sizeof *block;
    block->lent = true;
    *arena = (kmp_arena){.last = block};
}

static void *fail(kmp_arena *arena)
{
    arena->failed = true;
    return NULL;
}

static struct kmp_arena_block *add_block(kmp_arena *arena, size_t need)
{
    size_t twice = arena->last && !arena->last->lent ? 2 * arena->last->size : FIRST_SIZE,
           usual = twice < MOST_SIZE ? twice : MOST_SIZE;
    size_t size = need > usual ? need : usual;
    struct kmp_arena_block *block = kmp_calloc(1, sizeof *block + size);
    if (!block)
        return NULL;
    block->before = arena->last;
    block->number = arena->last ? arena->last->number + 1 : 0;
    block->size = size;
    arena->last = block;
    return block;
}

void *kmp_arena_alloc(kmp_arena *arena, size_t n, size_t size)
{
    const size_t align = alignof(max_align_t);
    const size_t most = SIZE_MAX / 2; /* leaves room for the block's head and the rounding */
    if (arena->failed || (size > 0 && n > most / size))
        return fail(arena);
    size_t need = (n * size + align - 1) / align * align;
    if (need == 0)
        need = align;
    struct kmp_arena_block *block = arena->last;
    if (!block || block->size - block->used < need)
        block = add_block(arena, need);
    if (!block)
        return fail(arena);
    void *p = block->bytes + block->used;
    block->used += need;
    return block->lent ? memset(p, 0, need) : p;
}

double *kmp_arena_aligned(kmp_arena *arena, size_t n)
{
    enum { LINE = 64 / sizeof(double) };
    double *p = n < SIZE_MAX - LINE ? KMP_ARENA_NEW(arena, double, n + LINE) : fail(arena);
    size_t past = (uintptr_t)p / sizeof *p % LINE;
    return past ? p + (LINE - past) : p;
}

bool kmp_arena_make(kmp_arena *arena, size_t count, kmp_arena_arrays *arrays)
{
    for (size_t k = 0; k < count; k++) {
        const kmp_arena_arrays *room = &arrays[k];
        for (size_t i = 0; i < room->count; i++) {
            void *place, *made = kmp_arena_alloc(arena, room->n, room->size);
            memcpy(&place, (const char *)room->pointers + i * sizeof place, sizeof place); /* pointers of any type */
            memcpy(place, &made, sizeof made);
        }
    }
    return !arena->failed;
}

void *kmp_arena_copy(kmp_arena *arena, const void *from, int count, size_t size)
{
    void *copy = kmp_arena_alloc(arena, (size_t)count, size);
    if (copy && count > 0)
        memcpy(copy, from, (size_t)count * size);
    return copy;
}

char *kmp_arena_strdup(kmp_arena *arena, const char *s)
{
    size_t size = strlen(s) + 1;
    char *copy = kmp_arena_alloc(arena, size, 1);
    if (copy)
        memcpy(copy, s, size);
    return copy;
}

bool kmp_arena_find(const kmp_arena *arena, const void *address, kmp_arena_spot *spot)
{
    uintptr_t at = (uintptr_t)address;
    for (const struct kmp_arena_block *b = arena->last; b; b = b->before)
        if (at >= (uintptr_t)b->bytes && at - (uintptr_t)b->bytes < b->used) {
            *spot = (kmp_arena_spot){b->number, at - (uintptr_t)b->bytes};
            return true;
        }
    return false;
}

size_t kmp_arena_shape(const kmp_arena *arena)
{
    size_t shape = 0;
    for (const struct kmp_arena_block *b = arena->last; b; b = b->before)
        shape = 31 * shape + b->used;
    return shape;
}

void *kmp_arena_at(const kmp_arena *arena, kmp_arena_spot spot, size_t size)
{
    struct kmp_arena_block *b = arena->last;
    while (b && b->number != spot.block)
        b = b->before;
    return b && spot.offset <= b->used && b->used - spot.offset >= size ? b->bytes + spot.offset : NULL;
}

/* A list is full when its count is a power of two, or zero. */
void *kmp_arena_room(kmp_arena *arena, void *list, int count, size_t size)
{
    if ((count & (count - 1)) != 0)
        return list;
    void *grown = kmp_arena_alloc(arena, count > 0 ? 2 * (size_t)count : 1, size);
    if (grown && count > 0)
        memcpy(grown, list, (size_t)count * size);
    return grown;
}

bool kmp_arena_grow(kmp_arena *arena, void *list, int count, size_t size)
{
    void *room;
    memcpy(&room, list, sizeof room);
    if ((room = kmp_arena_room(arena, room, count, size)))
        memcpy(list, &room, sizeof room);
    return room;
}
