/* SPDX-License-Identifier: BSD-3-Clause */
/* Centring of joints with clearance, and rates that let them rest. Each length has a change of least size that keeps
 * the loops closed; combinations of these changes are found by pivoting of their small matrix, so that contradictory
 * lengths are left out one by one. */
#include "constraints/closing/loose_start.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "dynamics/goal_equations.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/lapack.h"
#include "model/data/force.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 60, PASSES = 3 };
#define LONGEST 0.3 /* largest scaled change of a coordinate in one step */

bool kmp_loosening_init(kmp_loosening *l, const kempe_system *s, kmp_closer *closer)
{
    int count = kmp_goals_centred_count(s->model), n = s->n;
    *l = (kmp_loosening){.s = s, .closer = closer, .count = count};
    if (count == 0)
        return true;
    l->machine = kmp_machine_new(s->goals, kmp_backend_find("tape"));
    if (!l->machine ||
        !KMP_ARENA_MAKE(&l->arena, KMP_ROOM(int, count, &l->force, &l->taken),
                        KMP_ROOM(double, count, &l->length, &l->size, &l->right, &l->mu),
                        KMP_ROOM(double, count *n, &l->slope, &l->change), KMP_ROOM(double, count *count, &l->matrix),
                        KMP_ROOM(double, n, &l->trial), KMP_ROOM(double, s->m, &l->room)))
        return false;
    for (int k = 0, at = 0; k < kmp_model_force_count(s->model); k++)
        for (int i = 0; i < kmp_goals_centred_of(kmp_model_force(s->model, k)); i++)
            l->force[at++] = k;
    kmp_machine_set(l->machine, KMP_IN_PARAMETER, s->parameters);
    (void)kmp_machine_run(l->machine, 0);
    return true;
}

void kmp_loosening_free(kmp_loosening *l)
{
    kmp_machine_free(l->machine);
    kmp_arena_free(&l->arena);
}

/* -- lengths and their rows ------------------------------------------------------------------------------ */

/* Lengths at q. */
static void measure_lengths(kmp_loosening *l, const double *q)
{
    const int places = kmp_goals_place_count(l->s->model), n = l->s->n;
    kmp_machine_set(l->machine, KMP_IN_CHART, l->closer->eval->chart);
    kmp_machine_set(l->machine, KMP_IN_Q, q);
    const double *values = kmp_machine_run(l->machine, KMP_STAGE_PLACE) + (size_t)places * (size_t)(1 + n);
    memcpy(l->length, values, (size_t)l->count * sizeof *values);
    memcpy(l->slope, values + l->count, (size_t)l->count * (size_t)n * sizeof *values);
}

/* Changes x so that J x = 0, by least changes. */
static void project(kmp_loosening *l, double *x)
{
    const kmp_closer *c = l->closer;
    const kmp_pattern *jac = &l->s->jacobian;
    for (int pass = 0; pass < PASSES && l->s->m > 0; pass++) {
        memset(l->room, 0, (size_t)l->s->m * sizeof *l->room);
        for (int e = 0; e < jac->count; e++)
            l->room[jac->row[e]] += c->eval->jacobian[e] * x[jac->col[e]];
        if (!c->correct(c->self, l->room, c->dx))
            return;
        for (int k = 0; k < l->s->n; k++)
            x[k] += c->dx[k];
    }
}

/* The changes that move one length each. False: least changes fail here. */
static bool find_changes(kmp_loosening *l, const bool *fixed, const double *q)
{
    const int n = l->s->n;
    if (l->s->m > 0 && l->closer->place(l->closer->self, 0, q) != 0)
        return false;
    measure_lengths(l, q);
    /* The rows of G over their scaled sizes. */
    for (int i = 0; i < l->count; i++) {
        double *row = l->slope + i * n, sum = 0;
        for (int k = 0; k < n; k++)
            sum += row[k] * l->s->scale[k] * row[k] * l->s->scale[k];
        l->size[i] = sum > 0 ? sqrt(sum) : 1;
        for (int k = 0; k < n; k++)
            row[k] /= l->size[i];
    }
    for (int i = 0; i < l->count; i++) {
        double *z = l->change + i * n;
        for (int k = 0; k < n; k++)
            z[k] = fixed[k] ? 0 : l->slope[i * n + k] * l->s->scale[k] * l->s->scale[k];
        project(l, z);
    }
    return true;
}

/* Adds to x the least change by which the lengths `taken` (count) change by -right. Returns the rank, -1: no memory. */
static int add_change(kmp_loosening *l, int count, double *x)
{
    const int n = l->s->n;
    for (int j = 0; j < count; j++)
        for (int i = 0; i < count; i++)
            l->matrix[i + j * count] = kmp_dot(n, l->slope + l->taken[i] * n, l->change + l->taken[j] * n);
    int rank = kmp_least_squares(count, count, l->matrix, l->right, KMP_LOOSE_RANK, l->mu);
    l->arena.failed = l->arena.failed || rank < 0;
    for (int j = 0; rank > 0 && j < count; j++)
        for (int k = 0; k < n; k++)
            x[k] -= l->mu[j] * l->change[l->taken[j] * n + k];
    return rank;
}

