/* SPDX-License-Identifier: BSD-3-Clause */
/* The factors of the last slope of the balance give both derivatives. */
#include "analyses/kinematics/deflections.h"
#include "analyses/parts/unsupported.h"
#include "base/memory.h"
#include "linalg/dense/factors.h"
#include <math.h>
#include <string.h>

kempe_status kmp_deflections_init(kmp_deflections *x, const kempe_system *s, const kmp_deformation_choice *choice)
{
    *x = (kmp_deflections){.settling.pivots = NULL};
    KMP_TRY(kmp_refuse_load_dependent(s, "kinematics with 'elastic static'"));
    KMP_TRY(kmp_refuse_friction(s->model, "kinematics with 'elastic static'"));
    KMP_TRY(kmp_settling_init(&x->settling, s, choice));
    KMP_TRY(kmp_second_derivatives_init(&x->second, s, x->settling.rows.eval->backend, 0, NULL));
    const int p = x->settling.rows.part.p;
    return kmp_made(s->context, KMP_ARENA_MAKE(&x->arena, KMP_ROOM(double, p, &x->u, &x->rows),
                                               KMP_ROOM(double, s->m, &x->ls, &x->curve),
                                               KMP_ROOM(double, s->n, &x->force, &x->still)));
}

KMP_CLEARS(kmp_deflections, x, kmp_second_derivatives_free(&x->second), kmp_settling_free(&x->settling),
           kmp_arena_free(&x->arena))

/* The derivative of the deformations that leaves their rows zero, from x->force, into x->u. */
static void answer(kmp_deflections *x)
{
    kmp_deformation_rows *r = &x->settling.rows;
    kmp_reduction_project(&r->red, x->force, x->rows);
    for (int i = 0; i < r->count; i++)
        x->settling.step[i] = x->rows[r->in_u[i]];
    kmp_lu_solve(r->count, r->slope, x->settling.pivots, 1, x->settling.step);
    for (int i = 0; i < r->count; i++)
        x->u[r->in_u[i]] = x->settling.step[i];
}

/* force = R_q q. */
static void load_by(kmp_deflections *x, const double *q)
{
    const kmp_deformation_rows *r = &x->settling.rows;
    memset(x->force, 0, (size_t)r->s->n * sizeof *x->force);
    kmp_tangents_add(&r->tangents, KMP_R_Q, r->d, 1, q, x->force);
}

/* q += X u. */
static void add_motion(const kmp_deflections *x, const double *u, double *q)
{
    const kmp_reduction *red = &x->settling.rows.red;
    for (int k = 0; k < red->p; k++)
        for (int i = 0; i < red->n; i++)
            q[i] += red->x[i + (ptrdiff_t)k * red->n] * u[k];
}

/* The change of J q' + h_t pace along the sweep at constant q'. */
static void find_curve(kmp_deflections *x, double pace, const double *qs)
{
    kmp_deformation_rows *r = &x->settling.rows;
    const int n = r->s->n, m = r->s->m;
    memset(x->curve, 0, (size_t)m * sizeof *x->curve);
    for (int side = pace != 0 ? 1 : -1; side <= 1; side++) { /* of constant time only the part of second order */
        for (int i = 0; i < n; i++)
            x->still[i] = pace != 0 ? qs[i] / pace : side * qs[i];
        kmp_eval_bias(r->eval, x->still);
        for (int k = 0; k < m; k++)
            x->curve[k] += r->eval->jdqd[k] * (pace != 0 ? pace * pace : side == 0 ? -1 : 0.5);
    }
}

bool kmp_deflections_at(kmp_deflections *x, double t, double pace, double *q, double *qs, double *qss)
{
    kmp_deformation_rows *r = &x->settling.rows;
    const int n = r->s->n, p = r->part.p;
    const size_t size = (size_t)n * sizeof *q;
    r->t = t;
    memcpy(r->q, q, size);
    if (!kmp_settle(&x->settling))
        return false;
    memcpy(q, r->q, size);
    x->unstable = x->unstable || !kmp_settling_is_stable(&x->settling);
    if (kmp_lu_factor(r->count, r->slope, x->settling.pivots) != 0)
        return false;
    for (int k = 0; k < p; k++)
        x->u[k] = qs[r->part.u[k]];
    for (int i = 0; i < r->count; i++)
        x->u[r->in_u[i]] = 0;
    for (int i = 0; i < n; i++)
        qs[i] = pace * r->red.x_t[i];
    add_motion(x, x->u, qs);
    load_by(x, qs);
    answer(x);
    for (int i = 0; i < n; i++)
        qs[i] = pace * r->red.x_t[i];
    add_motion(x, x->u, qs);
    load_by(x, qs);
    kmp_reduction_pull(&r->red, x->force, x->ls);
    /* Second derivatives. */
    const kmp_instant at = kmp_instant_of(r->eval, t, q, r->qd, r->qdd, r->lambda);
    kmp_formulas_place(&x->second.bent, &at);
    const kmp_variation along = {.q = qs, .lambda = x->ls};
    const double *bent = kmp_second_derivatives_along(&x->second, &along, &along, NULL).force;
    find_curve(x, pace, qs);
    memset(qss, 0, size);
    kmp_reduction_push_in(&r->red, -1, x->curve, r->red.room, qss);
    load_by(x, qss);
    for (int i = 0; i < n; i++)
        x->force[i] += bent[i];
    memset(x->u, 0, (size_t)p * sizeof *x->u);
    answer(x);
    add_motion(x, x->u, qss);
    return true;
}
