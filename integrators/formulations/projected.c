/* SPDX-License-Identifier: BSD-3-Clause */
/* The projected formulation: y = (q, qd[, work]); accelerations from the saddle system. After each accepted step q and
 * qd return to the closures along the mass-orthogonal direction, by one simplified Newton step with the present
 * factors. It needs no choice of u. The independent rows are those of the start; dropped ones are monitored.
 *
 * These unknowns also serve to step across a change point. An integrator that chooses where to evaluate
 * (singular_step.h) then has each state closed first: off the closures accelerations are not those of the motion if J
 * is near to losing a row. */
#include "constraints/tolerances.h"
#include "integrators/formulations/formulation.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_CORRECTIONS = 8 };

typedef struct projected {
    kmp_formulation formulation; /* first */
    const kempe_system *s;
    kmp_evaluator *eval;
    kmp_margin *margin;
    const kmp_partition *part;
    kmp_saddle saddle;
    bool has_work;
    int n, m;
    double *violation;              /* m */
    double *lambda;                 /* m: for moving closures */
    double *dx;                     /* n */
    double *q, *qd;                 /* n */
    double tolerance;               /* of an angle */
    double t;                       /* of the last accepted step */
    double refused_h, refused_size; /* size and correction of the last step rejected from there for its rates; 0:
                                     * none */
    double noise;                   /* rounding of rates, over the fastest */
} projected;

/* Evaluates bias and factors at (t, q, qd). */
static int place(projected *d, double t, const double *q, const double *qd)
{
    kmp_eval_closure(d->eval, t, q);
    kmp_eval_mass(d->eval);
    kmp_eval_bias(d->eval, qd);
    return kmp_saddle_factor(&d->saddle) ? KMP_RETRY : KMP_GO;
}

/* dy at the state of the evaluator and the factors. */
static int give(projected *d, const double *y, double *dy)
{
    int n = d->n;
    memcpy(dy, y + n, (size_t)n * sizeof *dy);
    kmp_saddle_accelerations(&d->saddle, dy + n, d->s->rheonomic ? d->lambda : NULL);
    for (int i = 0; i < n; i++)
        if (!isfinite(dy[n + i]))
            return KMP_RETRY;
    if (d->has_work)
        dy[2 * n] = kmp_eval_power_here(d->eval, y + n) + kmp_eval_drive_power(d->eval, d->lambda);
    return KMP_GO;
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    projected *d = self;
    return place(d, t, y, y + d->n) == KMP_GO ? give(d, y, dy) : KMP_RETRY;
}

/* Callback of an integrator that steps across change points. */
static int closed(void *self, double t, double *y, bool as_it_is, double *dy, double *distance)
{
    projected *d = self;
    const kmp_closer closer = kmp_saddle_closer(&d->saddle, d->dx);
    const kmp_close_rule rule = {
        .most = MOST_CORRECTIONS, .enough = KMP_CLOSED_ENOUGH, .w = d->s->scale, .fraction = KMP_CORRECTION_LAST};
    int n = d->n, said = KMP_GO;
    if (!dy)
        kmp_eval_closure(d->eval, t, y);
    else if ((!as_it_is && !kmp_close(&closer, &rule, t, y).closed) || place(d, t, y, y + n) != KMP_GO)
        said = KMP_RETRY;
    else {
        if (!as_it_is) {
            kmp_close_rates(&closer, d->violation, y + n);
            kmp_eval_bias(d->eval, y + n);
        }
        said = give(d, y, dy);
    }
    if (distance)
        *distance = kmp_margin_at(d->margin, d->eval);
    return said;
}

/* True if a correction stays within the error weights. */
static bool is_small(int n, const double *dx, const double *w)
{
    for (int i = 0; i < n; i++)
        if (!(fabs(dx[i]) <= KMP_CORRECTION_LIMIT * w[i]))
            return false;
    return true;
}

/* The largest scaled component. */
static double size_of(const projected *d, const double *x)
{
    double size = 0;
    for (int i = 0; i < d->n; i++)
        size = isfinite(x[i]) ? fmax(size, fabs(x[i]) / d->s->scale[i]) : INFINITY;
    return size;
}

/* True if a correction of rates is due to rounding: within KMP_RATE_ROUNDING of the fastest rate. A light body between
 * heavy ones that passes its dead centre quickly makes J qd round off that much. Near a loss of rank, h that is `open`
 * by rounding alone moves q by dx = h / sigma, and J along the lost row by as much. Rates that are right at q then have
 * a relative error of dx / sigma = dx^2 / h at q + dx. */
static bool is_rounding(projected *d, double t, double open, const double *dqd, const double *qd)
{
    double most = size_of(d, dqd), fastest = size_of(d, qd), h = t - d->t, moved = size_of(d, d->dx);
    double lost = open <= KMP_CLOSED ? KMP_RATE_MARGIN * moved * moved / fmax(open, DBL_EPSILON) : 0;
    bool stays = d->refused_h > 0 && h <= 0.6 * d->refused_h && most > 0.5 * d->refused_size;
    d->refused_h = h;
    d->refused_size = most;
    if (stays && most <= KMP_RATE_NOISE * fastest)
        d->noise = fmax(d->noise, 4 * most / fastest);
    return most <= fmax(KMP_RATE_ROUNDING, fmin(fmax(d->noise, lost), KMP_RATE_NOISE)) * fastest;
}

