/* SPDX-License-Identifier: BSD-3-Clause */
/* Pivots on which the decision on the rank of J depends: those of complete pivoting of the scaled J, over the first, of
 * the models named, by decades: where they are assembled, at states that a random walk closes, and in the rows of a
 * run. Those between the rows that count and the rounding of those that do not are what KMP_RANK
 * (constraints/tolerances.h) has to divide.
 *
 *     bench ranks MODEL ... */
#include "bench.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/random_walk.h"
#include "constraints/tolerances.h"
#include "model/data/run_settings.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

enum { DECADES = 19, WALKS = 8, ASSEMBLED = 0, WALKED, RUN, PLACES };

static long found[DECADES][PLACES];
static double least_kept[PLACES] = {1, 1, 1}, most_dropped[PLACES];
static int models;

/* The scaled J (m x n) of the walk; destroyed. */
static void count(kmp_walk *w, int place)
{
    int m = w->m, n = w->n, most = m < n ? m : n, *row = calloc((size_t)m + 1, sizeof *row),
        *col = calloc((size_t)n + 1, sizeof *col);
    double *pivots = calloc((size_t)(m + n) + 1, sizeof *pivots);
    if (!row || !col || !pivots)
        exit(1);
    kmp_lu_complete(m, n, memcpy(w->copy, w->jacobian, (size_t)(m * n) * sizeof *w->copy), NULL, row, col, pivots);
    for (int k = 0; k < most && pivots[0] > KMP_RANK_FIRST; k++) {
        double part = pivots[k] / pivots[0];
        int decade = part > 0 ? (int)floor(-log10(part)) : DECADES - 1;
        found[decade < DECADES ? decade : DECADES - 1][place]++;
        if (part > KMP_RANK)
            least_kept[place] = fmin(least_kept[place], part);
        else
            most_dropped[place] = fmax(most_dropped[place], part);
    }
    free(row);
    free(col);
    free(pivots);
}

/* Along random tangents, as `check` does. */
static void walk(kmp_walk *w, const double *start)
{
    unsigned state = 7;
    double *q = calloc((size_t)w->n, sizeof *q);
    if (!q)
        exit(1);
    memcpy(q, start, (size_t)w->n * sizeof *q);
    kmp_walk_evaluate(w, q);
    for (int k = 0; k < WALKS; k++) {
        int free_count = w->n - kmp_walk_tangents(w, w->n);
        for (int c = 0; c < free_count; c++) {
            double part = 0.2 * kmp_walk_random(&state);
            for (int i = 0; i < w->n; i++)
                q[i] += part * w->basis[i + c * w->n] * w->system->scale[i];
        }
        if (!kmp_walk_close(w, q))
            break;
        count(w, WALKED);
    }
    free(q);
}

static void run(kmp_walk *w, const kempe_system *system)
{
    kempe_run_options settings = {0};
    kempe_trajectory *t = NULL;
    settings.t_end = fmin(kmp_model_run(system->model)->t_end > 0 ? kmp_model_run(system->model)->t_end : 1, 1);
    if (kempe_simulate(system, &settings, &t) == KEMPE_OK && system->chart_count == 0)
        for (int k = 0; k < kempe_trajectory_row_count(t); k++) {
            kmp_walk_evaluate(w, kempe_trajectory_q(t, k));
            count(w, RUN);
        }
    kempe_trajectory_free(t);
}

static void look_at(const char *path)
{
    bench b = {kempe_context_new(), NULL, NULL};
    kempe_assembly *a = NULL;
    if (!kempe_model_read(b.context, path, &b.model) && !kempe_system_new(b.model, &b.system) && b.system->m > 0 &&
        !b.system->rheonomic && kempe_assembly_new(b.system, &a) == KEMPE_OK && !a->inner_q) {
        kmp_walk *w = kmp_walk_new(b.system);
        if (!w)
            exit(1);
        models++;
        kmp_walk_evaluate(w, a->q);
        count(w, ASSEMBLED);
        walk(w, a->q);
        run(w, b.system);
        kmp_walk_free(w);
    }
    kempe_assembly_free(a);
    bench_free(&b);
}

int bench_ranks(int argc, char **argv)
{
    for (int k = 1; k < argc; k++)
        look_at(argv[k]);
    printf("%d models with loops\npivots of the scaled J over the first, by decades\n%-16s %12s %12s %12s\n", models,
           "from .. to", "assembled", "walked", "in runs");
    for (int d = 0; d < DECADES; d++)
        printf("1e-%02d .. 1e-%02d   %12ld %12ld %12ld\n", d, d + 1, found[d][ASSEMBLED], found[d][WALKED],
               found[d][RUN]);
    printf("%-16s %12.1e %12.1e %12.1e\n%-16s %12.1e %12.1e %12.1e\n", "least above", least_kept[ASSEMBLED],
           least_kept[WALKED], least_kept[RUN], "most below", most_dropped[ASSEMBLED], most_dropped[WALKED],
           most_dropped[RUN]);
    return 0;
}
