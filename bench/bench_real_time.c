/* SPDX-License-Identifier: BSD-3-Clause */
/* Steps of 1 ms under a sampled controller: examples/delta_robot as it is, with every allocation counted between its
 * first step and its last one. The example prints the distribution of the times, which includes those in which the
 * machine does something else; here is that of the processor time of kempe_stepper_advance.
 *
 *     bench_real_time MODEL [SECONDS]
 */
#include "bench.h"
#include "tests/counted_memory.h"
#include <kempe/stepper.h>

enum { MOST = 1000000 };

static double cost[MOST];
static long steps, first, last;

kempe_status __real_kempe_stepper_advance(kempe_stepper *stepper, double t); /* NOLINT(bugprone-reserved-identifier) */
kempe_status __wrap_kempe_stepper_advance(kempe_stepper *stepper, double t); /* NOLINT(bugprone-reserved-identifier) */

/* The linker leads the calls of the example to this one. */
kempe_status __wrap_kempe_stepper_advance(kempe_stepper *stepper, double t) /* NOLINT(bugprone-reserved-identifier) */
{
    first = steps ? first : allocations;
    double begin = bench_now();
    kempe_status status = __real_kempe_stepper_advance(stepper, t);
    if (steps < MOST)
        cost[steps++] = bench_now() - begin;
    last = allocations;
    return status;
}

__attribute__((destructor)) static void report(void)
{
    long made = last - first;
    qsort(cost, (size_t)steps, sizeof *cost, bench_order);
    if (steps > 0)
        printf("processor time of a step: median %.1f us, 99.9 %% %.1f us, longest %.1f us\n", 1e6 * cost[steps / 2],
               1e6 * cost[steps - 1 - steps / 1000], 1e6 * cost[steps - 1]);
    printf("allocations from the first of %ld steps to the last: %ld; before: %ld\n", steps, made, first);
}
