/* SPDX-License-Identifier: BSD-3-Clause */
/* An arena: many small blocks with one lifetime. Failure is sticky: kmp_arena_failed reports it once at the end. */
#pragma once

#include <stdalign.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct kmp_arena {
    struct kmp_arena_block *last;
    bool failed;
} kmp_arena;

void kmp_arena_free(kmp_arena *arena);

/** Room of the caller, for an arena that is made and freed often: its first blocks are then not allocated. */
typedef struct kmp_arena_lent {
    alignas(max_align_t) unsigned char bytes[4096];
} kmp_arena_lent;

/** Begins an arena in the room, which must outlive it. */
void kmp_arena_lend(kmp_arena *arena, kmp_arena_lent *room);

/** Zeroed, aligned for any type; NULL (and failed set) when there is no memory. */
void *kmp_arena_alloc(kmp_arena *arena, size_t n, size_t size);
/** Doubles from a boundary of 64 bytes on, a cache line or a register of eight. */
double *kmp_arena_aligned(kmp_arena *arena, size_t n);
char *kmp_arena_strdup(kmp_arena *arena, const char *s);

/** A copy of `count` entries of a size. NULL: no memory. */
void *kmp_arena_copy(kmp_arena *arena, const void *from, int count, size_t size);

/** The place of an object in its arena, the same for every arena that is filled by the same calls. */
typedef struct kmp_arena_spot {
    int block;
    size_t offset;
} kmp_arena_spot;

/** kmp_arena_find: false if the address is not in the arena. kmp_arena_at: NULL if nothing of `size` bytes is there. */
bool kmp_arena_find(const kmp_arena *arena, const void *address, kmp_arena_spot *spot);
void *kmp_arena_at(const kmp_arena *arena, kmp_arena_spot spot, size_t size);

/** A digest of the sizes of the blocks in use: equal where all objects have the same places. */
size_t kmp_arena_shape(const kmp_arena *arena);

/** Room for one more item in a list of `count`, all of which were added so: the list itself or, where that is full, a
 * copy of twice the size. NULL without memory. */
void *kmp_arena_room(kmp_arena *arena, void *list, int count, size_t size);

/** The same for the pointer `list` at an address, which then points to the room. False: no memory, the list stays. */
#define KMP_ARENA_GROW(arena, list, count) kmp_arena_grow((arena), &(list), (count), sizeof *(list))
bool kmp_arena_grow(kmp_arena *arena, void *list, int count, size_t size);

#define KMP_ARENA_NEW(arena, type, n) ((type *)kmp_arena_alloc((arena), (size_t)(n), sizeof(type)))

/** n values for each of some pointers to a type. */
typedef struct kmp_arena_arrays {
    size_t n, size, count;
    void *pointers; /* their addresses */
} kmp_arena_arrays;
#define KMP_COUNT_OF(type, ...) (sizeof((type[]){__VA_ARGS__}) / sizeof(type))
#define KMP_ROOM(type, n, ...)                                                                                         \
    ((kmp_arena_arrays){(size_t)(n), sizeof(type), KMP_COUNT_OF(type **, __VA_ARGS__), (type * *[]){__VA_ARGS__}})

/** Allocates values for pointers of several sizes and types, KMP_ARENA_MAKE(&arena, KMP_ROOM(int, n, &row, &column),
 * KMP_ROOM(double, n * n, &matrix)), or of one, KMP_ARENA_EACH(&arena, int, n, &row, &column). True if the arena has
 * never failed. */
#define KMP_ARENA_MAKE(arena, ...)                                                                                     \
    kmp_arena_make((arena), KMP_COUNT_OF(kmp_arena_arrays, __VA_ARGS__), (kmp_arena_arrays[]){__VA_ARGS__})
#define KMP_ARENA_EACH(arena, type, n, ...) KMP_ARENA_MAKE(arena, KMP_ROOM(type, n, __VA_ARGS__))
bool kmp_arena_make(kmp_arena *arena, size_t count, kmp_arena_arrays *arrays);
