/* SPDX-License-Identifier: BSD-3-Clause */
/* The cost of an implicit block: the place where a wheel comes nearest to its rail, 4 arguments, two splines, the best
 * of 16 candidates; and a block of two unknowns. Processor time of one solution, by back end, median of several. */
#include "backend/machine.h"
#include "bench.h"
#include "platform/platform.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { KNOTS = 200, CANDIDATES = 16, POSES = 1000, REPEATS = 20 };

/* A smooth profile with a flange. */
static kmp_table *profile(double first, double last, double flange)
{
    double x[KNOTS], y[KNOTS];
    for (int k = 0; k < KNOTS; k++) {
        x[k] = first + (last - first) * k / (KNOTS - 1);
        y[k] = flange > 0 ? 0.025 * x[k] + 0.028 * exp(-pow((x[k] + 0.05) / 0.012, 2)) : -x[k] * x[k] / (2 * 0.3);
    }
    return kmp_table_new(KMP_TABLE_CUBIC, KNOTS, x, y);
}

static int contact_block(kmp_graph *g)
{
    kmp_graph *l = kmp_graph_new();
    kmp_table *wheel = profile(-0.065, 0.06, 1), *rail = profile(-0.036, 0.036, 0);
    int of_wheel = kmp_graph_add_table(l, wheel), of_rail = kmp_graph_add_table(l, rail);
    kmp_table_free(wheel);
    kmp_table_free(rail);
    kmp_ref s = kmp_input(l, KMP_IN_Q, 0), p[4], one = KMP_ONE;
    for (uint32_t k = 0; k < 4; k++)
        p[k] = kmp_input(l, KMP_IN_PARAMETER, k);
    kmp_ref e1 = p[2], e3 = p[3], c2 = kmp_sub(l, KMP_ONE, kmp_mul(l, e1, e1));
    kmp_ref c = kmp_sqrt(l, c2), e2 = kmp_sqrt(l, kmp_sub(l, c2, kmp_mul(l, e3, e3)));
    kmp_ref r = kmp_sub(l, kmp_const(l, 0.46), kmp_table_at(l, of_wheel, s));
    kmp_ref slope = kmp_neg(kmp_table_derivative_at(l, of_wheel, 1, s));
    kmp_ref sine = kmp_div(l, kmp_mul(l, slope, e1), c);
    kmp_ref cosine = kmp_sqrt(l, kmp_sub(l, KMP_ONE, kmp_mul(l, sine, sine)));
    kmp_ref along = kmp_div(l, kmp_mul(l, r, kmp_mul(l, sine, e1)), c), down = kmp_div(l, kmp_mul(l, r, cosine), c);
    kmp_ref y = kmp_add(l, p[0], kmp_mul(l, s, e2)), z = kmp_add(l, p[1], kmp_mul(l, s, e3));
    y = kmp_add(l, kmp_sub(l, y, kmp_mul(l, along, e2)), kmp_mul(l, down, e3));
    z = kmp_sub(l, kmp_sub(l, z, kmp_mul(l, along, e3)), kmp_mul(l, down, e2));
    kmp_ref gap = kmp_sub(l, z, kmp_table_at(l, of_rail, y));
    kmp_derivative *d = kmp_derivative_new(l, 1, &s, &one);
    kmp_ref residual = kmp_derivative_of(d, gap);
    kmp_derivative_free(d);
    double candidate[CANDIDATES];
    for (int k = 0; k < CANDIDATES; k++)
        candidate[k] = -0.03 + 0.06 * k / (CANDIDATES - 1);
    return kmp_graph_add_implicit(g, kmp_implicit_new_among(l, 1, 4, &residual, &residual, CANDIDATES, candidate, gap));
}

/* Two unknowns: a circle and a line. */
static int plain_block(kmp_graph *g)
{
    kmp_graph *l = kmp_graph_new();
    kmp_ref x = kmp_input(l, KMP_IN_Q, 0), y = kmp_input(l, KMP_IN_Q, 1), p[4], residual[2], guess[2];
    for (uint32_t k = 0; k < 4; k++)
        p[k] = kmp_input(l, KMP_IN_PARAMETER, k);
    guess[0] = KMP_ONE;
    guess[1] = p[1];
    residual[0] = kmp_sub(l, kmp_add(l, kmp_mul(l, x, x), kmp_mul(l, y, y)), KMP_ONE);
    residual[1] = kmp_sub(l, kmp_add(l, kmp_mul(l, p[0], x), kmp_add(l, p[2], p[3])), y);
    return kmp_graph_add_implicit(g, kmp_implicit_new(l, 2, 4, residual, guess));
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void measure(const char *name, int (*block)(kmp_graph *), int unknowns, const char *backend)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref p[4], y[KMP_IMPLICIT_MOST];
    for (uint32_t k = 0; k < 4; k++)
        p[k] = kmp_input(g, KMP_IN_Q, k);
    kmp_implicit_at(g, block(g), p, y);
    for (int j = 0; j < unknowns; j++)
        y[j] = kmp_add(g, y[j], p[j]); /* a program has some arithmetic */
    const kmp_ref *group = y;
    kmp_program *program = kmp_program_new(g, 1, &unknowns, &group);
    kmp_machine *m = kmp_machine_new(program, kmp_backend_find(backend));
    double time[REPEATS], sum = 0;
    const kmp_program *inner = program->block[0].program;
    for (int r = 0; r < REPEATS; r++) {
        double begin = kmp_cpu_now();
        for (int k = 0; k < POSES; k++) {
            double u = (k + 0.5) / POSES, q[4] = {0.004 * sin(13 * u), 0.46, 0.02 * sin(5 * u), 0.01 * cos(9 * u)};
            kmp_machine_set(m, KMP_IN_Q, q);
            sum += *kmp_machine_run(m, 1);
        }
        time[r] = (kmp_cpu_now() - begin) / POSES;
    }
    qsort(time, REPEATS, sizeof *time, by_size);
    printf("%-8s %-8s %3d operations, %2d candidates: %7.3f us (sum %.17g)\n", name, backend,
           inner->code[inner->stages], program->block[0].candidates, 1e6 * time[REPEATS / 2], sum);
    kmp_machine_free(m);
    kmp_program_free(program);
    kmp_graph_free(g);
}

/* A back end may be named. */
int bench_blocks(int argc, char **argv)
{
    static const char *const backends[] = {"tape", "native"};
    for (int k = 0; k < (argc > 1 ? 1 : 2); k++) {
        const char *backend = argc > 1 ? argv[1] : backends[k];
        measure("contact", contact_block, 1, backend);
        measure("plain", plain_block, 2, backend);
    }
    return 0;
}
