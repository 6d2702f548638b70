/* SPDX-License-Identifier: BSD-3-Clause */
/* All sets of equations of a model as numbers at a state. */
#ifndef KEMPE_TESTS_DERIVED_H
#define KEMPE_TESTS_DERIVED_H

#include "backend/machine.h"
#include "base/memory.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "model/data/closure.h"
#include "model/data/parameter.h"
#include "random.h"
#include "symbolic/program.h"
#include <string.h>

enum { STATE_MAX = 128, DERIVED_SETS = 26 };

typedef struct state {
    double t, q[STATE_MAX], qd[STATE_MAX], qdd[STATE_MAX], lambda[STATE_MAX], mu[STATE_MAX], kept[STATE_MAX];
} state;

typedef struct derived {
    kmp_equations eq;
    kmp_program *program;
    kmp_machine *machine;
    double parameters[8];
    int n, m;
    /* owned by the machine; entries of M above the diagonal are zero */
    const double *mass, *bias, *h, *h_t, *jacobian, *jdqd, *residual, *jt_mu, *hdot, *potential, *power, *reaction,
        *position, *shown, *accelerations, *multipliers, *pivots, *diagonals, *correction, *inverse, *closed,
        *inverse_q, *inverse_qd, *closed_q, *power_q, *power_qd;
} derived;

static inline state random_state_vectors(void)
{
    state s = {.t = between(0, 2)};
    for (int k = 0; k < STATE_MAX; k++) {
        s.q[k] = between(-2, 2);
        s.qd[k] = between(-2, 2);
        s.qdd[k] = between(-5, 5);
        s.lambda[k] = between(-5, 5);
        s.mu[k] = between(-2, 2);
        s.kept[k] = 1;
    }
    return s;
}

typedef struct derived_set {
    const kmp_ref *of;
    int count;
    const double **to;
} derived_set;

static inline int derived_list(derived *d, derived_set *set)
{
    const kmp_equations *eq = &d->eq;
    int n = d->n, m = d->m;
    const derived_set all[] = {{eq->dynamics.mass, n * n, &d->mass},
                               {eq->dynamics.bias, n, &d->bias},
                               {eq->closures.h, m, &d->h},
                               {eq->closures.h_t, m, &d->h_t},
                               {eq->closures.jacobian, m * n, &d->jacobian},
                               {eq->closures.jdqd, m, &d->jdqd},
                               {eq->dynamics.residual, n, &d->residual},
                               {eq->dynamics.jt_mu, n, &d->jt_mu},
                               {eq->closures.hdot, m, &d->hdot},
                               {&eq->energy.potential, 1, &d->potential},
                               {&eq->energy.power, 1, &d->power},
                               {eq->closures.reaction, 3 * kmp_model_closure_count(eq->model), &d->reaction},
                               {eq->outputs.position, 3 * eq->outputs.position_count, &d->position},
                               {eq->outputs.shown, eq->outputs.shown_count, &d->shown},
                               {eq->articulated.accelerations, n, &d->accelerations},
                               {eq->articulated.multipliers, m, &d->multipliers},
                               {eq->articulated.pivots, eq->articulated.pivots ? m : 0, &d->pivots},
                               {eq->articulated.diagonals, eq->articulated.diagonals ? m : 0, &d->diagonals},
                               {eq->articulated.correction, n, &d->correction},
                               {eq->dynamics.inverse, n, &d->inverse},
                               {eq->dynamics.closed, n, &d->closed},
                               {eq->dynamics.inverse_q, eq->dynamics.inverse_q ? n * n : 0, &d->inverse_q},
                               {eq->dynamics.inverse_qd, eq->dynamics.inverse_qd ? n * n : 0, &d->inverse_qd},
                               {eq->dynamics.closed_q, eq->dynamics.closed_q ? n * n : 0, &d->closed_q},
                               {eq->energy.power_q, eq->energy.power_q ? n : 0, &d->power_q},
                               {eq->energy.power_qd, eq->energy.power_qd ? n : 0, &d->power_qd}};
    memcpy(set, all, sizeof all);
    return (int)(sizeof all / sizeof *all);
}

