/* SPDX-License-Identifier: BSD-3-Clause */
/* M, C, h, J and jdqd of the library's workspace at the states of compiled_equations.h. */
#ifndef KEMPE_TESTS_WORKSPACE_EQUATIONS_H
#define KEMPE_TESTS_WORKSPACE_EQUATIONS_H

#include "constraints/evaluation/evaluator.h"
#include "generate/compiled_equations.h"
#include "model/data/force.h"
#include "model/data/state.h"

static inline double largest(int count, const double *x)
{
    double most = 1;
    for (int k = 0; k < count; k++)
        most = isfinite(x[k]) ? fmax(most, fabs(x[k])) : most;
    return most;
}

/* The inputs of a state, in place of those of the model. */
static inline void take_inputs(kmp_evaluator *eval, const state *s)
{
    int input;
    for (int k = 0; k < eval->inputs.count; k++)
        kmp_present_inputs_give(&eval->inputs, k, s->time[0], s->time + 1 + KMP_TIME_NUMBERS * k);
    (void)kmp_present_inputs_enter(&eval->inputs, s->time[0], &input);
}

/* The modes of friction of a state. */
static inline void take_modes(kmp_evaluator *eval, const state *s)
{
    const kempe_model *model = eval->system->model;
    const kmp_events *events = &eval->system->events;
    eval->conditions.holds_friction = true;
    for (int k = 0; k < events->count; k++) {
        int element = 0;
        for (int f = 0; events->condition[k].role && kmp_model_force(model, f) != events->condition[k].of; f++)
            element += kmp_force_has_modes(kmp_model_force(model, f));
        if (events->condition[k].role)
            eval->conditions.mode[k] = s->mode[element * (KMP_ROLES_OF_ALL) + (int)events->condition[k].role - 1];
    }
    if (events->count > 0)
        kmp_eval_set_modes(eval, eval->conditions.mode);
}

/* M, C, h, J by rows, jdqd, as the functions give them. */
static inline double *evaluate(kmp_evaluator *eval, const state *s, double *out)
{
    int n = eval->n, m = eval->m;
    take_inputs(eval, s);
    take_modes(eval, s);
    kmp_eval_closure(eval, s->time[0], s->q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, s->qd);
    kmp_eval_dense_mass(eval, out);
    out += n * n;
    memcpy(out, eval->bias, (size_t)n * sizeof *out);
    for (int k = 0; k < n; k++) {
        const kmp_state *delay = kmp_state_of(eval->system->model, k);
        if (delay && delay->delayed) /* which has no rate in generated code */
            out[k] = 0;
    }
    out += n;
    memcpy(out, eval->h, (size_t)m * sizeof *out);
    out += m;
    const kmp_pattern *p = &eval->system->jacobian;
    memset(out, 0, (size_t)(m * n) * sizeof *out);
    for (int k = 0; k < p->count; k++)
        out[p->row[k] * n + p->col[k]] = eval->jacobian[k];
    out += m * n;
    memcpy(out, eval->jdqd, (size_t)m * sizeof *out);
    return out + m;
}

/* The largest difference of two arrays, relative to the largest entry. */
static inline double distance(int count, const double *a, const double *b)
{
    double size = largest(count, b), most = 0;
    for (int k = 0; k < count; k++)
        most = isfinite(b[k]) ? fmax(most, fabs(a[k] - b[k]) / size) : most;
    return most;
}

#endif
