/* SPDX-License-Identifier: BSD-3-Clause */
/* The balance of a motion by its actuators (inverse_balance.h). */
#include "analyses/inverse/inverse_balance.h"
#include "base/context.h"
#include "constraints/tolerances.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

bool kmp_inverse_balance_make(kmp_inverse_balance *balance, kmp_arena *arena, const kempe_system *system)
{
    return KMP_ARENA_MAKE(arena, KMP_ROOM(int, system->n, &balance->left_u),
                          KMP_ROOM(double, system->n, &balance->left), KMP_ROOM(bool, system->m, &balance->redundant));
}

void kmp_inverse_balance_add(kmp_inverse_balance *b, const kmp_inverse *v, int row, const double *t)
{
    const kempe_model *model = v->system->model;
    const double now = t[row];
    bool first = row == b->singular;
    b->size = fmax(b->size, v->size);
    if (!first && v->freedoms > b->freedoms) {
        b->singular_t = b->singular > 0 ? b->singular_t : now;
        b->singular++;
        return;
    }
    if (!first && v->freedoms < b->freedoms) {
        b->singular_t = t[0];
        b->singular = row;
        memset(b->redundant, 0, (size_t)v->m * sizeof *b->redundant);
        first = true;
    }
    b->freedoms = v->freedoms;
    b->rank = first || v->rank < b->rank ? v->rank : b->rank;
    if (first || v->hold < b->hold) {
        b->hold = v->hold;
        b->hold_t = now;
    }
    if (first || v->residual > b->residual) {
        b->residual = v->residual;
        b->residual_t = now;
    }
    if (first || v->unmet > b->unmet) {
        b->unmet = v->unmet;
        b->unmet_t = now;
        b->left_count = 0;
        for (int k = 0; k < v->p; k++)
            if (v->part.u[k] < kmp_model_coordinates(model)) {
                b->left_u[b->left_count] = v->part.u[k];
                b->left[b->left_count++] = v->left[k];
            }
    }
    for (int k = 0; k < v->part.m - v->part.r; k++) {
        const int dropped = v->part.redundant[k];
        const bool given = /* friction, whose force does not follow from its row */
            kmp_closure_is_of_modes(kmp_model_closure(model, v->system->rows[dropped].closure));
        b->redundant[dropped] = b->redundant[dropped] || (!v->left_out[dropped] && !given);
    }
}

double kmp_inverse_balance_unmet(const kmp_inverse_balance *b)
{
    return b->size > 0 ? b->unmet / b->size : 0;
}

kempe_status kmp_inverse_balance_judge(const kmp_inverse_balance *b, const kempe_system *system)
{
    const kempe_model *model = system->model;
    if (kmp_inverse_balance_unmet(b) <= KMP_EFFORTS_LEFT)
        return KEMPE_OK;
    int most = 0; /* the coordinate with the largest unbalanced force, scaled */
    for (int k = 1; k < b->left_count; k++)
        if (fabs(b->left[k]) * system->scale[b->left_u[k]] > fabs(b->left[most]) * system->scale[b->left_u[most]])
            most = k;
    const int u = b->left_u[most];
    return kmp_fail(system->context, KEMPE_E_FAILED,
                    "the actuators cannot produce this motion: %.6g %s on '%s' are not balanced at t = %.9g s (%.2g of "
                    "all forces); they act on %d of %d degrees of freedom",
                    b->left[most], model->motions[u].rotation ? "N m" : "N", model->motions[u].name, b->unmet_t,
                    kmp_inverse_balance_unmet(b), b->rank, b->freedoms);
}