/* Corrects q, then qd at the corrected q, both with the present factors. Where J loses a row the projection would
 * remove a part of the rates: such a step is rejected too. On rejection y is unchanged. */
static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    projected *d = self;
    int n = d->n;
    (void)dy;
    if (kmp_redundant_check(d->eval, d->part, t, d->tolerance, &d->formulation.reason) != KMP_GO)
        return KMP_HALT;
    kmp_saddle_solve(&d->saddle, NULL, d->eval->h, d->dx, NULL);
    bool small = is_small(n, d->dx, w);
    double open = kmp_eval_residual(d->eval);
    if (!small && open > KMP_CLOSED)
        return KMP_RETRY;
    for (int i = 0; i < n; i++)
        d->q[i] = y[i] + (small ? d->dx[i] : 0);
    kmp_eval_closure(d->eval, t, d->q);
    kmp_eval_rates(d->eval, y + n, d->violation);
    kmp_saddle_solve(&d->saddle, NULL, d->violation, d->qd, NULL);
    if (!is_small(n, d->qd, w + n) && !is_rounding(d, t, open, d->qd, y + n))
        return KMP_RETRY;
    if (kmp_margin_refuses(d->margin, d->eval, t))
        return KMP_RETRY;
    for (int i = 0; i < n; i++) {
        y[i] = d->q[i];
        y[n + i] += d->qd[i];
    }
    d->t = t;
    d->refused_h = 0;
    d->noise *= KMP_RATE_FADES;
    d->formulation.factorizations = d->saddle.factorizations;
    return KMP_GO;
}

/* Projects rows between steps too, to round-off. */
static int row(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    projected *d = (projected *)formulation;
    int n = d->n;
    const kmp_closer closer = kmp_saddle_closer(&d->saddle, d->dx);
    memcpy(q, y, (size_t)n * sizeof *q);
    qd = qd ? qd : d->qd;
    memcpy(qd, y + n, (size_t)n * sizeof *qd);
    if (!kmp_close_state(&closer, d->violation, t, q, qd)) {
        kmp_text_printf(&formulation->reason, "the closures could not be solved at the output time t = %.9g", t);
        return KMP_HALT;
    }
    if (qdd) {
        kmp_eval_bias(d->eval, qd);
        kmp_saddle_accelerations(&d->saddle, qdd, lambda);
    }
    *work = d->has_work ? y[2 * n] : 0;
    return KMP_GO;
}

static int resume(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y, double *yp)
{
    projected *d = (projected *)formulation;
    d->t = t;
    (void)yp;
    memcpy(y, q, (size_t)d->n * sizeof *y);
    memcpy(y + d->n, qd, (size_t)d->n * sizeof *y);
    return KMP_GO;
}

static void release(kmp_formulation *formulation)
{
    kmp_saddle_free(&((projected *)formulation)->saddle);
    kmp_formulation_free(formulation);
}

static kmp_formulation *create(const kmp_formulation_kind *kind, const kmp_formulation_start *start)
{
    (void)kind;
    projected *d = kmp_formulation_new(start, sizeof *d);
    if (!d)
        return NULL;
    int n = d->n = d->formulation.n;
    d->s = start->system;
    d->eval = start->eval;
    d->margin = start->margin;
    d->part = start->part;
    d->m = start->part->m;
    d->has_work = start->system->dissipative;
    d->tolerance = start->atol + start->rtol;
    d->t = start->t;
    (void)KMP_ARENA_GROUPS(&d->formulation.arena, {d->m, {&d->violation, &d->lambda}}, {n, {&d->dx, &d->q, &d->qd}});
    kmp_formulation_make_unknowns(&d->formulation, 2 * n + d->has_work, false);
    d->formulation.release = release;
    d->formulation.row = row;
    d->formulation.position = kmp_formulation_position_of_state;
    d->formulation.resume = resume;
    d->formulation.ode =
        (kmp_ode){.n = d->formulation.size, .self = d, .rhs = rhs, .accept = accept, .closed = closed, .positions = n};
    if (d->formulation.arena.failed || !kmp_saddle_init(&d->saddle, d->eval, d->part)) {
        (void)kmp_fail_memory(start->system->context);
        release(&d->formulation);
        return NULL;
    }
    kmp_formulation_begin_with_state(&d->formulation, start);
    if (d->has_work) {
        d->formulation.y[2 * n] = start->work;
        d->formulation.atol[2 * n] = 1e300; /* measured, not controlled */
    }
    return &d->formulation;
}

const kmp_formulation_kind kmp_formulation_projected = {.formulation = "projected",
                                                        .form = "none",
                                                        .standard = true,
                                                        .corrected = true,
                                                        .by_bodies = true,
                                                        .create = create};

/* Uses M and C: the equations of articulated bodies have the square of J's condition. */
const kmp_formulation_kind kmp_formulation_near_singular = {
    .formulation = "near_singular", .form = "none", .corrected = true, .create = create};
