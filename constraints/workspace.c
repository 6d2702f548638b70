/* SPDX-License-Identifier: BSD-3-Clause */
/* The public workspace: a plant, dense copies of its values, and one dense saddle system [D -J'; J 0] on the rows that
 * are independent at the state at hand (complete pivoting of the scaled J), with D = M for accelerations and D = the
 * geometric metric for closing. */
#include "base/memory.h"
#include "constraints/pressing.h"
#include "constraints/tolerances.h"
#include "linalg/dense.h"
#include <kempe/workspace.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MAX_ITERATIONS = 100 };

struct kempe_workspace {
    const kempe_system *system;
    kmp_plant *plant;
    int n, m, rank;
    double *q, *qd;       /* n: of the last evaluation */
    double *mass, *bias;  /* n x n, n */
    double *h, *jdqd;     /* m */
    double *jacobian;     /* m x n */
    double *scaled;       /* m x n */
    double *matrix, *rhs; /* of the saddle system: (n + m)^2, n + m */
    double *pivots;       /* min(m, n) */
    double *trial;        /* n: q while closing, then qd */
    int *row, *col, *pivot;
    double kinetic, potential;
    const double *given; /* efforts of forward dynamics; NULL: none */
    char message[400];
};

static kempe_status fail(kempe_workspace *ws, const char *sentence, double x)
{
    (void)snprintf(ws->message, sizeof ws->message, sentence, x);
    return KEMPE_E_FAILED;
}

static kempe_status missing(kempe_workspace *ws, const char *name)
{
    (void)snprintf(ws->message, sizeof ws->message, KMP_MISSING, name);
    return KEMPE_E_ARGUMENT;
}

/* -- new and free ------------------------------------------------------------------------------------ */

static bool allocate(kempe_workspace *ws)
{
    size_t n = (size_t)ws->n, m = (size_t)ws->m;
    ws->q = KMP_NEW(double, n);
    ws->qd = KMP_NEW(double, n);
    ws->mass = KMP_NEW(double, n *n);
    ws->bias = KMP_NEW(double, n);
    ws->h = KMP_NEW(double, m);
    ws->jdqd = KMP_NEW(double, m);
    ws->jacobian = KMP_NEW(double, m *n);
    ws->scaled = KMP_NEW(double, m *n);
    ws->matrix = KMP_NEW(double, (n + m) * (n + m));
    ws->rhs = KMP_NEW(double, n + m);
    ws->pivots = KMP_NEW(double, m < n ? m : n);
    ws->trial = KMP_NEW(double, n);
    ws->row = KMP_NEW(int, m);
    ws->col = KMP_NEW(int, n);
    ws->pivot = KMP_NEW(int, n + m);
    return ws->q && ws->qd && ws->mass && ws->bias && ws->h && ws->jdqd && ws->jacobian && ws->scaled && ws->matrix &&
           ws->rhs && ws->pivots && ws->trial && ws->row && ws->col && ws->pivot;
}

kempe_status kempe_workspace_new(const kempe_system *system, kempe_workspace **workspace)
{
    KMP_WANTED(NULL, system, "system");
    KMP_WANTED(system->context, workspace, "workspace");
    kempe_workspace *ws = KMP_NEW(kempe_workspace, 1);
    if (!ws)
        return kmp_fail_memory(system->context);
    ws->system = system;
    ws->n = system->n;
    ws->m = system->m;
    ws->plant = kmp_plant_new(system, "tape");
    if (!ws->plant || !allocate(ws)) {
        kempe_workspace_free(ws);
        return kmp_fail_memory(system->context);
    }
    *workspace = ws;
    return KEMPE_OK;
}

void kempe_workspace_free(kempe_workspace *ws)
{
    if (!ws)
        return;
    void *arrays[] = {ws->q,      ws->qd,  ws->mass,   ws->bias,  ws->h,   ws->jdqd, ws->jacobian, ws->scaled,
                      ws->matrix, ws->rhs, ws->pivots, ws->trial, ws->row, ws->col,  ws->pivot};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        kmp_free(arrays[k]);
    kmp_plant_free(ws->plant);
    kmp_free(ws);
}

/* -- values ------------------------------------------------------------------------------------------ */

static bool all_finite(int n, const double *x)
{
    for (int i = 0; i < n; i++)
        if (!isfinite(x[i]))
            return false;
    return true;
}

/* q and qd are kept: `qd` may be NULL, and both may be outputs of the caller. */
static void keep_state(kempe_workspace *ws, const double *q, const double *qd)
{
    memmove(ws->q, q, (size_t)ws->n * sizeof *q);
    if (qd)
        memmove(ws->qd, qd, (size_t)ws->n * sizeof *qd);
    else
        memset(ws->qd, 0, (size_t)ws->n * sizeof *ws->qd);
}

