/* SPDX-License-Identifier: BSD-3-Clause */
/* Counted time beside measured time: cycles of an evaluation by counted operations
 * (integrators/formulations/cost_model.h) and nanoseconds, of one state and of eight in lanes, for the reduced
 * formulation of each model at its start.
 *
 *     bench counted_time MODEL.yaml ..
 */
#include "bench.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include <kempe/check.h>
#include <math.h>

enum { CALLS = 200, TURNS = 20, LANES = 8 };

static double *spread(const kmp_ode *ode, const double *y)
{
    double *all = calloc((size_t)ode->n * LANES, sizeof *all);
    for (int k = 0; all && k < ode->n * LANES; k++)
        all[k] = y[k / LANES];
    return all;
}

/* The least time of a call, ns. */
static double time_of(const kmp_ode *ode, const double *y, double *dy, bool lanes)
{
    const double t[LANES] = {0};
    double least = INFINITY;
    for (int turn = 0; turn < TURNS; turn++) {
        double begin = bench_now();
        for (int k = 0; k < CALLS; k++)
            (void)(lanes ? ode->lanes(ode->self, t, y, dy) : ode->rhs(ode->self, 0, y, dy));
        least = fmin(least, bench_now() - begin);
    }
    return 1e9 * least / CALLS;
}

static void measure(const char *path)
{
    bench b = bench_load(path);
    kmp_runner *run = NULL;
    kmp_run_spec spec = {.formulation = "reduced", .form = "integrated", .integrator = "radau", .rtol = 1e-8};
    if (kmp_run_resolve(b.system, &spec) || kmp_runner_new(b.system, &spec, NULL, &run)) {
        fprintf(stderr, "%s\n", kempe_context_message(b.context));
        exit(1);
    }
    const kmp_ode *ode = &run->formulation->ode;
    double *y = spread(ode, run->formulation->y), *dy = spread(ode, run->formulation->y);
    if (y && dy && ode->lanes) {
        double one = time_of(ode, run->formulation->y, dy, false), all = time_of(ode, y, dy, true);
        printf("%-20s %4d %4d | %8.0f %8.0f %6.2f | %8.0f %8.0f %6.2f\n", kempe_model_name(b.model), ode->positions,
               ode->n - 2 * ode->positions - ode->quadratures, ode->cycles, one, ode->cycles / one,
               ode->cycles_of_lanes, all, ode->cycles_of_lanes / all);
    }
    free(y);
    free(dy);
    kmp_runner_free(run);
    bench_free(&b);
}

int bench_counted_time(int argc, char **argv)
{
    printf("%-20s %4s %4s | %8s %8s %6s | %8s %8s %6s\n", "model", "u", "v", "cycles", "ns", "per ns", "of lanes", "ns",
           "per ns");
    for (int k = 1; k < argc; k++)
        measure(argv[k]);
    return 0;
}
