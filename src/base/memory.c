/* SPDX-License-Identifier: BSD-3-Clause */
/* The one door to the heap, counted per thread. */
#include "base/memory.h"
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static _Thread_local unsigned long allocations, bytes;
static _Thread_local unsigned long fail_at; /* 0: none */

static _Thread_local unsigned long failures;

/* Counts an allocation. True if it is to fail. */
static bool refuse(void)
{
    bool refused = ++allocations == fail_at;
    failures += refused;
    return refused;
}

static void *given(void *p, size_t n, size_t size)
{
    bytes += n * size;
    failures += !p;
    return p;
}

void *kmp_calloc(size_t n, size_t size)
{
    if (refuse())
        return NULL;
    if (n == 0 || size == 0)
        return given(calloc(1, 1), 1, 1);
    return given(calloc(n, size), n, size);
}

void *kmp_realloc(void *old, size_t n, size_t size)
{
    if (refuse())
        return NULL;
    if (n == 0 || size == 0)
        return given(realloc(old, 1), 1, 1);
    return given(n > SIZE_MAX / size ? NULL : realloc(old, n * size), n, size);
}

void *kmp_list_room(void *list, size_t count, size_t size)
{
    enum { FIRST = 8 };
    bool full = count == 0 || (count >= FIRST && (count & (count - 1)) == 0);
    return full ? kmp_realloc(list, count > 0 ? 2 * count : FIRST, size) : list;
}

void kmp_free(void *p)
{
    free(p);
}

char *kmp_strdup(const char *s)
{
    size_t size = strlen(s) + 1;
    char *copy = kmp_calloc(size, 1);
    if (copy)
        memcpy(copy, s, size);
    return copy;
}

unsigned long kmp_memory_bytes(void)
{
    return bytes;
}

unsigned long kmp_memory_count(void)
{
    return allocations;
}

unsigned long kmp_memory_failures(void)
{
    return failures;
}

void kmp_memory_fail_at(unsigned long n)
{
    fail_at = n ? allocations + n : 0;
}