/* h and J at (t, q). */
static void evaluate_closure(kempe_workspace *ws, double t, const double *q)
{
    kmp_plant_closure(ws->plant, t, q);
    memcpy(ws->h, ws->plant->h, (size_t)ws->m * sizeof *ws->h);
    kmp_plant_dense_jacobian(ws->plant, ws->jacobian);
}

kempe_status kempe_eval(kempe_workspace *ws, double t, const double *q, const double *qd)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!q)
        return missing(ws, "q");
    ws->message[0] = '\0';
    keep_state(ws, q, qd);
    evaluate_closure(ws, t, ws->q);
    kmp_plant_mass(ws->plant);
    kmp_press_forget(ws->plant);
    kmp_plant_bias(ws->plant, ws->qd);
    kmp_plant_dense_mass(ws->plant, ws->mass);
    memcpy(ws->bias, ws->plant->bias, (size_t)ws->n * sizeof *ws->bias);
    memcpy(ws->jdqd, ws->plant->jdqd, (size_t)ws->m * sizeof *ws->jdqd);
    ws->kinetic = kmp_plant_kinetic(ws->plant, ws->qd);
    ws->potential = kmp_plant_potential(ws->plant, t, ws->q);
    if (all_finite(ws->n * ws->n, ws->mass) && all_finite(ws->n, ws->bias) && all_finite(ws->m, ws->h) &&
        all_finite(ws->m * ws->n, ws->jacobian) && all_finite(ws->m, ws->jdqd))
        return KEMPE_OK;
    return fail(ws, "the equations are not finite at t = %.9g", t);
}

const char *kempe_workspace_message(const kempe_workspace *workspace)
{
    KMP_GIVEN(workspace, "");
    return workspace->message;
}

const double *kempe_workspace_mass(const kempe_workspace *workspace)
{
    KMP_GIVEN(workspace, NULL);
    return workspace->mass;
}

const double *kempe_workspace_bias(const kempe_workspace *workspace)
{
    KMP_GIVEN(workspace, NULL);
    return workspace->bias;
}

const double *kempe_workspace_h(const kempe_workspace *workspace)
{
    KMP_GIVEN(workspace, NULL);
    return workspace->h;
}

const double *kempe_workspace_jacobian(const kempe_workspace *workspace)
{
    KMP_GIVEN(workspace, NULL);
    return workspace->jacobian;
}

const double *kempe_workspace_jdqd(const kempe_workspace *workspace)
{
    KMP_GIVEN(workspace, NULL);
    return workspace->jdqd;
}

double kempe_workspace_kinetic(const kempe_workspace *workspace)
{
    KMP_GIVEN(workspace, NAN);
    return workspace->kinetic;
}

double kempe_workspace_potential(const kempe_workspace *workspace)
{
    KMP_GIVEN(workspace, NAN);
    return workspace->potential;
}

/* -- the saddle system ------------------------------------------------------------------------------- */

/* The rows that are independent on the columns that may move, `rank` of them at the head of `row`. */
static void choose_rows(kempe_workspace *ws, const int *hold)
{
    const kempe_system *s = ws->system;
    int n = ws->n, m = ws->m, most = m < n ? m : n;
    for (int k = 0; k < n; k++)
        for (int r = 0; r < m; r++)
            ws->scaled[r + k * m] = hold && hold[k] ? 0 : ws->jacobian[r + k * m] * s->scale[k] / s->row_scale[r];
    ws->rank = 0;
    if (most == 0)
        return;
    kmp_lu_complete(m, n, ws->scaled, NULL, ws->row, ws->col, ws->pivots);
    while (ws->rank < most && ws->pivots[ws->rank] > KMP_RANK_OPEN * ws->pivots[0])
        ws->rank++;
}

/* Factors [D -J'; J 0]; D is M, or NULL for the metric of the coordinate scales. Held columns of J are left out. */
static bool factor(kempe_workspace *ws, const double *mass, const int *hold)
{
    int n = ws->n, m = ws->m, size;
    choose_rows(ws, hold);
    size = n + ws->rank;
    memset(ws->matrix, 0, (size_t)(size * size) * sizeof *ws->matrix);
    for (int k = 0; k < n; k++) {
        for (int i = 0; mass && i < n; i++)
            ws->matrix[i + k * size] = mass[i + k * n];
        if (!mass)
            ws->matrix[k + k * size] = 1 / (ws->system->scale[k] * ws->system->scale[k]);
        for (int r = 0; r < ws->rank && !(hold && hold[k]); r++) {
            ws->matrix[n + r + k * size] = ws->jacobian[ws->row[r] + k * m];
            ws->matrix[k + (n + r) * size] = -ws->jacobian[ws->row[r] + k * m];
        }
    }
    return kmp_lu_factor(size, ws->matrix, ws->pivot) == 0;
}

