/* SPDX-License-Identifier: BSD-3-Clause */
/* The logarithm of the determinant of the dependent columns Jv of the closures, along closed motions. With changes a
 * and b of all coordinates, W = Jv'^-1 and the weights mu of h with Jv' mu = -(W . Jv)_v,
 *
 *     d log|det Jv| / da = W . Jv_a        d2 / da db = a' (W . Jv + mu . h)_qq b - tr(Jv^-1 Jv_a Jv^-1 Jv_b)
 *
 * where W is constant in the derivatives. */
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluation_point.h"
#include "constraints/workspace/state_workspace.h"
#include "dynamics/choose_variants.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/factors.h"
#include "symbolic/derivative.h"
#include <kempe/derivatives.h>
#include <math.h>
#include <string.h>

/* Stages of the program: the gradient of W . J + mu . h by q, its change along a direction, the change of J. */
enum { GRADIENT = 1, CHANGE, COLUMNS, STAGES = COLUMNS };

typedef struct determinant {
    kmp_formulas formulas;
    kmp_arena arena;
    int n, m, p, r, entries;
    int *row, *column; /* of each entry of J, in the last stage: positions in the rows and in v; -1: in neither */
    int *pivot;        /* r */
    double *lu, *inverse, *ju; /* r x r: of Jv; r x p */
    double *along;             /* p x n: changes of q, one after the other */
    double *product;           /* p x r x r: Jv^-1 Jv_a */
    double *given;             /* of the program: a direction (n), mu (m), W (m x n, row by row) */
    double *gradient, *zero;   /* n, n + m */
} determinant;

/* -- preparation ------------------------------------------------------------------------------------- */

static void free_determinant(void *self)
{
    determinant *d = self;
    kmp_formulas_free(&d->formulas);
    kmp_arena_free(&d->arena);
    kmp_free(d);
}

static int place_in(int count, const int *list, int value)
{
    for (int k = 0; k < count; k++)
        if (list[k] == value)
            return k;
    return -1;
}

/* The weighted sum of the entries of J and of h. */
static kmp_ref weighted(const kmp_equations *eq)
{
    const int n = eq->n, m = eq->m;
    kmp_ref sum = KMP_ZERO;
    for (int k = 0; k < m + m * n; k++) {
        const kmp_ref weight = kmp_input(eq->graph, KMP_IN_ALONG, (uint32_t)(n + k));
        sum = kmp_add(eq->graph, sum,
                      kmp_mul(eq->graph, weight, k < m ? eq->closures.h[k] : eq->closures.jacobian[k - m]));
    }
    return sum;
}

/* False: no memory. */
static bool derive_program(kempe_workspace *ws, determinant *d, const kmp_equations *eq)
{
    const int n = d->n, m = d->m;
    kmp_arena arena = {0};
    kmp_ref *leaf, *direction, *gradient, *change, *column;
    bool ok = KMP_ARENA_MAKE(&arena, KMP_ROOM(kmp_ref, n, &leaf, &direction, &gradient, &change),
                             KMP_ROOM(kmp_ref, m * n, &column));
    for (int i = 0; ok && i < n; i++) {
        leaf[i] = kmp_input(eq->graph, KMP_IN_Q, (uint32_t)i);
        direction[i] = kmp_input(eq->graph, KMP_IN_ALONG, (uint32_t)i);
    }
    if (ok)
        kmp_gradient_backward(eq->graph, weighted(eq), n, leaf, gradient);
    kmp_derivative *along = ok ? kmp_derivative_new(eq->graph, n, leaf, direction) : NULL;
    for (int i = 0; along && i < n; i++)
        change[i] = kmp_derivative_of(along, gradient[i]);
    for (int k = 0; along && k < m * n; k++) {
        const kmp_ref moved = kmp_derivative_of(along, eq->closures.jacobian[k]);
        if (moved == KMP_ZERO)
            continue;
        d->row[d->entries] = place_in(d->r, ws->part.rows, k / n);
        d->column[d->entries] = place_in(d->r, ws->part.v, k % n);
        column[d->entries++] = moved;
    }
    kmp_derivative_free(along);
    ok = along && !kmp_graph_failed(eq->graph);
    if (ok)
        d->formulas.program = kmp_program_new(eq->graph, STAGES, (const int[]){n, n, d->entries},
                                              (const kmp_ref *const[]){gradient, change, column});
    ok = ok && kmp_formulas_prepare(&d->formulas, ws->eval->backend, ws->system->parameters);
    kmp_arena_free(&arena);
    return ok;
}

