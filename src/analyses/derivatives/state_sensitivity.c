/* SPDX-License-Identifier: BSD-3-Clause */
/* R(u, p) = 0 differentiated is Kr du = -dR, with dR the change by a parameter at constant u. Kr is scaled by the sizes
 * of coordinates before its rank is decided. */
#include "analyses/derivatives/state_sensitivity.h"
#include "analyses/derivatives/switching_state.h"
#include "base/memory.h"
#include "model/data/body.h"
#include "model/data/state.h"
#include <float.h>
#include <math.h>

kempe_status kmp_state_sensitivity_init(kmp_state_sensitivity *sensitivity_of_state, const kempe_system *system,
                                        int count, const char *const *names)
{
    int n = system->n, m = system->m;
    kmp_state_sensitivity *s = sensitivity_of_state;
    *s = (kmp_state_sensitivity){.system = system, .n = n, .m = m, .count = count, .names = names};
    s->r = KMP_ARENA_NEW(&s->arena, int, n);
    s->c = KMP_ARENA_NEW(&s->arena, int, n);
    return KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, n *count, &s->q, &s->qd, &s->qdd, &s->residual),
                          KMP_ROOM(double, m *count, &s->lambda), KMP_ROOM(double, 3 * m + n, &s->part),
                          KMP_ROOM(double, n, &s->u, &s->ud, &s->pivots), KMP_ROOM(double, n *n, &s->matrix),
                          KMP_ROOM(double, 2 * n, &s->side))
               ? KEMPE_OK
               : kmp_fail_memory(system->context);
}

KMP_CLEARS(kmp_state_sensitivity, sensitivity_of_state, kmp_arena_free(&sensitivity_of_state->arena))

/* -- consequences of R = 0 ----------------------------------------------------------------------------- */

static double scale_of(const kmp_linear *l, int k)
{
    return l->system->scale[l->part.u[k]];
}

/* The largest value that counts as rounding: relative to the largest summand of Kr. */
static double rounding(const kmp_linear *l)
{
    double largest = 0;
    const kmp_tangents *t = &l->tangents;
    for (int e = t->start[KMP_R_Q]; e < t->start[KMP_R_Q + 1]; e++)
        largest = fmax(largest, fabs(l->d[t->entry[e].source]) * l->system->scale[t->entry[e].row] *
                                    l->system->scale[t->entry[e].col]);
    return 64 * l->n * DBL_EPSILON * largest;
}

static bool is_state(const kmp_linear *l, int k)
{
    return kmp_state_of(l->system->model, l->part.u[k]);
}

/* Factors the matrix (p x p) that u, or udd, follows by; its rank. At an equilibrium the value of a state, a rate,
 * follows in place of its integral. */
static int factor(kmp_state_sensitivity *s, const kmp_linear *l, bool equilibrium)
{
    int p = l->p, rank = 0;
    double zero = equilibrium ? rounding(l) : 0;
    for (int j = 0; j < p; j++) {
        const double *matrix = !equilibrium ? l->mass : is_state(l, j) ? l->damping : l->stiffness;
        for (int i = 0; i < p; i++)
            s->matrix[i + j * p] = matrix[i + j * p] * scale_of(l, i) * scale_of(l, j);
    }
    kmp_lu_complete(p, p, s->matrix, NULL, s->r, s->c, s->pivots);
    while (rank < p && s->pivots[rank] > fmax(zero, 64 * p * DBL_EPSILON * s->pivots[0]))
        rank++;
    return rank;
}