/* -- positions --------------------------------------------------------------------------------------------- */

/* True if a contact is farther from its centre than it could be. */
static bool is_outside(const kmp_loosening *l)
{
    bool any = false;
    for (int i = 0; i < l->count; i++) {
        const bool compliant = kmp_model_force(l->s->model, l->force[i])->kind == KMP_FORCE_COMPLIANT;
        double sum = 0;
        for (int k = 0; k < l->count; k++)
            sum += l->force[k] == l->force[i] ? l->length[k] * l->length[k] : 0;
        any = any || sqrt(sum) > (compliant ? KMP_LOOSE_DEEP : 1 + KMP_LOOSE_CENTRED);
    }
    return any;
}

/* Takes a Newton step towards closed loops and centred bearings, h = 0 and l = 0. Returns its scaled length; NaN: there
 * is no step. */
static double step(kmp_loosening *l, const bool *hold, double *q)
{
    const int n = l->s->n;
    double *dx = l->trial;
    if (!find_changes(l, hold, q))
        return NAN;
    memset(dx, 0, (size_t)n * sizeof *dx);
    if (l->s->m > 0 && l->closer->correct(l->closer->self, l->closer->eval->h, l->closer->dx))
        memcpy(dx, l->closer->dx, (size_t)n * sizeof *dx);
    for (int i = 0; i < l->count; i++) {
        l->taken[i] = i;
        l->right[i] = l->length[i] / l->size[i] + kmp_dot(n, l->slope + i * n, dx);
    }
    if (add_change(l, l->count, dx) < 0)
        return NAN;
    double size = kmp_eval_size(l->closer->eval, dx), part = size > LONGEST ? LONGEST / size : 1;
    for (int k = 0; k < n; k++)
        q[k] += part * dx[k];
    return size;
}

bool kmp_loosening_center(kmp_loosening *l, const bool *hold, double *q)
{
    const size_t bytes = (size_t)l->s->n * sizeof *q;
    if (l->count == 0)
        return false;
    measure_lengths(l, q);
    double *before = is_outside(l) ? KMP_ARENA_NEW(&l->arena, double, l->s->n) : NULL;
    if (!before)
        return false;
    memcpy(before, q, bytes);
    double size = INFINITY;
    for (int k = 0; k < MOST_STEPS && size > KMP_CLOSED_STALLED; k++)
        size = step(l, hold, q);
    double most = 0;
    measure_lengths(l, q);
    for (int i = 0; i < l->count; i++)
        most = fmax(most, fabs(l->length[i]));
    if (l->s->m > 0)
        kmp_eval_closure(l->closer->eval, 0, q);
    bool closed = l->s->m == 0 || kmp_eval_residual(l->closer->eval) <= KMP_CLOSED_ENOUGH;
    bool centred = !isnan(size) && most <= KMP_LOOSE_CENTRED && closed;
    if (!centred)
        memcpy(q, before, bytes);
    if (l->s->m > 0)
        kmp_eval_closure(l->closer->eval, 0, q);
    return centred;
}

/* -- rates ------------------------------------------------------------------------------------------------- */

/* The largest rate of the first `count` lengths of `taken`, scaled, over the fastest rate. */
static double left_over(const kmp_loosening *l, int count, double size, const double *qd)
{
    double most = 0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(kmp_dot(l->s->n, l->slope + l->taken[i] * l->s->n, qd)));
    size = fmax(size, kmp_eval_size(l->closer->eval, qd));
    return size > 0 ? most / size : 0;
}

/* Lets the lengths of `taken` rest, from qd into l->trial; true if they do. */
static bool try_rest(kmp_loosening *l, int count, double size, const double *qd, int *rank)
{
    const int n = l->s->n;
    for (int i = 0; i < count; i++)
        l->right[i] = kmp_dot(n, l->slope + l->taken[i] * n, qd);
    memcpy(l->trial, qd, (size_t)n * sizeof *qd);
    *rank = add_change(l, count, l->trial);
    return *rank >= 0 && left_over(l, count, size, l->trial) <= KMP_CLOSED_RATES;
}

bool kmp_loosening_rest(kmp_loosening *l, const bool *fixed, const double *q, double *qd, kmp_loose_start *start)
{
    int taken = 0, rank = 0, largest = 0, own = 0;
    const double size = kmp_eval_size(l->closer->eval, qd);
    if (l->count == 0 || !find_changes(l, fixed, q))
        return false;
    for (int first = 0; first < l->count; first += own) {
        for (own = 0; first + own < l->count && l->force[first + own] == l->force[first]; own++)
            l->taken[taken + own] = first + own;
        bool rests = try_rest(l, taken + own, size, qd, &rank);
        start[l->force[first]] = rests ? KMP_LOOSE_REST : KMP_LOOSE_OWN;
        taken += rests ? own : 0;
        largest = rests && rank > largest ? rank : largest;
    }
    if (largest == 0 || left_over(l, taken, size, qd) <= KMP_CLOSED_RATES)
        return largest > 0 && size > 0;
    (void)try_rest(l, taken, size, qd, &rank);
    memcpy(qd, l->trial, (size_t)l->s->n * sizeof *qd);
    return true;
}
