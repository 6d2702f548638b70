/* SPDX-License-Identifier: BSD-3-Clause */
/* The most that lanes can gain on this processor: multiplications with additions, and divisions, of one double, of four
 * and of eight in a register. In one chain each operation waits for the last one; in twelve chains the units are full.
 * A program whose operations wait gains as the first, one that fills the units as the second; none gains more than the
 * number of lanes.
 *
 *     bench ceiling [SECONDS]      of each measurement */
#include "base/clones.h"
#include "base/simd4.h"
#include "bench.h"
#include <stdlib.h>

enum { CHAINS = 12, ROUNDS = 2000 };

/* Keeps the compiler from joining chains, or from knowing values; C alone where there are no such registers. */
#if defined(__x86_64__) && defined(__GNUC__)
#define HOLD(x)    __asm__ volatile("" : "+v"(x))
#define FOR(words) __attribute__((target(words)))
#else
#define HOLD(x)
#define FOR(words)
#endif

#define CHAIN(name, type, target_words, first, chains, operation)                                                      \
    static FOR(target_words) double name(void)                                                                         \
    {                                                                                                                  \
        type x[chains], a = (type){0} + 0.999, b = (type){0} + 1e-3;                                                   \
        double sum = 0;                                                                                                \
        HOLD(a);                                                                                                       \
        HOLD(b);                                                                                                       \
        _Pragma("GCC unroll 16") for (int k = 0; k < (chains); k++) x[k] = a;                                          \
        for (int i = 0; i < ROUNDS; i++) {                                                                             \
            _Pragma("GCC unroll 16") for (int k = 0; k < (chains); k++)                                                \
            {                                                                                                          \
                x[k] = (operation);                                                                                    \
                HOLD(x[k]);                                                                                            \
            }                                                                                                          \
        }                                                                                                              \
        _Pragma("GCC unroll 16") for (int k = 0; k < (chains); k++) sum += first(x[k]);                                \
        return sum;                                                                                                    \
    }
#define MEASURED(name, type, target_words, first)                                                                      \
    CHAIN(name##_sum, type, target_words, first, 1, x[k] * a + b)                                                      \
    CHAIN(name##_sums, type, target_words, first, CHAINS, x[k] * a + b)                                                \
    CHAIN(name##_quotient, type, target_words, first, 1, a / x[k])                                                     \
    CHAIN(name##_quotients, type, target_words, first, CHAINS, a / x[k])
#define WHOLE(x) (x)
#define LANE(x)  ((x)[0])

typedef double one __attribute__((may_alias));

MEASURED(one, one, "avx", WHOLE)
MEASURED(four, kmp_four, "avx2", LANE)
#ifdef __x86_64__
MEASURED(eight, kmp_eight, "avx512f", LANE)
#endif

static double shortest = 0.2;

/* ns of an operation in a register. */
static double time_of(double (*work)(void), int chains)
{
    volatile double kept = 0;
    long calls = 0;
    double begin = bench_now(), spent = 0;
    while (spent < shortest) {
        for (int k = 0; k < 20; k++)
            kept = kept + work();
        calls += 20;
        spent = bench_now() - begin;
    }
    return 1e9 * spent / ((double)calls * ROUNDS * chains);
}

typedef struct measurement {
    const char *name;
    double (*one)(void), (*four)(void), (*eight)(void);
    int chains;
} measurement;

int bench_ceiling(int argc, char **argv)
{
    bool has_eight = kmp_has_eight();
#ifndef __x86_64__
    double (*const eight_sum)(void) = NULL, (*const eight_sums)(void) = NULL, (*const eight_quotient)(void) = NULL,
                   (*const eight_quotients)(void) = NULL;
#endif
    const measurement all[] = {{"product and sum, one after the other", one_sum, four_sum, eight_sum, 1},
                               {"product and sum, units full", one_sums, four_sums, eight_sums, CHAINS},
                               {"quotient, one after the other", one_quotient, four_quotient, eight_quotient, 1},
                               {"quotient, units full", one_quotients, four_quotients, eight_quotients, CHAINS}};
    if (argc > 1)
        shortest = atof(argv[1]);
#if defined(__x86_64__) && defined(__GNUC__)
    if (!__builtin_cpu_supports("avx2")) {
        printf("this processor has no registers of four doubles\n");
        return 0;
    }
#endif
    printf("%-40s %10s %10s %10s %8s %8s\n", "ns of a register", "1 double", "4 doubles", "8 doubles", "gain 4",
           "gain 8");
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        double a = time_of(all[k].one, all[k].chains), b = time_of(all[k].four, all[k].chains);
        printf("%-40s %10.3f %10.3f ", all[k].name, a, b);
        if (has_eight) {
            double c = time_of(all[k].eight, all[k].chains);
            printf("%10.3f %8.2f %8.2f\n", c, 4 * a / b, 8 * a / c);
        } else {
            printf("%10s %8.2f %8s\n", "-", 4 * a / b, "-");
        }
    }
    return 0;
}
