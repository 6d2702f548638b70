/* SPDX-License-Identifier: BSD-3-Clause */
/* Counts every allocation of a program, that of the library included. To be included in one file of the program. */
#ifndef KEMPE_TESTS_COUNTED_MEMORY_H
#define KEMPE_TESTS_COUNTED_MEMORY_H

#include "sanitized.h"
#include <stdbool.h>
#include <stdlib.h>

static long allocations;

/* Sanitizers have allocation functions of their own: nothing is counted there. */
#ifdef SANITIZED
static const bool counts = false;
#else
static const bool counts = true;

/* The C library's own functions, which these replace for the whole process. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t n, size_t size);
void *__libc_realloc(void *old, size_t size);

void *malloc(size_t size)
{
    allocations++;
    return __libc_malloc(size);
}

void *calloc(size_t n, size_t size)
{
    allocations++;
    return __libc_calloc(n, size);
}

void *realloc(void *old, size_t size)
{
    allocations++;
    return __libc_realloc(old, size);
}
#endif

#endif
