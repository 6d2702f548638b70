/* SPDX-License-Identifier: BSD-3-Clause */
#include "own_process.h"
#include "platform/platform.h"

#include <string.h>

void cli_own_process(void)
{
    /* OpenBLAS begins a thread for each further processor, and these spin for some 0.1 s before they sleep. The
     * matrices here are too small for more than one thread. C converts an object's address to a function pointer only
     * by copying. */
    void (*set_threads)(int) = NULL;
    int (*end_threads)(void) = NULL;
    void *all = kmp_library_open(NULL), *set = all ? kmp_library_find(all, "openblas_set_num_threads") : NULL,
         *end = all ? kmp_library_find(all, "blas_thread_shutdown_") : NULL;
    memcpy(&set_threads, &set, sizeof set);
    memcpy(&end_threads, &end, sizeof end);
    if (set_threads && end_threads) {
        set_threads(1);
        (void)end_threads();
    }
    if (all)
        kmp_library_close(all);
    kmp_command_keep_memory();
}