/* -- dynamics ---------------------------------------------------------------------------------------- */

kempe_status kempe_inverse_dynamics(kempe_workspace *ws, double t, const double *q, const double *qd, const double *qdd,
                                    double *Q)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!q)
        return missing(ws, "q");
    if (!qd)
        return missing(ws, "qd");
    if (!qdd)
        return missing(ws, "qdd");
    if (!Q)
        return missing(ws, "Q");
    kempe_status status = kempe_eval(ws, t, q, qd);
    if (status != KEMPE_OK)
        return status;
    for (int i = 0; i < ws->n; i++) {
        ws->trial[i] = ws->bias[i];
        for (int k = 0; k < ws->n; k++)
            ws->trial[i] += ws->mass[i + k * ws->n] * qdd[k];
    }
    memcpy(Q, ws->trial, (size_t)ws->n * sizeof *Q);
    return KEMPE_OK;
}

/* With the factors at hand, into rhs; `change`: of C alone. */
static void solve(kempe_workspace *ws, const double *bias, bool change)
{
    for (int i = 0; i < ws->n; i++)
        ws->rhs[i] = (ws->given && !change ? ws->given[i] : 0) - bias[i];
    for (int r = 0; r < ws->rank; r++)
        ws->rhs[ws->n + r] = change ? 0 : -ws->jdqd[ws->row[r]];
    kmp_lu_solve(ws->n + ws->rank, ws->matrix, ws->pivot, 1, ws->rhs);
}

static void take_multipliers(const kempe_workspace *ws, double *lambda)
{
    memset(lambda, 0, (size_t)ws->m * sizeof *lambda);
    for (int r = 0; r < ws->rank; r++)
        lambda[ws->row[r]] = ws->rhs[ws->n + r];
}

/* For forces that depend on multipliers. */
static void multipliers(void *self, const double *bias, bool change, double *lambda)
{
    solve(self, bias, change);
    take_multipliers(self, lambda);
}

/* Shares of the kept rows in dropped row r, as multipliers in rhs: M x - J' a = -J_r', J x = 0. */
static void find_shares(kempe_workspace *ws, int r)
{
    memset(ws->rhs, 0, (size_t)(ws->n + ws->rank) * sizeof *ws->rhs);
    for (int k = 0; k < ws->n; k++)
        ws->rhs[k] = -ws->jacobian[r + k * ws->m];
    kmp_lu_solve(ws->n + ws->rank, ws->matrix, ws->pivot, 1, ws->rhs);
}

/* A row whose multiplier a force depends on and which others are made from, or that is dropped itself: -1 when there is
 * none. */
static int find_shared(kempe_workspace *ws)
{
    const kempe_system *s = ws->system;
    for (int d = ws->rank; s->pressed_count > 0 && d < ws->m; d++) {
        int dropped = ws->row[d];
        find_shares(ws, dropped);
        for (int k = 0; k < s->pressed_count; k++) {
            int row = s->pressed[k];
            double share = row == dropped;
            for (int i = 0; i < ws->rank; i++)
                if (ws->row[i] == row)
                    share = ws->rhs[ws->n + i] * s->row_scale[row] / s->row_scale[dropped];
            if (fabs(share) > KMP_RANK_OPEN)
                return row;
        }
    }
    return -1;
}

static kempe_status fail_shared(kempe_workspace *ws, int row)
{
    (void)snprintf(ws->message, sizeof ws->message,
                   "a force depends on the multiplier of closure row '%s', which redundant rows leave undetermined",
                   ws->system->row_names[row]);
    return KEMPE_E_FAILED;
}

static kempe_status fail_unsettled(kempe_workspace *ws)
{
    kmp_text text = {0};
    kmp_put_unsettled(ws->plant, &text);
    (void)snprintf(ws->message, sizeof ws->message, "%s", text.s ? text.s : "");
    kmp_text_free(&text);
    return KEMPE_E_FAILED;
}

