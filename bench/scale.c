/* SPDX-License-Identifier: BSD-3-Clause */
/* Chains of N windows (IFToMM A02), N = 2 .. 2000: what deriving, one right-hand side of the reduced road, one residual
 * with its Jacobian and one accepted step of the dae road cost, in total and a coordinate.
 *
 *     scale [LARGEST N [unequal]]
 */
#include "base/text.h"
#include "bench.h"
#include "constraints/partition.h"
#include "integrators/run.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct chain {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    double derive_s;
} chain;

/* Unequal: each window a little wider and the bars of different masses, so that nothing is alike. */
static char *windows(int n, bool unequal)
{
    kmp_text t = {0};
    kmp_text_put(&t, "kempe: 1\nname: chain\ngravity: [0, -9.81, 0]\nground: {points: {");
    for (int i = 0; i <= n; i++)
        kmp_text_printf(&t, "%sG%d: [%.17g, 0, 0]", i ? ", " : "", i, unequal ? i * (1 + 0.001 * i) : i);
    kmp_text_put(&t, "}}\nbodies:\n");
    for (int i = 0; i <= 2 * n; i++) {
        bool upright = i <= n;
        int k = upright ? i : i - n - 1;
        double l = upright || !unequal ? 1 : (k + 1) * (1 + 0.001 * (k + 1)) - k * (1 + 0.001 * k);
        kmp_text_printf(&t, "  %c%d: {joint: {name: %c%d, revolute: z, at: ", upright ? 'v' : 'h', k,
                        upright ? 'a' : 'b', k);
        kmp_text_printf(&t, upright ? "ground.G%d" : "v%d.T", k);
        kmp_text_printf(&t, "}, mass: %.17g, com: [%.17g, 0, 0], inertia: {zz: %.17g}, points: {T: [%.17g, 0, 0]}}\n",
                        unequal ? 1 + 0.01 * (i % 7) : 1, l / 2, l * l / 12, l);
    }
    kmp_text_put(&t, "loops:\n");
    for (int i = 0; i < n; i++)
        kmp_text_printf(&t, "  C%d: {ball: [h%d.T, v%d.T]}\n", i, i, i + 1);
    kmp_text_put(&t, "start:\n  q: {");
    for (int i = 0; i <= 2 * n; i++)
        kmp_text_printf(&t, "%s%c%d: %s", i ? ", " : "", i <= n ? 'a' : 'b', i <= n ? i : i - n - 1,
                        i <= n ? "90 deg" : "-90 deg");
    kmp_text_put(&t, "}\n  qd: {");
    for (int i = 0; i <= 2 * n; i++)
        kmp_text_printf(&t, "%s%c%d: %d", i ? ", " : "", i <= n ? 'a' : 'b', i <= n ? i : i - n - 1, i <= n ? -1 : 1);
    kmp_text_put(&t, "}\n");
    return kmp_text_take(&t);
}

static bool make(chain *c, int n, bool unequal)
{
    char *text = windows(n, unequal);
    double begin = bench_now();
    *c = (chain){.context = kempe_context_new()};
    bool made = text && kempe_model_read_text(c->context, text, "chain", &c->model) == KEMPE_OK &&
                kempe_system_new(c->model, &c->system) == KEMPE_OK;
    c->derive_s = bench_now() - begin;
    free(text);
    return made;
}

static void unmake(chain *c)
{
    kempe_system_free(c->system);
    kempe_model_free(c->model);
    kempe_context_free(c->context);
}

static int ignore(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                  double work)
{
    (void)user, (void)t, (void)q, (void)qd, (void)qdd, (void)lambda, (void)work;
    return 0;
}

/* Runs a short while; the report's CPU time is of the integration alone. */
static bool run(const chain *c, const kempe_assembly *start, const char *road, const char *form, double rtol,
                double t_end, kmp_run_report *report)
{
    kmp_run_spec spec = {.road = road,
                         .form = form,
                         .linear = strcmp(road, "dae") ? NULL : "klu",
                         .rtol = rtol,
                         .t_end = t_end,
                         .time_count = 1,
                         .times = &t_end};
    *report = (kmp_run_report){0};
    if (kmp_run_resolve(c->system, &spec) != KEMPE_OK)
        return false;
    return kmp_run(c->system, &spec, start, ignore, NULL, report) == KEMPE_OK;
}

static void measure(int n, bool unequal)
{
    chain c;
    kempe_assembly *start = NULL;
    kmp_run_report r[2] = {{0}, {0}};
    bool went[2] = {false, false};
    double begin = 0, assemble_s = 0;
    if (make(&c, n, unequal)) {
        begin = bench_now();
        bool closed = kempe_assemble(c.system, &start) == KEMPE_OK;
        assemble_s = bench_now() - begin;
        if (closed) {
            went[0] = run(&c, start, "reduced", "carried", 1e-8, 0.2, &r[0]);
            went[1] = run(&c, start, "dae", "ah", 1e-6, 0.05, &r[1]);
        }
    }
    int size = 2 * n + 1;
    printf("%5d %6d | %8.3f %8.3f | %8.3f %6ld %10.2f %8.1f | %8.3f %6ld %10.2f %8.1f%s\n", n, size, c.derive_s,
           assemble_s, r[0].build_s, r[0].rhs, 1e6 * r[0].cpu_s / fmax(1, (double)r[0].rhs),
           1e9 * r[0].cpu_s / fmax(1, (double)r[0].rhs) / size, r[1].build_s, r[1].steps,
           1e6 * r[1].cpu_s / fmax(1, (double)r[1].steps), 1e9 * r[1].cpu_s / fmax(1, (double)r[1].steps) / size,
           went[0] && went[1] ? "" : "  failed");
    if (!(went[0] && went[1]))
        printf("      %s\n", r[0].reason ? r[0].reason : r[1].reason ? r[1].reason : kempe_context_message(c.context));
    fflush(stdout);
    free(r[0].reason);
    free(r[1].reason);
    kempe_assembly_free(start);
    unmake(&c);
}

int main(int argc, char **argv)
{
    static const int sizes[] = {2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000};
    int largest = argc > 1 ? atoi(argv[1]) : 2000;
    bool unequal = argc > 2;
    printf("%5s %6s | %8s %8s | %8s %6s %10s %8s | %8s %6s %10s %8s\n", "N", "coord.", "derive", "assemble", "reduced",
           "rhs", "us a rhs", "ns each", "dae", "steps", "us a step", "ns each");
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes && sizes[k] <= largest; k++)
        measure(sizes[k], unequal);
    return 0;
}
