/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/formulations/formulation.h"
#include "base/memory.h"
#include <string.h>

void *kmp_formulation_new(const kmp_formulation_start *start, size_t bytes)
{
    kmp_formulation *formulation = kmp_calloc(1, bytes);
    if (!formulation) {
        (void)kmp_fail_memory(start->system->context);
        return NULL;
    }
    formulation->n = start->part->n;
    formulation->release = kmp_formulation_free;
    return formulation;
}

void kmp_formulation_free(kmp_formulation *formulation)
{
    kmp_text_free(&formulation->reason);
    kmp_arena_free(&formulation->arena);
    kmp_free(formulation);
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
        formulation->atol[i] = start->atol * start->system->scale[i];
        formulation->atol[n + i] = formulation->atol[i] * start->rate_scale;
    }
}

void kmp_formulation_position_of_state(kmp_formulation *formulation, double t, const double *y, double *q)
{
    (void)t;
    memcpy(q, y, (size_t)formulation->n * sizeof *q);
}