/* All of d->eq as one program on its machine. */
static inline void derived_finish(derived *d)
{
    derived_set set[DERIVED_SETS] = {{0}};
    const kempe_model *model = d->eq.model;
    d->n = d->eq.n;
    d->m = d->eq.m;
    int total = 0, sets_count = derived_list(d, set);
    for (int k = 0; k < sets_count; k++)
        total += set[k].count;
    kmp_ref *every = KMP_NEW(kmp_ref, total);
    for (int k = 0, i = 0; k < sets_count; i += set[k].count, k++)
        if (set[k].count)
            memcpy(every + i, set[k].of, (size_t)set[k].count * sizeof *every);
    const kmp_ref *group = every;
    d->program = kmp_program_new(d->eq.graph, 1, &total, &group);
    d->machine = kmp_machine_new(d->program, kmp_backend_find("tape"));
    kmp_free(every);
    for (int k = 0; k < kmp_model_parameter_count(model) && k < 8; k++)
        d->parameters[k] = kmp_model_parameter(model, k)->number.value;
}

/* false: the model has a closure that can never be met. */
static inline bool derived_init(derived *d, const kempe_model *model, unsigned sets, kmp_scheme scheme, bool keep)
{
    *d = (derived){0};
    if (kmp_equations_init(&d->eq, model, sets, scheme, keep) != KEMPE_OK)
        return false;
    derived_finish(d);
    return true;
}

/* Accelerations with the multipliers of the closures. */
static inline bool derived_init_closed(derived *d, const kempe_model *model)
{
    const kmp_derivation_request request = {.sets = KMP_SET_ACCELERATION | KMP_SET_CLOSURE | KMP_SET_JDQD,
                                            .closed = true};
    *d = (derived){0};
    if (kmp_equations_derive(&d->eq, model, &request) != KEMPE_OK)
        return false;
    derived_finish(d);
    return true;
}

static inline void derived_free(derived *d)
{
    kmp_machine_free(d->machine);
    kmp_program_free(d->program);
    kmp_equations_free(&d->eq);
}

static inline void derived_eval(derived *d, const state *s)
{
    derived_set set[DERIVED_SETS] = {{0}};
    kmp_machine_set(d->machine, KMP_IN_PARAMETER, d->parameters);
    kmp_machine_set(d->machine, KMP_IN_TIME, &s->t);
    kmp_machine_set(d->machine, KMP_IN_Q, s->q);
    kmp_machine_set(d->machine, KMP_IN_QD, s->qd);
    kmp_machine_set(d->machine, KMP_IN_QDD, s->qdd);
    kmp_machine_set(d->machine, KMP_IN_LAMBDA, s->lambda);
    kmp_machine_set(d->machine, KMP_IN_MU, s->mu);
    kmp_machine_set(d->machine, KMP_IN_KEPT, s->kept);
    (void)kmp_machine_run(d->machine, 0);
    const double *out = kmp_machine_run(d->machine, 1);
    int count = derived_list(d, set);
    for (int k = 0; k < count; out += set[k].count, k++)
        *set[k].to = out;
}

/* out = M x */
static inline void derived_mass_times(const derived *d, const double *x, double *out)
{
    for (int i = 0; i < d->n; i++)
        out[i] = 0;
    for (int i = 0; i < d->n; i++)
        for (int k = 0; k <= i; k++) {
            double mik = d->mass[i * d->n + k];
            out[i] += mik * x[k];
            if (k != i)
                out[k] += mik * x[i];
        }
}

/* out = J' x */
static inline void derived_transposed(const derived *d, const double *x, double *out)
{
    for (int k = 0; k < d->n; k++) {
        out[k] = 0;
        for (int r = 0; r < d->m; r++)
            out[k] += d->jacobian[r * d->n + k] * x[r];
    }
}

/* out = J x */
static inline void derived_jacobian_times(const derived *d, const double *x, double *out)
{
    for (int r = 0; r < d->m; r++) {
        out[r] = 0;
        for (int k = 0; k < d->n; k++)
            out[r] += d->jacobian[r * d->n + k] * x[k];
    }
}

#endif