static kempe_status prepare(kempe_workspace *ws, determinant *d)
{
    const kempe_system *s = ws->system;
    const int n = d->n, m = d->m, p = d->p, r = d->r;
    kmp_equations eq;
    kmp_events events = s->events; /* the system has met all its conditions: none is added */
    const kmp_derivation_request closures = {
        .sets = KMP_SET_CLOSURE, .scheme = KMP_SCHEME_COMPOSITE, .events = &events, .charted = true};
    KMP_TRY(kmp_made(s->context,
                     KMP_ARENA_MAKE(&d->arena, KMP_ROOM(int, m *n, &d->row, &d->column), KMP_ROOM(int, r, &d->pivot),
                                    KMP_ROOM(double, r *r, &d->lu, &d->inverse), KMP_ROOM(double, r *p, &d->ju),
                                    KMP_ROOM(double, p *n, &d->along), KMP_ROOM(double, p *r *r, &d->product),
                                    KMP_ROOM(double, n + m + m * n, &d->given), KMP_ROOM(double, n, &d->gradient),
                                    KMP_ROOM(double, n + m, &d->zero))));
    KMP_TRY(kmp_equations_derive(&eq, s->model, &closures));
    const bool ok = derive_program(ws, d, &eq);
    kmp_equations_free(&eq);
    return kmp_made(s->context, ok);
}

kempe_status kempe_workspace_add_determinant(kempe_workspace *ws)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (ws->determinant.self)
        return KEMPE_OK;
    ws->message[0] = '\0';
    kmp_context_clear(ws->system->context);
    if (!ws->chosen)
        return KMP_WORKSPACE_REFUSE(ws, "the determinant of the loops does not exist, because the start cannot be "
                                        "assembled");
    KMP_MAKE(ws->system->context, determinant, d);
    *d = (determinant){.n = ws->n, .m = ws->m, .p = ws->part.p, .r = ws->part.r};
    const kempe_status status = prepare(ws, d);
    if (status == KEMPE_OK) {
        ws->determinant = (kmp_workspace_part){d, free_determinant};
        return KEMPE_OK;
    }
    free_determinant(d);
    (void)kmp_workspace_fail(ws, "%s", kempe_context_message(ws->system->context));
    return status;
}

/* -- a state ----------------------------------------------------------------------------------------- */

/* Jv^-1, and the logarithm of |det Jv|. False: it is singular. */
static bool invert(const kempe_workspace *ws, determinant *d, double *logarithm)
{
    const int r = d->r;
    double sum = 0;
    for (int j = 0; j < r; j++)
        for (int i = 0; i < r; i++)
            d->lu[i + j * r] = ws->jacobian[ws->part.rows[i] + (ptrdiff_t)ws->part.v[j] * d->m];
    if (kmp_lu_factor(r, d->lu, d->pivot))
        return false;
    memset(d->inverse, 0, (size_t)(r * r) * sizeof *d->inverse);
    for (int k = 0; k < r; k++) {
        sum += log(fabs(d->lu[k + k * r]));
        d->inverse[k + k * r] = 1;
    }
    kmp_lu_solve(r, d->lu, d->pivot, r, d->inverse);
    *logarithm = sum;
    return true;
}

/* Changes of all coordinates along each of the independent ones: v changes by -Jv^-1 Ju. */
static void spread(const kempe_workspace *ws, determinant *d)
{
    for (int k = 0; k < d->p; k++) {
        double *a = d->along + (ptrdiff_t)k * d->n, *v = d->ju + (ptrdiff_t)k * d->r;
        for (int i = 0; i < d->r; i++)
            v[i] = -ws->jacobian[ws->part.rows[i] + (ptrdiff_t)ws->part.u[k] * d->m];
        kmp_lu_solve(d->r, d->lu, d->pivot, 1, v);
        memset(a, 0, (size_t)d->n * sizeof *a);
        a[ws->part.u[k]] = 1;
        for (int i = 0; i < d->r; i++)
            a[ws->part.v[i]] = v[i];
    }
}

static const double *run(determinant *d, int stage)
{
    kmp_machine_set(d->formulas.machine, KMP_IN_ALONG, d->given);
    return kmp_machine_run(d->formulas.machine, stage);
}

/* Jv^-1 Jv_a of a direction. */
static void multiply(determinant *d, const double *change, double *product)
{
    const int r = d->r;
    memset(product, 0, (size_t)(r * r) * sizeof *product);
    for (int e = 0; e < d->entries; e++)
        for (int i = 0; d->row[e] >= 0 && d->column[e] >= 0 && i < r; i++)
            product[i + d->column[e] * r] += d->inverse[i + d->row[e] * r] * change[e];
}

