/* SPDX-License-Identifier: BSD-3-Clause */
/* Clocks of the processor and of the wall, in seconds. */
#include "base/clock.h"
#include <time.h>

static double read_clock(clockid_t clock)
{
    struct timespec t;
    (void)clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double kmp_cpu_now(void)
{
    return read_clock(CLOCK_THREAD_CPUTIME_ID);
}

double kmp_wall_now(void)
{
    return read_clock(CLOCK_MONOTONIC);
}
