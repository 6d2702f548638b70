/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/doubted_state.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/evaluation/validity.h"

void kmp_eval_doubt_state(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, bool forces, bool rates, const double *shown)
{
    const kmp_condition *condition = eval->system->events.condition;
    int from = kmp_eval_validity(eval, t, q, qd, qdd, lambda) ? 0 : eval->system->events.count;
    kmp_eval_doubt_ends(eval, forces ? KMP_ENDS_OF_MODEL : KMP_ENDS_OF_PLACES, t, q, qd, qdd, lambda);
    for (int k; (k = kmp_eval_next_invalid(eval, &from)) >= 0;)
        if ((condition[k].validity != KMP_VALIDITY_ROTATION || rates) &&
            (forces || (condition[k].expr && kmp_is_in_closures(eval->system->model, condition[k].expr))))
            kmp_eval_report_invalid(eval, k, t);
    if (shown)
        kmp_eval_report_tables(eval, t, shown);
}
