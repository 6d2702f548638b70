/* SPDX-License-Identifier: BSD-3-Clause */
/* Work of non-conservative forces where it is not an unknown of the formulation. */
#include "integrators/run/runner.h"

/* Power at the dense state in run->y, moving closures included. If it needs multipliers these come from the row. */
static double power_at(kmp_runner *run, double t)
{
    int n = run->s->n;
    double *row = run->moved, *lambda = row + 3 * n, work;
    bool asked = run->s->rheonomic || run->s->load_row_count > 0;
    asked = asked && kmp_formulation_row(run->formulation, t, run->y, row, &work) == KMP_GO;
    double power = kmp_eval_power(run->eval, t, run->y, run->y + n);
    if (!asked || !run->s->rheonomic)
        return power;
    kmp_eval_closure(run->eval, t, run->y);
    return power + kmp_eval_drive_power(run->eval, lambda);
}

/* Quadrature with Gauss's three points on the integrator's polynomial, from work_t to t within the last step. */
kempe_status kmp_runner_add_work(kmp_runner *run, double t)
{
    static const double node[3] = {-0.7745966692414834, 0, 0.7745966692414834};
    static const double weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
    double a = run->work_t, h = t - a;
    if (!run->yp || !run->way->dae || !run->s->dissipative || !(h > 0))
        return KEMPE_OK;
    for (int k = 0; k < 3; k++) {
        double at = a + 0.5 * h * (1 + node[k]);
        KMP_TRY(run->kind->dense(run->solver, at, run->y, run->yp));
        run->work += 0.5 * h * weight[k] * power_at(run, at);
    }
    run->work_t = t;
    return KEMPE_OK;
}