static void bend(kempe_workspace *ws, determinant *d, double *by_uu)
{
    const int n = d->n, p = d->p, r = d->r;
    double *mu = d->given + n;
    /* The dependent coordinates bend with h: Jv' mu = -(W . Jv)_v. */
    for (int k = 0; k < r; k++) {
        double sum = 0;
        for (int i = 0; i < r; i++)
            sum -= d->inverse[i + k * r] * d->gradient[ws->part.v[i]];
        mu[ws->part.rows[k]] = sum;
    }
    (void)run(d, GRADIENT);
    for (int a = 0; a < p; a++) {
        memcpy(d->given, d->along + (ptrdiff_t)a * n, (size_t)n * sizeof *d->given);
        const double *change = run(d, CHANGE);
        multiply(d, run(d, COLUMNS), d->product + (ptrdiff_t)a * r * r);
        for (int b = 0; b <= a; b++) {
            const double *x = d->product + (ptrdiff_t)a * r * r, *y = d->product + (ptrdiff_t)b * r * r;
            double sum = kmp_dot(n, change, d->along + (ptrdiff_t)b * n);
            for (int i = 0; i < r; i++)
                for (int k = 0; k < r; k++)
                    sum -= x[i + k * r] * y[k + i * r];
            by_uu[a + b * p] = by_uu[b + a * p] = sum;
        }
    }
    memset(mu, 0, (size_t)d->m * sizeof *mu);
}

/* Each result may be NULL. */
static kempe_status determinant_at(kempe_workspace *ws, determinant *d, double t, const double *q, double *logarithm,
                                   double *by_u, double *by_uu)
{
    const int n = d->n, m = d->m, r = d->r;
    double value = 0;
    KMP_TRY(kmp_workspace_check_time(ws, t));
    KMP_TRY(kempe_workspace_evaluate(ws, t, q, NULL));
    KMP_TRY(kmp_workspace_require_closed_position(ws, "determinants of the loops", t));
    if (!invert(ws, d, &value))
        return kmp_workspace_fail(ws, "the loops are in a singular position at t = %.9g s", t);
    if (logarithm)
        *logarithm = value;
    if (!by_u && !by_uu)
        return KEMPE_OK;
    spread(ws, d);
    double *weight = d->given + n + m;
    for (int i = 0; i < r; i++)
        for (int k = 0; k < r; k++)
            weight[ws->part.v[k] + ws->part.rows[i] * n] = d->inverse[k + i * r];
    const kmp_instant at = kmp_instant_of(ws->eval, t, ws->q, d->zero, d->zero, d->zero);
    kmp_formulas_place(&d->formulas, &at);
    memcpy(d->gradient, run(d, GRADIENT), (size_t)n * sizeof *d->gradient);
    for (int k = 0; by_u && k < d->p; k++)
        by_u[k] = kmp_dot(n, d->gradient, d->along + (ptrdiff_t)k * n);
    if (by_uu)
        bend(ws, d, by_uu);
    return KEMPE_OK;
}

/* Arguments of a call for many states. */
typedef struct determinant_rows {
    const double *t, *q;
    int step; /* of t */
    double *logarithm, *by_u, *by_uu;
} determinant_rows;

static kempe_status visit_state(kempe_workspace *ws, const void *self, int k, int count, int *done)
{
    const determinant_rows *in = self;
    determinant *d = ws->determinant.self;
    (void)count, (void)done;
    return determinant_at(ws, d, in->t[in->step ? k : 0], kmp_row_at(in->q, d->n, k), kmp_row_at(in->logarithm, 1, k),
                          kmp_row_at(in->by_u, d->p, k), kmp_row_at(in->by_uu, d->p * d->p, k));
}

kempe_status kempe_workspace_determinant_states(kempe_workspace *ws, int count, const double *t, int t_step,
                                                const double *q, double *logarithm, double *by_u, double *by_uu,
                                                int *failed)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "t", t) || !kmp_workspace_given(ws, "q", q))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_check_count(ws, count));
    if (!ws->determinant.self)
        return KMP_WORKSPACE_REFUSE(ws, "determinants are not prepared: call kempe_workspace_add_determinant first");
    return kmp_workspace_visit(ws, count, visit_state, &(determinant_rows){t, q, t_step, logarithm, by_u, by_uu},
                               failed);
}
