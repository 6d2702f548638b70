/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/doubted_state.h"
#include "constraints/evaluation/left_tables.h"
#include "constraints/evaluation/state_ends.h"

void kmp_eval_doubt_state(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, bool forces, const double *shown)
{
    int k = kmp_eval_leaves(eval, t, q, qd, qdd, lambda) ? 0 : eval->system->events.count, end;
    double x;
    kmp_eval_doubt_ends(eval, forces ? KMP_ENDS_OF_MODEL : KMP_ENDS_OF_PLACES, t, q, qd, qdd, lambda);
    for (const kmp_named_table *left; (left = kmp_eval_next_left(eval, &k, &end, &x));)
        if (forces || kmp_is_in_closures(eval->system->model, eval->system->events.condition[k - 1].expr))
            kmp_eval_tell_table(eval, left, end, x, t);
    if (shown)
        kmp_eval_tell_shown(eval, t, shown);
}
