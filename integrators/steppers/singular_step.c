/* SPDX-License-Identifier: BSD-3-Clause */
/* Step across a singular place. The solution is smooth there, only its right-hand side is 0/0. So dy/dt is approximated
 * by a polynomial through Gauss's nodes, none of which lies at the place, and the solution is its integral,
 *
 *     dy/dt (x) = sum a_k P_k(x),   y(x) = y0 + h/2 sum a_k I_k(x),   I_k = (P_k+1 - P_k-1) / (2 k + 1),  I_0 = x + 1
 *
 * for x from -1 to 1. Each node is evaluated at a closed state, and Picard's iteration finds the polynomial (Hairer,
 * Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., II.7: collocation of order 2 s). The last
 * coefficients show if the solution is smooth. They do not vanish where it turns instead of continuing straight, and
 * they are noise where a node is too near to the place; the step is then rejected. */
#include "integrators/steppers/singular_step.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

enum { NODES = 12, MOST_SWEEPS = 40, MOST_PLACES = 3, PROBES = 60, VERTICES = 40 };
#define DOUBLING 2.0

/* Distance from the place at which a step lands, over its usual value; landings in the order of trials. */
static const double LANDINGS[] = {0.25, 0.06, 0.5};

typedef struct singular_step {
    kmp_solver base; /* first */
    double nearest, nearest_t;
    double *y;        /* n */
    double *y0, *dy0; /* n: start of the step */
    double *trial;    /* n */
    double *node;     /* NODES x n: y at the nodes, by the polynomial */
    double *slope;    /* NODES x n: dy/dt at the nodes */
    double *a;        /* NODES x n: coefficients */
    double h;
    double p[NODES][NODES];        /* P_k at node j: p[k][j] */
    double integral[NODES][NODES]; /* I_k at node j */
} singular_step;

/* -- Legendre's polynomials ------------------------------------------------------------------------- */

/* P_0 .. P_count-1 at x. */
static void legendre(int count, double x, double *p)
{
    p[0] = 1;
    p[1] = x;
    for (int k = 2; k < count; k++)
        p[k] = ((2 * k - 1) * x * p[k - 1] - (k - 1) * p[k - 2]) / k;
}

/* I_0 .. I_NODES-1 at x. */
static void integrals(double x, double *i)
{
    double p[NODES + 1];
    legendre(NODES + 1, x, p);
    i[0] = x + 1;
    for (int k = 1; k < NODES; k++)
        i[k] = (p[k + 1] - p[k - 1]) / (2 * k + 1);
}

/* Gauss's nodes, the roots of P_NODES, and weights. */
static const double X[NODES] = {-0.98156063424671924, -0.9041172563704748,  -0.76990267419430469, -0.58731795428661748,
                                -0.36783149899818018, -0.12523340851146894, 0.12523340851146891,  0.36783149899818018,
                                0.58731795428661748,  0.76990267419430469,  0.9041172563704748,   0.98156063424671924};
static const double WEIGHT[NODES] = {0.047175336386511835, 0.10693932599531818, 0.16007832854334633,
                                     0.20316742672306584,  0.23349253653835478, 0.24914704581340288,
                                     0.24914704581340288,  0.23349253653835478, 0.20316742672306584,
                                     0.16007832854334633,  0.10693932599531818, 0.047175336386511835};

/* Computes the coefficients from the slopes. */
static void fit(singular_step *s)
{
    int n = s->base.ode.n;
    memset(s->a, 0, (size_t)(NODES * n) * sizeof *s->a);
    for (int k = 0; k < NODES; k++)
        for (int j = 0; j < NODES; j++) {
            double part = 0.5 * (2 * k + 1) * WEIGHT[j] * s->p[k][j];
            for (int i = 0; i < n; i++)
                s->a[k * n + i] += part * s->slope[j * n + i];
        }
}

/* y = y0 + h/2 sum a_k integral_k */
static void combine(const singular_step *s, const double *integral, double *y)
{
    int n = s->base.ode.n;
    for (int i = 0; i < n; i++) {
        double sum = 0;
        for (int k = NODES - 1; k >= 0; k--)
            sum += integral[k] * s->a[k * n + i];
        y[i] = s->y0[i] + 0.5 * s->h * sum;
    }
}

static void at(const singular_step *s, double t, double *y)
{
    double integral[NODES];
    integrals(2 * (t - s->base.t_old) / s->h - 1, integral);
    combine(s, integral, y);
}

/* -- destination ---------------------------------------------------------------------------------------- */