kempe_status kempe_forward_dynamics(kempe_workspace *ws, double t, const double *q, const double *qd, const double *Q,
                                    double *qdd, double *lambda)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!q)
        return missing(ws, "q");
    if (!qd)
        return missing(ws, "qd");
    if (!qdd)
        return missing(ws, "qdd");
    int n = ws->n;
    kempe_status status = kempe_eval(ws, t, q, qd);
    if (status != KEMPE_OK)
        return status;
    if (!factor(ws, ws->mass, NULL))
        return fail(ws, "the accelerations are not determined at t = %.9g: some motion carries no mass", t);
    const kmp_answer answer = {ws, multipliers};
    int shared = find_shared(ws);
    if (shared >= 0)
        return fail_shared(ws, shared);
    ws->given = Q;
    if (!kmp_press(ws->plant, &answer))
        return fail_unsettled(ws);
    memcpy(ws->bias, ws->plant->bias, (size_t)n * sizeof *ws->bias);
    solve(ws, ws->bias, false);
    if (!all_finite(n + ws->rank, ws->rhs))
        return fail(ws, "the accelerations are not finite at t = %.9g", t);
    memcpy(qdd, ws->rhs, (size_t)n * sizeof *qdd);
    if (!lambda)
        return KEMPE_OK;
    take_multipliers(ws, lambda);
    return KEMPE_OK;
}

/* -- closing ----------------------------------------------------------------------------------------- */

/* The least dx with J dx = -violation on the independent rows, in rhs; its largest component, scaled. */
static double correction(kempe_workspace *ws, const double *violation, const int *hold)
{
    double longest = 0;
    if (!factor(ws, NULL, hold))
        return INFINITY;
    memset(ws->rhs, 0, (size_t)ws->n * sizeof *ws->rhs);
    for (int r = 0; r < ws->rank; r++)
        ws->rhs[ws->n + r] = -violation[ws->row[r]];
    kmp_lu_solve(ws->n + ws->rank, ws->matrix, ws->pivot, 1, ws->rhs);
    for (int k = 0; k < ws->n; k++)
        longest = fmax(longest, isfinite(ws->rhs[k]) ? fabs(ws->rhs[k]) / ws->system->scale[k] : INFINITY);
    return longest;
}

/* Newton's method of least change, long steps cut; q in `trial`. Returns scaled |h|. */
static double close_q(kempe_workspace *ws, double t, const int *hold)
{
    double best = INFINITY;
    for (int k = 0; k < MAX_ITERATIONS; k++) {
        evaluate_closure(ws, t, ws->trial);
        double residual = kmp_plant_residual(ws->plant);
        if (!isfinite(residual) || (residual <= KMP_CLOSED_PUBLIC && residual >= best) || residual == 0)
            return residual;
        best = residual;
        double longest = correction(ws, ws->h, hold),
               cut = longest > KMP_LONGEST_CORRECTION ? KMP_LONGEST_CORRECTION / longest : 1;
        if (!isfinite(longest))
            return residual;
        for (int i = 0; i < ws->n; i++)
            ws->trial[i] += cut * ws->rhs[i];
    }
    return best;
}

/* J qd + h_t in jdqd. */
static void rate_violation(kempe_workspace *ws, const double *qd)
{
    for (int r = 0; r < ws->m; r++) {
        ws->jdqd[r] = ws->plant->h_t ? ws->plant->h_t[r] : 0;
        for (int k = 0; k < ws->n; k++)
            ws->jdqd[r] += ws->jacobian[r + k * ws->m] * qd[k];
    }
}

/* Two passes, the second against rounding; `qd` is corrected only when that is possible. */
static kempe_status close_rates(kempe_workspace *ws, double *qd, const int *hold)
{
    double size = 1;
    memcpy(ws->qd, qd, (size_t)ws->n * sizeof *qd);
    for (int pass = 0; pass < 2; pass++) {
        rate_violation(ws, ws->qd);
        if (!isfinite(correction(ws, ws->jdqd, hold)))
            break;
        for (int i = 0; i < ws->n; i++)
            ws->qd[i] += ws->rhs[i];
    }
    for (int i = 0; i < ws->n; i++)
        size = fmax(size, fabs(ws->qd[i]) / ws->system->scale[i]);
    double left = kmp_plant_rate_residual(ws->plant, ws->qd);
    if (!(left <= 1e-9 * size))
        return fail(ws, "the rates cannot be made consistent: |J qd| stays at %.3g (scaled)", left);
    memcpy(qd, ws->qd, (size_t)ws->n * sizeof *qd);
    return KEMPE_OK;
}

kempe_status kempe_close(kempe_workspace *ws, double t, double *q, double *qd, const int *hold)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!q)
        return missing(ws, "q");
    ws->message[0] = '\0';
    memcpy(ws->trial, q, (size_t)ws->n * sizeof *q);
    double residual = close_q(ws, t, hold);
    if (!(residual <= KMP_CLOSED_PUBLIC))
        return fail(ws, "the loops cannot be closed from here: |h| stays at %.3g (scaled)", residual);
    kempe_status status = qd ? close_rates(ws, qd, hold) : KEMPE_OK;
    if (status == KEMPE_OK)
        memcpy(q, ws->trial, (size_t)ws->n * sizeof *q);
    return status;
}
