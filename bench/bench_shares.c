/* SPDX-License-Identifier: BSD-3-Clause */
/* The time of the dae formulation by parts: for a model, the times of one residual, one iteration matrix, one
 * factorisation with the pivots at hand and one solve at the start, and of a run the shares of the equations (residuals
 * and matrices), of linear algebra and of all the rest, which is the integrator's vectors, its tests and what is
 * watched at each step.
 *
 *     bench shares MODEL ...
 *
 * "windows N" is a chain of N windows, to 0.4 s; ROBOTRAN's models go to 5 s. Form stabilized1, rtol 1e-8. */
#include "bench.h"
#include "chain.h"
#include "integrators/run/methods.h"
#include "iteration_matrix.h"
#include <kempe/check.h>

static const char *const linear[] = {"klu",
#ifdef KEMPE_UMFPACK
                                     "umfpack"
#endif
};
enum { LINEAR = sizeof linear / sizeof *linear };

static void measure(const bench *b, const kempe_assembly *start, const char *model, const char *name, double t_end)
{
    kmp_run_spec spec = {.formulation = "dae", .form = "stabilized1", .linear = name, .rtol = 1e-8, .t_end = t_end};
    kmp_run_report report = {0};
    kmp_runner *run = NULL;
    place p;
    double cpu[SAMPLES], part[4];
    if (kmp_run_resolve(b->system, &spec) || kmp_runner_new(b->system, &spec, start, &run)) {
        printf("%s: %s\n", model, kempe_context_message(b->context));
        kmp_runner_free(run);
        return;
    }
    open_place(&p, run, name, 1e-3 / run->rate_scale);
    part[0] = time_of(&p, evaluate);
    part[1] = time_of(&p, differentiate);
    part[2] = time_of(&p, factor);
    part[3] = time_of(&p, solve);
    for (int k = 0; k < SAMPLES; k++) {
        if (kmp_run(b->system, &spec, start, drop_row, NULL, &report) != KEMPE_OK)
            printf("%s: ends at %g s: %s\n", model, report.t, report.reason ? report.reason : "");
        cpu[k] = report.cpu_s;
        free(report.reason);
    }
    double all = bench_median(SAMPLES, cpu), factors = (double)report.factorizations;
    double equations = (double)report.rhs * part[0] + factors * part[1];
    double algebra = factors * part[2] + (double)report.newton * part[3];
    printf("%-14s %-7s %4d %5d %6d | %7.2f %7.2f %7.2f %7.2f | %5ld %6ld %4ld %8.3f | %5.2f %4.0f%% %4.0f%% %4.0f%% | "
           "%6.0f\n",
           model, name, b->system->n, p.dae->n, p.dae->nz, 1e6 * part[0], 1e6 * part[1], 1e6 * part[2], 1e6 * part[3],
           report.steps, report.newton, report.factorizations, 1e3 * all, 1e6 * all / (double)report.newton,
           100 * equations / all, 100 * algebra / all, 100 * (1 - (equations + algebra) / all),
           1e9 * all / (double)report.newton / b->system->n);
    close_place(&p);
    kmp_runner_free(run);
}

static bool load(bench *b, const char *model)
{
    if (strncmp(model, "windows ", 8) != 0) {
        *b = bench_load(model);
        return true;
    }
    char *text = chain_text(atoi(model + 8), false, 0);
    *b = (bench){kempe_context_new(), NULL, NULL};
    bool made = text && kempe_model_read_text(b->context, text, "chain", &b->model) == KEMPE_OK &&
                kempe_system_new(b->model, &b->system) == KEMPE_OK;
    free(text);
    return made;
}

int bench_shares(int argc, char **argv)
{
    printf("%-14s %-7s %4s %5s %6s | %31s | %5s %6s %4s %8s | %5s %-17s | %6s\n", "", "", "co-", "un-", "", "us of one",
           "", "", "", "", "us an", "share of", "ns an");
    printf("%-14s %-7s %4s %5s %6s | %7s %7s %7s %7s | %5s %6s %4s %8s | %5s %5s %5s %5s | %6s\n", "model", "linear",
           "ord.", "known", "places", "resid.", "matrix", "factor", "solve", "steps", "Newton", "fac.", "cpu ms", "it.",
           "equ.", "alg.", "rest", "it. co.");
    for (int k = 1; k < argc; k++) {
        const char *slash = strrchr(argv[k], '/'), *name = slash ? slash + 1 : argv[k];
        bool robotran = strstr(name, ".mbs") != NULL, windows = !slash;
        double t_end = robotran ? 5 : windows ? 0.4 : strstr(name, "andrews") ? 0.03 : 1;
        bench b;
        kempe_assembly *start = NULL;
        if (!load(&b, argv[k]) || kempe_assembly_new(b.system, &start)) {
            printf("%s: %s\n", name, kempe_context_message(b.context));
            continue;
        }
        for (int l = 0; l < LINEAR; l++)
            measure(&b, start, name, linear[l], t_end);
        fflush(stdout);
        kempe_assembly_free(start);
        bench_free(&b);
    }
    return 0;
}
