/* SPDX-License-Identifier: BSD-3-Clause */
/* Allocation. Every allocation of Kempe goes through here, so that a test can count them (none while
 * stepping) and make the n-th one fail. */
#pragma once

#include <stddef.h>

/** Zeroed memory for n objects of `size` bytes; NULL when there is none or n * size overflows. n = 0 gives
 *  a pointer that may be freed. */
void *kmp_calloc(size_t n, size_t size);

/** Grows to n objects of `size` bytes; the old block is kept when this returns NULL. */
void *kmp_realloc(void *old, size_t n, size_t size);

/** Room for one more object in a list of `count`, all of which were added so: the list itself or, where that is full,
 *  grown to twice its size. NULL: no memory, and the list is kept. */
void *kmp_list_room(void *list, size_t count, size_t size);
void kmp_free(void *p);

/** Copy of a string; NULL when there is no memory. */
char *kmp_strdup(const char *s);

/** Allocations made by this thread so far. */
unsigned long kmp_memory_count(void);

/** Bytes requested by all allocations so far. */
unsigned long kmp_memory_bytes(void);

/** Allocations that failed on this thread so far: they distinguish a NULL without memory from other NULLs. */
unsigned long kmp_memory_failures(void);

/** For tests: the n-th allocation from now on this thread fails, once; 0 cancels that. */
void kmp_memory_fail_at(unsigned long n);

#define KMP_NEW(type, n) ((type *)kmp_calloc((size_t)(n), sizeof(type)))

/** The function TYPE_free: the calls, separated by commas, free what an object has; NULL is allowed. */
#define KMP_FREES(type, object, ...)                                                                                   \
    void type##_free(type *object)                                                                                     \
    {                                                                                                                  \
        if (object) {                                                                                                  \
            __VA_ARGS__;                                                                                               \
            kmp_free(object);                                                                                          \
        }                                                                                                              \
    }

/** The function TYPE_free of an object that is part of another one: as above; it leaves the object empty. */
#define KMP_CLEARS(type, object, ...)                                                                                  \
    void type##_free(type *object)                                                                                     \
    {                                                                                                                  \
        __VA_ARGS__;                                                                                                   \
        *object = (type){0};                                                                                           \
    }
