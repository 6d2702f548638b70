/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/clock.h"
#include <time.h>

double kmp_cpu_now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
