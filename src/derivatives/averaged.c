/* SPDX-License-Identifier: BSD-3-Clause */
#include "derivatives/averaged.h"
#include "base/context.h"
#include "base/memory.h"
#include "dynamics/load_dependent.h"
#include <string.h>

struct kmp_averaged {
    kmp_arena arena;   /* of what is not the given model's */
    kempe_model model; /* a copy that shares the rest */
    kempe_system *system;
};

static const kmp_expr *make(kmp_averaged *a, kmp_expr expr)
{
    kmp_expr *e = KMP_ARENA_NEW(&a->arena, kmp_expr, 1);
    if (e)
        *e = expr;
    return e;
}

/* (next - y)/T; for a delay (u - y)/T */
static const kmp_expr *rate_of(kmp_averaged *a, const kmp_state *state, int motion)
{
    const kmp_expr *own = make(a, (kmp_expr){.kind = KMP_EXPR_QD, .index = motion});
    const kmp_expr *change =
        make(a, (kmp_expr){.kind = KMP_EXPR_SUB, .a = state->next ? state->next : state->delayed, .b = own});
    const kmp_expr *time = state->delay.expr;
    if (!time)
        time = make(a, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = state->next ? state->period : state->delay.value});
    return make(a, (kmp_expr){.kind = KMP_EXPR_DIV, .a = change, .b = time});
}

static bool copy_model(kmp_averaged *a, const kempe_model *given)
{
    kempe_model *m = &a->model;
    *m = *given;
    m->has_digest = false; /* its equations are others */
    m->forces = KMP_ARENA_NEW(&a->arena, kmp_force, m->force_count);
    m->states = KMP_ARENA_NEW(&a->arena, kmp_state, m->state_count);
    if (a->arena.failed)
        return false;
    memcpy(m->forces, given->forces, (size_t)m->force_count * sizeof *m->forces);
    memcpy(m->states, given->states, (size_t)m->state_count * sizeof *m->states);
    for (int k = 0; k < m->state_count; k++)
        if (given->states[k].next || given->states[k].delayed) {
            m->forces[m->force_count - m->state_count + k].effort =
                rate_of(a, &given->states[k], kmp_model_coordinates(m) + k);
            m->states[k].next = m->states[k].delayed = NULL;
        }
    return !a->arena.failed;
}

kempe_status kmp_averaged_new(const kempe_system *given, const char *what, kmp_averaged **averaged)
{
    *averaged = NULL;
    if (!kmp_model_has_samples(given->model) && given->model->delay_count == 0)
        return KEMPE_OK;
    KMP_TRY(kmp_refuse_samples(given->model, what, true));
    KMP_MAKE(given->context, kmp_averaged, a);
    kempe_status status = kmp_made(given->context, copy_model(a, given->model));
    if (status == KEMPE_OK)
        status = kempe_system_new(&a->model, &a->system);
    if (status == KEMPE_OK)
        kempe_system_set_force(a->system, given->force, given->force_user);
    return KMP_GIVE_OR_FREE(status, averaged, a, kmp_averaged_free);
}

void kmp_averaged_free(kmp_averaged *averaged)
{
    if (!averaged)
        return;
    kempe_system_free(averaged->system);
    kmp_arena_free(&averaged->arena);
    kmp_free(averaged);
}

const kempe_system *kmp_averaged_system(const kmp_averaged *averaged, const kempe_system *given)
{
    return averaged ? averaged->system : given;
}
