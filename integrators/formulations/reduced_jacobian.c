/* SPDX-License-Identifier: BSD-3-Clause */
/* Columns of the reduced Jacobian, one for each unknown: spread to q and qd by the tangent, through the exact
 * derivatives of the residual, and back by X'. Columns are independent of each other, and are shared among threads in
 * pieces. */
#include "integrators/formulations/reduced_jacobian.h"
#include "base/memory.h"
#include <string.h>

/* -- the Jacobian ------------------------------------------------------------------------------------ */

/* Operations below which columns stay on one thread: they take some 20 us. */
enum { WORTH_SHARING = 50000 };

/* Columns in pieces for a thread pool, some for each thread, as far as they are worth it; otherwise in one. */
static void choose_pieces(kmp_reduced_jacobian *jacobian)
{
    const kmp_reduction *red = jacobian->red;
    const kmp_team *team = kmp_eval_team(red->eval);
    long columns = 2L * red->p;
    long solution = red->zeros ? 2 * red->zeros->l_entries : (long)red->p * red->p;
    bool shared = team && red->eval->system->load_row_count == 0 && columns * (8L * red->n + solution) >= WORTH_SHARING;
    long most = (columns + KMP_FOUR - 1) / KMP_FOUR, pieces = shared ? 2L * kmp_team_threads(team) : 1;
    pieces = pieces < most ? pieces : most;
    jacobian->columns = (int)(pieces > 0 ? (most + pieces - 1) / pieces * KMP_FOUR : 0);
    jacobian->pieces = (int)(pieces > 0 ? (columns + jacobian->columns - 1) / jacobian->columns : 0);
    jacobian->room_of_piece = 2 * ((size_t)red->p + (size_t)red->n) +
                              KMP_FOLLOW_ROOM((size_t)red->n, (size_t)red->part->m) +
                              KMP_FOUR * ((size_t)red->p + KMP_FOUR);
}

kempe_status kmp_reduced_jacobian_init(kmp_reduced_jacobian *jacobian, kmp_reduction *red)
{
    *jacobian = (kmp_reduced_jacobian){.red = red};
    choose_pieces(jacobian);
    if (!KMP_ARENA_MAKE(&jacobian->arena, KMP_ROOM(double, red->n, &jacobian->qdd),
                        KMP_ROOM(double, red->part->m, &jacobian->lambda),
                        KMP_ROOM(double, (size_t)jacobian->pieces * jacobian->room_of_piece, &jacobian->room)))
        return kmp_fail_memory(red->eval->system->context);
    const kempe_system *system = red->eval->system;
    return kmp_tangents_init(&jacobian->tangents, system, red->eval->backend, kmp_tangents_of_runs(system));
}

KMP_CLEARS(kmp_reduced_jacobian, jacobian, kmp_tangents_free(&jacobian->tangents), kmp_arena_free(&jacobian->arena))

/* Derivatives at (t, q, qd, udd), with the multipliers of the evaluator's state. */
static const double *differentiate(kmp_reduced_jacobian *jacobian, bool moving, double t, const double *q,
                                   const double *qd, const double *udd)
{
    kmp_reduction *red = jacobian->red;
    kmp_reduction_accelerations(red, udd, jacobian->qdd);
    kmp_reduction_multipliers(red, jacobian->qdd, jacobian->lambda);
    kmp_instant at = kmp_instant_of(red->eval, t, q, qd, jacobian->qdd, jacobian->lambda);
    (void)kmp_reduction_load_factor(red, moving);
    return kmp_tangents_derivatives(&jacobian->tangents, &at);
}

/* All columns of a Jacobian, at the derivatives d. */
typedef struct columns {
    kmp_reduced_jacobian *jacobian;
    const double *d;
    bool moving; /* solved for accelerations; otherwise of the residual, with cj times the accelerations */
    double cj;
    int size;
    double *j;
} columns;

/* Follows column c, of u and then of ud: sets dR, returns the change of the power. */
static double follow_column(const columns *all, int c, double *room, double *residual)
{
    kmp_reduction *red = all->jacobian->red;
    const kmp_tangents *t = &all->jacobian->tangents;
    int p = red->p, n = red->n;
    double *unit = room, *udd = unit + p, *dq = udd + p, *dqd = dq + n, power = 0;
    memset(unit, 0, (size_t)(2 * p) * sizeof *unit);
    unit[c % p] = 1;
    udd[c % p] = c < p ? 0 : all->cj;
    const kmp_change change = {.u = c < p ? unit : NULL, .ud = c < p ? NULL : unit, .udd = udd};
    const kmp_response response = {.q = dq, .qd = dqd, .residual = residual};
    kmp_follow(red, t, all->d, all->moving, &change, &response, dqd + n);
    kmp_tangents_add(t, KMP_POWER_Q, all->d, 1, dq, &power);
    kmp_tangents_add(t, KMP_POWER_QD, all->d, 1, dqd, &power);
    return power;
}

/* Columns of one piece. */
static void follow_piece(void *self, int piece)
{
    const columns *all = self;
    const kmp_reduced_jacobian *jacobian = all->jacobian;
    int p = jacobian->red->p, size = all->size, first = piece * jacobian->columns, last = first + jacobian->columns;
    double *room = jacobian->room + (size_t)piece * jacobian->room_of_piece, sign = all->moving ? 1 : -1;
    last = last < 2 * p ? last : 2 * p;
    for (int c = first; c < last; c++) {
        double *column = all->j + (ptrdiff_t)c * size, power = follow_column(all, c, room, column + p);
        for (int k = 0; all->moving && k < p; k++)
            column[p + k] = -column[p + k];
        if (size > 2 * p)
            column[2 * p] = sign * power;
    }
    if (all->moving)
        kmp_reduction_solve_masses(jacobian->red, last - first, all->j + (ptrdiff_t)first * size + p, size, room);
}

static void follow_all(columns *all)
{
    const kmp_reduced_jacobian *jacobian = all->jacobian;
    if (jacobian->pieces > 1)
        kmp_team_run(kmp_eval_team(jacobian->red->eval), jacobian->pieces, follow_piece, all);
    else if (jacobian->pieces == 1)
        follow_piece(all, 0);
}

void kmp_reduced_jacobian_eval(kmp_reduced_jacobian *jacobian, double t, const double *q, const double *qd,
                               const double *udd, int size, double *j)
{
    int p = jacobian->red->p;
    columns all = {jacobian, differentiate(jacobian, true, t, q, qd, udd), true, 0, size, j};
    follow_all(&all);
    for (int c = p; c < 2 * p; c++)
        j[c - p + (ptrdiff_t)c * size] = 1;
}

/* d(M qdd + C - J' lambda) = 0 as a separate system: X' eliminates J' times the change of X. */
void kmp_reduced_jacobian_of_residual(kmp_reduced_jacobian *jacobian, double t, double cj, const double *q,
                                      const double *qd, const double *udd, int size, double *j)
{
    int p = jacobian->red->p;
    columns all = {jacobian, differentiate(jacobian, false, t, q, qd, udd), false, cj, size, j};
    follow_all(&all);
    for (int c = 0; c < 2 * p; c++)
        j[c % p + (ptrdiff_t)c * size] = c < p ? cj : -1;
    if (size > 2 * p)
        j[2 * p + 2 * p * size] = cj;
}
