/* SPDX-License-Identifier: BSD-3-Clause */
/* The one door to the heap, counted per thread. */
#include "base/memory.h"
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static _Thread_local unsigned long allocations;

void *kmp_calloc(size_t n, size_t size)
{
    allocations++;
    if (n == 0 || size == 0)
        return calloc(1, 1);
    return calloc(n, size);
}

void *kmp_realloc(void *old, size_t n, size_t size)
{
    allocations++;
    if (n == 0 || size == 0)
        return realloc(old, 1);
    if (n > SIZE_MAX / size)
        return NULL;
    return realloc(old, n * size);
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

unsigned long kmp_memory_count(void)
{
    return allocations;
}