/* Largest |x| in error weights. */
static double weighted(const singular_step *s, const double *x)
{
    double most = 0;
    for (int i = 0; i < s->base.ode.n; i++) {
        double w = (s->base.tolerance.atol[i] + s->base.tolerance.rtol * fabs(s->y0[i])) * KMP_SINGULAR_SMOOTH /
                   s->base.tolerance.rtol;
        most = isfinite(x[i]) ? fmax(most, fabs(x[i]) / w) : INFINITY;
    }
    return most;
}

/* Extrapolates y by tau from (q, qd): along the slope and its change. */
static void extrapolate(const singular_step *s, const double *y, const double *dy, double tau, double *to)
{
    int n = s->base.ode.n, m = s->base.ode.positions;
    for (int i = 0; i < n; i++)
        to[i] = y[i] + tau * (dy[i] + (i < m ? 0.5 * tau * dy[i + m] : 0));
}

static double distance(singular_step *s, double t, double *y)
{
    double d = 0;
    return s->base.ode.closed(s->base.ode.self, t, y, true, NULL, &d) == KMP_GO ? d : INFINITY;
}

/* Distance from the singular place along the extrapolation. */
static double ahead(singular_step *s, double tau)
{
    extrapolate(s, s->y0, s->dy0, tau, s->trial);
    return distance(s, s->base.t + tau, s->trial);
}

/* Distance from the singular place along the polynomial. */
static double within(singular_step *s, double tau)
{
    at(s, s->base.t_old + tau, s->trial);
    return distance(s, s->base.t_old + tau, s->trial);
}

/* The time of the least distance between two times. Its square is a parabola as long as the lost row's remainder varies
 * linearly. The vertex of the parabola through three places therefore replaces the worst of them, repeatedly; where
 * there is no vertex between the times, the middle between the best place and the next one. */
static double least(singular_step *s, double (*of)(singular_step *, double), double from, double to, double *size)
{
    double x[3] = {from, 0.5 * (from + to), to}, d[3];
    int best = 0;
    for (int k = 0; k < 3; k++) {
        d[k] = of(s, x[k]) * of(s, x[k]);
        best = d[k] < d[best] ? k : best;
    }
    for (int pass = 0; pass < VERTICES && isfinite(d[0] + d[1] + d[2]); pass++) {
        int worst = d[0] > d[1] ? (d[0] > d[2] ? 0 : 2) : (d[1] > d[2] ? 1 : 2);
        double left = (d[1] - d[0]) / (x[1] - x[0]), right = (d[2] - d[1]) / (x[2] - x[1]);
        double curvature = (right - left) / (x[2] - x[0]), vertex = 0.5 * (x[0] + x[1] - left / curvature);
        double other = x[(best + 1) % 3], last = x[(best + 2) % 3];
        if (!(curvature > 0) || !(vertex >= from && vertex <= to))
            vertex = 0.5 * (x[best] + (fabs(other - x[best]) < fabs(last - x[best]) ? other : last));
        if (vertex == x[0] || vertex == x[1] || vertex == x[2])
            break;
        x[worst] = vertex;
        d[worst] = of(s, vertex) * of(s, vertex);
        best = d[worst] < d[best] ? worst : best;
    }
    *size = sqrt(d[best]);
    return x[best];
}

/* The time after which the distance has grown to `landing`, at most to the end; the singular place lies `place` after
 * the start (0: behind it). 0 if the extrapolation does not reach the landing from below. */
static double look_ahead(singular_step *s, double now, double landing, double *place)
{
    double left = s->base.t_end - s->base.t, tau = 1e-7 * left, low = now, lowest = 0, before = 0, d = now, size = now;
    for (int k = 0; k < PROBES && before < left && !(d > low && d > 1.01 * now); k++) { /* until the distance grows */
        d = ahead(s, tau);
        lowest = d < low ? tau : lowest;
        low = fmin(low, d);
        before = tau;
        tau = fmin(DOUBLING * tau, left);
    }
    *place = lowest > 0 ? least(s, ahead, lowest / DOUBLING, fmin(DOUBLING * lowest, left), &size) : 0;
    if (fmin(low, size) >= landing)
        return 0;
    double from = *place, least_d = fmin(low, size);
    for (; d < landing && before < left; before = fmin(DOUBLING * before, left)) {
        from = before;
        least_d = d;
        d = ahead(s, fmin(DOUBLING * before, left));
    }
    return d > landing ? from + (before - from) * (landing - least_d) / (d - least_d) : before;
}

