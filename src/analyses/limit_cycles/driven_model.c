/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/limit_cycles/driven_model.h"
#include "base/context.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include <string.h>

/* A number of the start as an expression. */
static const kmp_expr *expr_of(kmp_arena *arena, const kmp_number *number)
{
    return number->expr ? number->expr
                        : kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = number->value});
}

kempe_status kmp_driven_model(const kempe_model *model, const kmp_driven *driven, kempe_model **instance)
{
    kempe_model *m = NULL;
    KMP_TRY(kmp_variant_instance(model, 0, NULL, NULL, &m));
    kmp_closure *closures = KMP_ARENA_NEW(&m->arena, kmp_closure, m->closure_count + driven->count);
    if (closures) {
        if (m->closure_count > 0)
            memcpy(closures, m->closures, (size_t)m->closure_count * sizeof *closures);
        m->closures = closures;
        for (int k = 0; k < driven->count; k++) {
            /* Drives a coordinate from its start value at the rate of the start: q = q_0 + qd_0 t. */
            int motion = driven->motion[k];
            kmp_arena *a = &m->arena;
            const kmp_expr *time = kmp_expr_make(a, (kmp_expr){.kind = KMP_EXPR_TIME});
            const kmp_expr *from = expr_of(a, &m->start.q[motion]), *rate = expr_of(a, &m->start.qd[motion]);
            const kmp_expr *way = kmp_expr_make(a, (kmp_expr){.kind = KMP_EXPR_MUL, .a = rate, .b = time});
            m->closures[m->closure_count++] = (kmp_closure){
                .name = kmp_arena_printf(a, "load.%s", m->motions[motion].name),
                .kind = KMP_CLOSURE_drive,
                .point = {-1, -1},
                .motion = motion,
                .function = kmp_expr_make(a, (kmp_expr){.kind = KMP_EXPR_ADD, .a = from, .b = way}),
            };
            m->start.qd_given[motion] = false; /* the drive has it */
        }
    }
    if (driven->hold) {
        /* The start is q, and keeps the chosen coordinates: values of the file are not guesses any more. */
        int n = kmp_model_coordinates(m);
        bool *hold = KMP_ARENA_NEW(&m->arena, bool, m->motion_count);
        for (int i = 0; hold && i < n; i++) {
            hold[i] = driven->hold[i];
            m->start.q_given[i] = m->start.q_given[i] && hold[i];
            m->start.qd_given[i] = m->start.qd_given[i] && hold[i];
            m->start.q[i] = (kmp_number){.value = driven->q[i]};
        }
        m->start.hold = hold;
        for (int i = 0; i < m->cut_coordinate_count; i++)
            m->cut_coordinates[i].q_given = m->cut_coordinates[i].qd_given = false;
    }
    return KMP_GIVE_OR_FREE(kmp_made(model->context, !m->arena.failed), instance, m, kempe_model_free);
}
