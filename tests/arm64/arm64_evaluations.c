/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluates the right-hand side of a model at its start a number of times, for counts of instructions
 * (arm64_counts.py):
 *
 *     arm64_evaluations MODEL native|tape COUNT [lanes]
 *
 * With `lanes` eight states at once, which the tape does not have. Prints the rates that it found, as bits. */
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include <inttypes.h>
#include <kempe/kempe.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 8 };

static void print_bits(const double *value, int count)
{
    for (int k = 0; k < count; k++) {
        uint64_t bits;
        memcpy(&bits, &value[k], sizeof bits);
        (void)printf("%016" PRIx64 "\n", bits);
    }
}

static void evaluate(const kmp_ode *ode, const double *start, int count, bool lanes)
{
    const double t[LANES] = {0};
    double *y = calloc((size_t)ode->n * LANES, sizeof *y), *dy = calloc((size_t)ode->n * LANES, sizeof *dy);
    for (int k = 0; k < ode->n * LANES; k++)
        y[k] = start[lanes ? k / LANES : k % ode->n];
    for (int k = 0; k < count; k++)
        (void)(lanes ? ode->lanes(ode->self, t, y, dy) : ode->rhs(ode->self, 0, y, dy));
    print_bits(dy, ode->n * (lanes ? LANES : 1));
    free(y);
    free(dy);
}

int main(int argc, char **argv)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kmp_runner *run = NULL;
    if (argc < 4)
        return 3;
    const bool lanes = argc > 4;
    kmp_run_spec spec = {.formulation = "reduced", .integrator = lanes ? "radau" : "dop853", .backend = argv[2]};
    bool ok = !kempe_model_read(context, argv[1], &model) && !kempe_system_new(model, &system) &&
              !kmp_run_resolve(system, &spec) && !kmp_runner_new(system, &spec, NULL, &run) &&
              (!lanes || run->formulation->ode.lanes);
    if (ok)
        evaluate(&run->formulation->ode, run->formulation->y, atoi(argv[3]), lanes);
    else
        (void)fprintf(stderr, "%s\n", kempe_context_message(context));
    kmp_runner_free(run);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
    return ok ? 0 : 1;
}
