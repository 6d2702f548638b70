/* SPDX-License-Identifier: BSD-3-Clause */
/* Stiff mechanisms with stiffness and damping as given, a hundredfold and ten thousandfold: the flyball governor
 * (IFToMM A05), a tree, over 10 s, and a slider-crank with an elastic rod, a loop, over 2 s. Errors, steps, evaluations
 * and times of the implicit ways; errors against reference.csv where the governor is as it is, else against a run of
 * radau9 at rtol 1e-13. */
#include "bench.h"
#include "integrators/run/methods.h"
#include "judged.h"
#include "stiffened.h"
#include <kempe/check.h>

typedef struct mechanism {
    const char *path, *given;
    double t_end, every;
} mechanism;

typedef struct method {
    const char *formulation, *integrator;
    int last; /* exponent of rtol */
} method;

static const method methods[] = {{"reduced", "bdf", -12},    {"reduced", "ida", -12},    {"dae", "ida", -12},
                                 {"reduced", "radau5", -12}, {"reduced", "radau9", -12}, {"reduced", "dirk", -8},
                                 {"projected", "radau", -12}};

enum { METHODS = sizeof methods / sizeof *methods, MOST_TIMES = 64 };

static void one(const judged *with, const kempe_assembly *start, const method *w, double rtol)
{
    judged j = *with;
    kmp_run_spec spec = {.formulation = w->formulation,
                         .integrator = w->integrator,
                         .rtol = rtol,
                         .t_end = j.reference->t[j.reference->rows - 1],
                         .time_count = j.reference->rows,
                         .times = j.reference->t};
    bool good = judged_run(&j, &spec, start, 5);
    const kmp_run_report *r = &j.report;
    printf("  %-8s %-6s %.0e | ", w->formulation, w->integrator, rtol);
    if (good)
        printf("%7.1e | %7ld %7ld %7ld %6ld %6ld | %9.2f\n", j.q, r->steps, r->rhs, r->newton, r->factorizations,
               r->refused, 1e3 * j.cpu);
    else
        printf("fails at t = %.3g\n", r->t);
}

/* By a run of our own, at equal times. */
static void refer(const bench *b, const mechanism *m, const kempe_assembly *start, kmp_reference *reference)
{
    double times[MOST_TIMES];
    kmp_samples table;
    kmp_run_report report;
    int rows = (int)(m->t_end / m->every + 0.5);
    for (int k = 0; k < rows; k++)
        times[k] = k + 1 == rows ? m->t_end : m->every * (k + 1);
    kmp_run_spec spec = {.integrator = "radau9", .rtol = 1e-13, .t_end = m->t_end, .time_count = rows, .times = times};
    kmp_samples_init(&table, b->system->n, b->system->m);
    if (kmp_run_resolve(b->system, &spec) || kmp_run(b->system, &spec, start, kmp_samples_add, &table, &report))
        exit(1);
    *reference = table;
}

static void scene(const mechanism *m, const char *stiffness, const char *digits)
{
    bench b = {kempe_context_new(), NULL, NULL};
    kempe_assembly *start = NULL;
    kmp_reference reference;
    if (kempe_model_read_text(b.context, stiffened(m->path, m->given, stiffness), "model", &b.model) ||
        kempe_system_new(b.model, &b.system) || kempe_assembly_new(b.system, &start))
        exit(1);
    if (!digits)
        refer(&b, m, start, &reference);
    else if (kmp_reference_read(b.system, digits, &reference))
        exit(1);
    judged with = {.b = &b, .reference = &reference};
    printf("%s, %s\n", kempe_model_name(b.model), stiffness);
    for (int w = 0; w < METHODS; w++)
        for (int e = -6; e >= methods[w].last; e -= 2)
            one(&with, start, &methods[w], pow(10, e));
    kmp_samples_free(&reference);
    kempe_assembly_free(start);
    bench_free(&b);
}

int bench_governor(int argc, char **argv)
{
    (void)argc, (void)argv;
    static const mechanism governor = {"examples/governor/governor.yaml", "K: 8e5, c: 4e4", 10, 0.5};
    static const mechanism rod = {"tests/models/elastic_rod.yaml", "K: 2e6, c: 1e4", 2, 0.1};
    printf("  %-8s %-6s %-5s | %-7s | %7s %7s %7s %6s %6s | %9s\n", "formulation", "", "rtol", "error q", "steps",
           "rhs", "Newton", "factor", "refuse", "cpu ms");
    scene(&governor, governor.given, "examples/governor/reference.csv");
    scene(&governor, "K: 8e7, c: 4e6", NULL);
    scene(&governor, "K: 8e9, c: 4e8", NULL);
    scene(&rod, rod.given, NULL);
    scene(&rod, "K: 2e8, c: 1e6", NULL);
    scene(&rod, "K: 2e10, c: 1e8", NULL);
    return 0;
}
