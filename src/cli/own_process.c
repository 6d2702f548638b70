/* SPDX-License-Identifier: BSD-3-Clause */
#include "own_process.h"

#include <dlfcn.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#include <sys/mman.h>
#endif

#ifdef __GLIBC__

/* Makes room in the heap, most of it in large pages: each takes one fault instead of 512. Small models need less than
 * SMALL, and would not fill a large page. */
static void take_large_pages(void)
{
#ifdef MADV_HUGEPAGE
    enum { ROOM = 32 << 20, SMALL = 1 << 20, PAGE = 2 << 20 };
    (void)mallopt(M_TOP_PAD, ROOM);
    char *first = malloc(SMALL); /* more than is left of the heap, which grows */
    if (!first)
        return;
    const uintptr_t end = (uintptr_t)sbrk(0), used = (uintptr_t)first + SMALL, skipped = PAGE - used % PAGE;
    if (used < end && end - used > skipped && end - used <= (uintptr_t)ROOM + PAGE)
        (void)madvise(first + SMALL + skipped, (end - used - skipped) / PAGE * PAGE, MADV_HUGEPAGE);
    free(first);
#endif
}

/* Equations are derived in memory that is freed and taken again several times. The C library would return it to the
 * system, which clears each page again. Arrays above OWN_PAGES bytes are separate pages, and grow without a copy. */
static void keep_memory(void)
{
    enum { MOST_KEPT = 256 << 20, OWN_PAGES = 16 << 20 };
    (void)mallopt(M_TRIM_THRESHOLD, MOST_KEPT);
    (void)mallopt(M_MMAP_THRESHOLD, OWN_PAGES);
    take_large_pages();
}

#else
static void keep_memory(void)
{
}
#endif

void cli_own_process(void)
{
    /* OpenBLAS begins a thread for each further processor, and these spin for some 0.1 s before they sleep. The
     * matrices here are too small for more than one thread. C converts an object's address to a function pointer only
     * by copying. */
    void (*set_threads)(int) = NULL;
    int (*end_threads)(void) = NULL;
    void *all = dlopen(NULL, RTLD_LAZY), *set = all ? dlsym(all, "openblas_set_num_threads") : NULL,
         *end = all ? dlsym(all, "blas_thread_shutdown_") : NULL;
    memcpy(&set_threads, &set, sizeof set);
    memcpy(&end_threads, &end, sizeof end);
    if (set_threads && end_threads) {
        set_threads(1);
        (void)end_threads();
    }
    if (all)
        (void)dlclose(all);
    keep_memory();
}
