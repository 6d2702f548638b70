/* SPDX-License-Identifier: BSD-3-Clause */
/* Sine and cosine together, as emitted C calls them: kempe_sincos beside the sincos of libm, nanoseconds of a call.
 * Arguments follow each other freely, or each waits for the result before it. Fails where kempe_sincos is slower. */
#define _GNU_SOURCE /* sincos */
#include "bench.h"
#include <kempe/runtime.h>

enum { COUNT = 4096, TRIES = 300 };
/* A fraction of the time of libm that counts as noise. */
#define NOISE 1.03

static double x[COUNT], s[COUNT], c[COUNT];

typedef void run_fn(void);

static void kempe_free(void)
{
    for (int i = 0; i < COUNT; i++)
        kempe_sincos(x[i], &s[i], &c[i]);
}

static void libm_free(void)
{
    for (int i = 0; i < COUNT; i++)
        sincos(x[i], &s[i], &c[i]);
}

static void kempe_waiting(void)
{
    for (int i = 0; i < COUNT; i++)
        kempe_sincos(x[i] + (i > 0 ? 1e-300 * s[i - 1] : 0), &s[i], &c[i]);
}

static void libm_waiting(void)
{
    for (int i = 0; i < COUNT; i++)
        sincos(x[i] + (i > 0 ? 1e-300 * s[i - 1] : 0), &s[i], &c[i]);
}

/* The least time of a call, ns. */
static double least(run_fn *run)
{
    double best = 1e9;
    for (int k = 0; k < TRIES; k++) {
        double begin = bench_now();
        run();
        double time = bench_now() - begin;
        best = time < best ? time : best;
    }
    return 1e9 * best / COUNT;
}

static int compare(const char *how, double range, run_fn *ours, run_fn *theirs)
{
    for (int i = 0; i < COUNT; i++)
        x[i] = range * (2.0 * rand() / RAND_MAX - 1);
    double a = least(ours), b = least(theirs);
    int slower = a > NOISE * b;
    printf("%-8s |x| < %-6g %8.2f %8.2f %8.2f%s\n", how, range, a, b, a / b, slower ? "  slower" : "");
    return slower;
}

int bench_sincos(int argc, char **argv)
{
    (void)argc, (void)argv;
    static const double range[] = {0.7, 3, 20, 1000};
    int slower = 0;
    printf("%-8s %-12s %8s %8s %8s\n", "calls", "arguments", "kempe ns", "libm ns", "ratio");
    for (int k = 0; k < 4; k++)
        slower += compare("free", range[k], kempe_free, libm_free);
    for (int k = 0; k < 4; k++)
        slower += compare("waiting", range[k], kempe_waiting, libm_waiting);
    return slower > 0;
}