/* A length near `wanted`, at most `most`, with the singular place between nodes. */
static double length_of(double wanted, double most, double place)
{
    double best = fmin(wanted, most), miss = INFINITY;
    if (place <= 0.25 * (1 + X[0]) * best)
        return best;
    for (int j = 0; j < NODES - 1; j++) {
        double h = place / (0.25 * (2 + X[j] + X[j + 1])), off = fabs(log(h / wanted));
        if (h <= fmin(KMP_SINGULAR_BEYOND * wanted, most) && off < miss) {
            miss = off;
            best = h;
        }
    }
    return best;
}

/* -- the step ------------------------------------------------------------------------------------------ */

static int evaluate(singular_step *s, int j)
{
    int n = s->base.ode.n;
    s->base.work.rhs++;
    memcpy(s->trial, s->node + j * n, (size_t)n * sizeof *s->trial);
    return s->base.ode.closed(s->base.ode.self, s->base.t + 0.5 * s->h * (1 + X[j]), s->trial, false, s->slope + j * n,
                              NULL);
}

/* One Picard iteration; *change: the difference of the nodes, in error weights. */
static int sweep(singular_step *s, double *change)
{
    int n = s->base.ode.n, said = KMP_GO;
    *change = 0;
    fit(s);
    for (int j = 0; said == KMP_GO && j < NODES; j++) {
        double integral[NODES];
        for (int k = 0; k < NODES; k++)
            integral[k] = s->integral[k][j];
        combine(s, integral, s->trial);
        for (int i = 0; i < n; i++) {
            double moved = s->trial[i] - s->node[j * n + i];
            s->node[j * n + i] = s->trial[i];
            s->trial[i] = moved;
        }
        *change = fmax(*change, weighted(s, s->trial));
        said = evaluate(s, j);
    }
    return said;
}

/* The last terms of the polynomial, in error weights. */
static double roughness(singular_step *s)
{
    int n = s->base.ode.n;
    for (int i = 0; i < n; i++)
        s->trial[i] =
            0.5 * s->h *
            (fabs(s->a[(NODES - 2) * n + i]) / (2 * NODES - 3) + fabs(s->a[(NODES - 1) * n + i]) / (2 * NODES - 1));
    return weighted(s, s->trial);
}

/* Result of the iteration. */
typedef enum outcome { SMOOTHLY, TURNS, UNSETTLED } outcome;

/* Picard's iteration until it ends. */
static outcome converge(singular_step *s)
{
    double change = INFINITY, last = INFINITY;
    const double *y = s->y0, *dy = s->dy0;
    for (int j = 0, n = s->base.ode.n; j < NODES; j++) { /* predicts the nodes, each from the one before */
        extrapolate(s, y, dy, 0.5 * s->h * (X[j] - (j ? X[j - 1] : -1)), s->node + j * n);
        if (evaluate(s, j) != KMP_GO)
            return UNSETTLED;
        y = s->node + j * n;
        dy = s->slope + j * n;
    }
    for (int k = 0; k < MOST_SWEEPS && !(change <= KMP_SINGULAR_SETTLED); k++) {
        if (sweep(s, &change) != KMP_GO)
            return UNSETTLED;
        if (k > 2 && change > KMP_SINGULAR_SHRINKS * last)
            break; /* noise, or no convergence */
        if (k > 1 && roughness(s) > KMP_SINGULAR_ROUGH * fmax(1, change * change / last))
            return TURNS; /* more than the remaining iterations can correct */
        last = change;
    }
    fit(s);
    return change > KMP_SINGULAR_NOISE ? UNSETTLED : roughness(s) > fmax(1, change) ? TURNS : SMOOTHLY;
}

/* Steps from the start with its slope to a landing. The predicted place is inexact: if nodes are too near to it, it is
 * found again along the polynomial. */
