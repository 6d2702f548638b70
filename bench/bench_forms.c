/* SPDX-License-Identifier: BSD-3-Clause */
/* Andrews' squeezing mechanism over 0.03 s by IDA: every form of the dae formulation with every linear solver at
 * several tolerances. Errors against the digits of reference.csv at the end, residuals over 64 rows, median time of 9
 * runs. */
#include "bench.h"
#include "integrators/run/methods.h"
#include "integrators/sundials/linear.h"
#include "judged.h"
#include <kempe/check.h>

enum { RUNS = 9, ROWS = 64 };

static void one(const judged *with, const kempe_assembly *start, const char *form, const char *linear, double rtol)
{
    judged j = *with;
    double times[ROWS];
    for (int k = 0; k < ROWS; k++)
        times[k] = k + 1 < ROWS ? 0.03 * (k + 1) / ROWS : 0.03;
    kmp_run_spec spec = {.formulation = "dae",
                         .form = form,
                         .integrator = "ida",
                         .linear = linear,
                         .rtol = rtol,
                         .t_end = 0.03,
                         .time_count = ROWS,
                         .times = times};
    if (!judged_run(&j, &spec, start, RUNS)) {
        printf("%-7s %-8s %.0e | fails at t = %.3g\n", form, linear, rtol, j.report.t);
        return;
    }
    const kmp_run_report *r = &j.report;
    printf("%-7s %-8s %.0e | %7.1e %7.1e %7.1e | %7.1e %7.1e | %6ld %6ld %6ld %6ld | %8.3f %6.2f\n", form, linear, rtol,
           j.q, j.qd, j.lambda, j.h, j.hdot, r->steps, r->newton, r->rejected, r->factorizations, 1e3 * j.cpu,
           1e6 * j.cpu / (double)r->newton);
}

int bench_forms(int argc, char **argv)
{
    (void)argc, (void)argv;
    static const double rtols[] = {1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13};
    bench b = bench_load("examples/andrews/andrews.yaml");
    kempe_assembly *start = NULL;
    kmp_reference reference;
    if (kempe_assembly_new(b.system, &start) ||
        kmp_reference_read(b.system, "examples/andrews/reference.csv", &reference))
        return 1;
    judged with = {.b = &b, .reference = &reference, .eval = kmp_eval_new(b.system, "tape")};
    printf("%-7s %-8s %-5s | %-7s %-7s %-7s | %-7s %-7s | %6s %6s %6s %6s | %8s %6s\n", "form", "linear", "rtol",
           "error q", "qd", "lambda", "|h|", "|hdot|", "steps", "Newton", "reject", "factor", "cpu ms", "us/it");
    for (int f = 0; kmp_formulation_get(f); f++)
        for (int l = 0; kmp_formulation_get(f)->dae && kmp_linear_name(l); l++)
            for (size_t k = 0; k < sizeof rtols / sizeof *rtols; k++)
                one(&with, start, kmp_formulation_get(f)->form, kmp_linear_name(l), rtols[k]);
    kmp_eval_free(with.eval);
    kmp_samples_free(&reference);
    kempe_assembly_free(start);
    bench_free(&b);
    return 0;
}