/* x of matrix x = -b, zero where the matrix leaves it open; b by u. false: the equations contradict each other. */
static bool solve(kmp_state_sensitivity *s, const kmp_linear *l, int rank, const double *b, double *x)
{
    int p = l->p;
    double *y = s->side, size = 0, rest = 0;
    for (int i = 0; i < s->n; i++)
        size = fmax(size, fabs(s->part[3 * s->m + i]) * s->system->scale[i]);
    for (int i = 0; i < p; i++) {
        y[i] = -b[s->r[i]] * scale_of(l, s->r[i]);
        size = fmax(size, fabs(y[i]));
    }
    for (int k = 0; k < rank; k++)
        for (int i = k + 1; i < p; i++)
            y[i] -= s->matrix[i + k * p] * y[k];
    for (int i = rank; i < p; i++)
        rest = fmax(rest, fabs(y[i]));
    for (int i = rank; i < p; i++)
        y[i] = 0;
    for (int k = rank - 1; k >= 0; k--) {
        y[k] /= s->matrix[k + k * p];
        for (int i = 0; i < k; i++)
            y[i] -= s->matrix[i + k * p] * y[k];
    }
    for (int k = 0; k < p; k++)
        x[s->c[k]] = y[k] * scale_of(l, s->c[k]);
    return rest <= sqrt(DBL_EPSILON) * size;
}

/* Takes the solution x (p) into the change: of u, of the rates of states, or of accelerations. */
static void take(kmp_state_sensitivity *s, const kmp_linear *l, bool equilibrium, const double *x, kmp_change *change)
{
    if (!equilibrium || kmp_model_state_count(l->system->model) == 0) {
        *(equilibrium ? &change->u : &change->udd) = x;
        return;
    }
    for (int k = 0; k < l->p; k++) {
        bool state = is_state(l, k);
        s->ud[k] = (change->ud ? change->ud[k] : 0) + (state ? x[k] : 0);
        s->u[k] = state ? 0 : x[k];
    }
    change->u = s->u;
    change->ud = s->ud;
}

/* -- one parameter ----------------------------------------------------------------------------------- */

static kmp_response column(const kmp_state_sensitivity *s, int k)
{
    return (kmp_response){s->q + k * s->n, s->qd + k * s->n, s->qdd + k * s->n, s->lambda + k * s->m,
                          s->residual + k * s->n};
}

/* Rows u of a column; NULL where there is none. */
static const double *gather(const kmp_linear *l, const double *column, double *out)
{
    for (int i = 0; column && i < l->p; i++)
        out[i] = column[l->part.u[i]];
    return column ? out : NULL;
}

kempe_status kmp_state_sensitivity_at(kmp_state_sensitivity *sensitivity_of_state, kmp_linear *linear,
                                      kmp_slopes *slopes, kmp_fixed_quantity fixed, const double *q, const double *qd)
{
    const bool equilibrium = fixed == KMP_KEEP_EQUILIBRIUM;
    kmp_linear_matrices(linear);
    kmp_linear_doubt_state(linear, true);
    KMP_TRY(kmp_linear_settle_switches(linear, !equilibrium, true));
    kmp_instant at = kmp_linear_instant(linear);
    kmp_slopes_at(slopes, &at);
    const int rank = sensitivity_of_state->rank = factor(sensitivity_of_state, linear, equilibrium);
    for (int k = 0; k < sensitivity_of_state->count; k++) {
        kmp_change change = kmp_slopes_change(slopes, k, sensitivity_of_state->part);
        kmp_response response = column(sensitivity_of_state, k);
        change.u = gather(linear, q ? q + k * sensitivity_of_state->n : NULL, sensitivity_of_state->u);
        change.ud = gather(linear, qd ? qd + k * sensitivity_of_state->n : NULL, sensitivity_of_state->ud);
        kmp_linear_follow(linear, &change, &response);
        double *x = sensitivity_of_state->side + sensitivity_of_state->n;
        if (!solve(sensitivity_of_state, linear, rank, response.residual, x)) {
            const double *pivots = sensitivity_of_state->pivots;
            return kmp_fail(
                linear->system->context, KEMPE_E_FAILED,
                "the equilibrium has no derivative with respect to '%s', which changes the force along "
                "'%s', a motion without restraint (%d independent coordinates, %d restrained, stiffness "
                "ratio %.3g): lock the coordinate",
                sensitivity_of_state->names[k],
                kmp_model_motion(linear->system->model, linear->part.u[sensitivity_of_state->c[rank]])->name, linear->p,
                rank, pivots[0] > 0 ? pivots[rank] / pivots[0] : 0.0);
        }
        take(sensitivity_of_state, linear, equilibrium, x, &change);
        kmp_linear_follow(linear, &change, &response);
    }
    return KEMPE_OK;
}