static outcome step_to(singular_step *s, double now, double landing)
{
    int n = s->base.ode.n;
    double place, end = s->base.t, left = s->base.t_end - s->base.t, wanted = look_ahead(s, now, landing, &place),
                  ones[NODES] = {2};
    outcome what = UNSETTLED;
    for (int k = 0; k < MOST_PLACES && what == UNSETTLED; k++) {
        double size, h, t_old = s->base.t_old;
        s->base.t_old = s->base.t; /* along the polynomial a node on the place affects the last digits of its slope */
        h = length_of(wanted, left, k > 0 ? least(s, within, 0, s->h, &size) : place);
        s->base.t_old = t_old;
        if (k > 0 && fabs(h - s->h) < KMP_SINGULAR_SAME * h)
            break;
        s->h = h;
        end = h == left ? s->base.t_end : s->base.t + h;
        what = end > s->base.t ? converge(s) : UNSETTLED;
        if (!(end > s->base.t) || place <= 0)
            break;
    }
    if (what != SMOOTHLY)
        return what;
    combine(s, ones, s->y); /* I_k(1) = 0 but for k = 0 */
    s->base.work.rhs++;
    if (s->base.ode.closed(s->base.ode.self, end, s->y, false, s->slope, NULL) != KMP_GO) {
        memcpy(s->y, s->y0, (size_t)n * sizeof *s->y);
        return UNSETTLED;
    }
    s->base.t_old = s->base.t;
    s->base.t = end;
    return SMOOTHLY;
}

/* -- interface ---------------------------------------------------------------------------------------- */

static void *create(const kmp_solver_kind *kind, const kmp_solver_setup *setup)
{
    singular_step *s = kmp_solver_new(kind, setup, sizeof *s);
    if (!s)
        return NULL;
    int n = s->base.ode.n;
    (void)KMP_ARENA_MAKE(&s->base.arena, KMP_ROOM(double, n, &s->y, &s->y0, &s->dy0, &s->trial),
                         KMP_ROOM(double, NODES *n, &s->node, &s->slope, &s->a));
    /* Tabulates the polynomials at the nodes. */
    for (int j = 0; j < NODES; j++) {
        double p[NODES], i[NODES];
        legendre(NODES, X[j], p);
        integrals(X[j], i);
        for (int k = 0; k < NODES; k++) {
            s->p[k][j] = p[k];
            s->integral[k][j] = i[k];
        }
    }
    return kmp_solver_made(s);
}

static kempe_status start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    singular_step *s = solver;
    (void)yp, (void)h0;
    kmp_solver_begin(&s->base, t, t_end, 0);
    s->nearest = INFINITY;
    memcpy(s->y, y, (size_t)s->base.ode.n * sizeof *y);
    return KEMPE_OK;
}

static kempe_status step(void *solver)
{
    singular_step *s = solver;
    if (!(s->base.t < s->base.t_end))
        return KEMPE_OK;
    /* A step across from the present closed state, at the landings in turn. */
    size_t bytes = (size_t)s->base.ode.n * sizeof *s->y0;
    double now = 0;
    outcome what = UNSETTLED;
    memcpy(s->y0, s->y, bytes);
    memcpy(s->trial, s->y, bytes);
    s->base.work.rhs++;
    if (s->base.ode.closed(s->base.ode.self, s->base.t, s->trial, true, s->dy0, &now) != KMP_GO)
        return KEMPE_E_FAILED;
    for (size_t k = 0; k < sizeof LANDINGS / sizeof *LANDINGS && what != SMOOTHLY && (k < 2 || what == UNSETTLED); k++)
        what = step_to(s, now, LANDINGS[k]);
    s->base.work.refused += what != SMOOTHLY;
    if (what != SMOOTHLY)
        return KEMPE_E_FAILED;
    s->base.work.steps++;
    double size, tau = least(s, within, 0, s->h, &size);
    s->nearest_t = size < s->nearest ? s->base.t_old + tau : s->nearest_t;
    s->nearest = fmin(s->nearest, size);
    return KEMPE_OK;
}

static kempe_status dense(void *solver, double time, double *y, double *yp)
{
    singular_step *s = solver;
    (void)yp;
    if (time == s->base.t)
        memcpy(y, s->y, (size_t)s->base.ode.n * sizeof *y);
    else
        at(s, time, y);
    return KEMPE_OK;
}

static void transfer(void *solver, kmp_number_stream *stream)
{
    singular_step *s = solver;
    int n = s->base.ode.n;
    kmp_solver_transfer_times(&s->base, stream);
    kmp_stream_numbers(stream, 1, &s->h);
    kmp_stream_numbers(stream, n, s->y);
    kmp_stream_numbers(stream, n, s->y0);
    kmp_stream_numbers(stream, NODES * n, s->a);
}

void kmp_singular_step_nearest(const void *solver, double *time, double *size)
{
    const singular_step *s = solver;
    *time = s->nearest_t;
    *size = s->nearest;
}

const kmp_solver_kind kmp_solver_singular_step = {.name = "singular_step",
                                                  .corrects = true,
                                                  .create = create,
                                                  .release = kmp_solver_free,
                                                  .start = start,
                                                  .step = step,
                                                  .dense = dense,
                                                  .transfer = transfer};
