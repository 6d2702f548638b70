/* SPDX-License-Identifier: BSD-3-Clause */
/* Common parts of formulations: allocation, unknowns (q, qd) with their tolerances, rows in one array. Dropped rows are
 * checked at each accepted step: if one opens, the start was a change point of lower rank. */
#include "integrators/formulations/formulation.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "integrators/decide/dropped_rows.h"
#include "integrators/decide/run_start.h"
#include "model/data/closure.h"
#include "model/data/state.h"
#include <string.h>

void *kmp_formulation_new(const kmp_formulation_start *start, size_t bytes)
{
    kmp_formulation *formulation = kmp_calloc(1, bytes);
    if (!formulation) {
        (void)kmp_fail_memory(start->system->context);
        return NULL;
    }
    formulation->n = start->part->n;
    formulation->part = start->part;
    formulation->release = kmp_formulation_free;
    return formulation;
}

void kmp_formulation_free(kmp_formulation *formulation)
{
    kmp_text_free(&formulation->reason);
    kmp_arena_free(&formulation->arena);
    kmp_free(formulation);
}

int kmp_formulation_row(kmp_formulation *formulation, double t, const double *y, double *row, double *work)
{
    int n = formulation->n;
    return formulation->row(formulation, t, y, row, row + n, row + 2 * n, row + 3 * n, work);
}

void kmp_formulation_make_unknowns(kmp_formulation *formulation, int size, bool slopes)
{
    formulation->size = size;
    formulation->y = KMP_ARENA_NEW(&formulation->arena, double, size);
    formulation->atol = KMP_ARENA_NEW(&formulation->arena, double, size);
    formulation->yp = slopes ? KMP_ARENA_NEW(&formulation->arena, double, size) : NULL;
}

void kmp_formulation_begin_with_state(kmp_formulation *formulation, const kmp_formulation_start *start)
{
    int n = formulation->n;
    for (int i = 0; i < n; i++) {
        formulation->y[i] = start->q[i];
        formulation->y[n + i] = start->qd[i];
        kmp_start_tolerance(kmp_state_of(start->system->model, i) != NULL, start->atol * start->system->scale[i],
                            start->rate_scale, &formulation->atol[i], &formulation->atol[n + i]);
    }
}

void kmp_formulation_position_of_state(kmp_formulation *formulation, double t, const double *y, double *q)
{
    (void)t;
    memcpy(q, y, (size_t)formulation->n * sizeof *q);
}

int kmp_redundant_check(const kmp_evaluator *eval, const kmp_partition *part, double t, double tolerance,
                        kmp_text *reason)
{
    const kmp_rounding *rounding = kmp_rounding_of(eval->system);
    const int row = kmp_dropped_open(part->r, part->rows, part->m - part->r, part->redundant, 1, eval->h,
                                     eval->system->row_scale, tolerance, rounding ? rounding->tolerance : 0);
    if (row < 0)
        return KMP_GO;
    kmp_text_printf(reason,
                    "constraint equation '%s', redundant at the start, is open by %.3g (relative) at t = %.9g s: %s",
                    eval->system->row_names[row], kmp_eval_opening(eval, row), t,
                    eval->system->rheonomic ? "drives and closures that move with time contradict each other, or the "
                                              "run began at a change point"
                                            : "the run began at a change point; start near it instead");
    return KMP_HALT;
}

const char *kmp_formulation_row_of_rates(const kempe_system *system)
{
    for (int r = 0; r < system->m; r++)
        if (system->rows[r].of_rates)
            return kmp_model_closure(system->model, system->rows[r].closure)->name;
    return NULL;
}
