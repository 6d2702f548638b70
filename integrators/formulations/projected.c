/* SPDX-License-Identifier: BSD-3-Clause */
/* The projected formulation: y = (q, qd[, work]); accelerations from the saddle system, by the saddle program
 * (constraints/programs/saddle_program.h) where there is one and its pivots are good. After each accepted step q and qd
 * return to the closures along the mass-orthogonal direction, by one simplified Newton step with the present factors.
 * It needs no choice of u. The independent rows are determined at the start; dropped ones are monitored.
 *
 * These unknowns also serve to step across a change point. An integrator that chooses where to evaluate
 * (singular_step.h) then has each state closed first: off the closures accelerations differ from the motion's if
 * J is near to losing a row. */
#include "integrators/formulations/projected.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/stage_lanes.h"
#include "constraints/programs/load_passes.h"
#include "constraints/programs/saddle_program.h"
#include "constraints/tolerances.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/formulations/formulation.h"
#include "linalg/dense/dot.h"
#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

enum { MOST_CORRECTIONS = 8 };

/* Runs in lanes after which the program of places nearby is made: about as many as it takes to save what its making
 * costs, 900 to 2100 (bench/bench_sweeps.c). */
#define NEARBY_AFTER 1500
/* Stages that are evaluated one by one take about nine times as long as in lanes: more than this part of all batches,
 * and at least this number, are too many. */
#define MOST_APART (1. / 16)
enum { SOME_APART = 32 };
/* It must take less than this part of the cycles of the saddle program. */
#define NEARBY_WORTH 0.7

typedef struct projected {
    kmp_formulation formulation; /* first */
    const kempe_system *s;
    kmp_evaluator *eval;
    kmp_rank_margin *margin;
    kmp_partition part; /* a copy: the run chooses rows again before it leaves these */
    kmp_saddle saddle;
    kmp_saddle_program *saddle_program; /* NULL: there is none */
    kmp_stage_lanes stages;             /* the saddle program for several stages at once, */
    kmp_load_passes loads;              /* and its multipliers that forces depend on; without room: there are none */
    kmp_program *nearby;                /* kmp_saddle_program_write_nearby; NULL: there is none */
    kmp_stage_lanes near;               /* that program for several stages at once */
    const double *of_run; /* outputs of the last run of `stages`, whose factors `near` does not have; NULL: it has */
    double cycles_near;   /* of a run of `near`; 0: there is none */
    bool may_write;       /* programs may be made between steps */
    bool is_near;         /* the factors in `near` belong to the last run of `stages` */
    long sweeps;          /* runs of `stages` without that program */
    bool lanes;           /* the integrator uses them */
    bool by_mass;         /* the last row was closed by M in place of articulated bodies */
    bool by_program;      /* the last evaluation was by the saddle program, whose factors serve corrections */
    bool cancelled;       /* rounding showed in its accelerations */
    long runs;            /* of the saddle program */
    long batches, apart;  /* of stages in lanes; of these, with a pivot that has lost too many digits */
    long due;             /* the number of evaluations by parts from which on it pays */
    double rtol, rate_scale;
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
static int factor_at(projected *d, double t, const double *q, const double *qd)
{
    d->by_program = false;
    kmp_eval_closure(d->eval, t, q);
    kmp_eval_mass(d->eval);
    kmp_eval_bias(d->eval, qd);
    return kmp_saddle_factor(&d->saddle) ? KMP_RETRY : KMP_GO;
}

/* dy at the state of the evaluator and the factors. */
static int put_derivative(projected *d, const double *y, double *dy)
{
    int n = d->n;
    memcpy(dy, y + n, (size_t)n * sizeof *dy);
    kmp_saddle_accelerations(&d->saddle, dy + n, d->s->rheonomic ? d->lambda : NULL);
    if (!kmp_all_finite(n, dy + n))
        return KMP_RETRY;
    if (d->has_work)
        dy[2 * n] = kmp_eval_power_here(d->eval, y + n) + kmp_eval_drive_power(d->eval, d->lambda);
    return KMP_GO;
}

static bool applies(const projected *d)
{
    return d->saddle_program && !d->cancelled && kmp_saddle_program_applies(d->saddle_program);
}

/* Runs the saddle program; NULL: there is none, it does not apply, or its pivots are bad. */
static const double *run_program(projected *d, double t, const double *q, const double *qd)
{
    bool good = false;
    const double *out = NULL;
    if (applies(d)) {
        out = kmp_saddle_program_run(d->saddle_program, t, q, qd, &good);
        d->runs++;
    }
    d->by_program = good;
    return good ? out : NULL;
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    projected *d = self;
    size_t n = (size_t)d->n;
    const double *out = run_program(d, t, y, y + n);
    if (!out) {
        d->formulation.by_parts++;
        return factor_at(d, t, y, y + n) == KMP_GO ? put_derivative(d, y, dy) : KMP_RETRY;
    }
    const kmp_saddle_program_layout *layout = kmp_saddle_program_layout_of(d->saddle_program);
    memcpy(dy, y + n, n * sizeof *dy);
    memcpy(dy + n, out + layout->qdd, n * sizeof *dy);
    if (d->has_work)
        dy[2 * n] = out[layout->power];
    return kmp_all_finite(d->n, dy + n) ? KMP_GO : KMP_RETRY;
}

/* The outputs of several stages. NULL: multipliers that forces depend on do not settle in all of them. */
static const double *run_stages(projected *d, const double *t, const double *y)
{
    kmp_stage_lanes_place(&d->stages, t, y, y + (size_t)d->n * KMP_STAGE_LANES);
    d->runs++;
    d->batches++;
    d->sweeps++;
    if (d->loads.nu) {
        kmp_load_begin(&d->loads, d->eval->nu);
        if (!kmp_load_settle_lanes(&d->loads, d->stages.lanes))
            return NULL;
    }
    return kmp_lanes_run(d->stages.lanes, KMP_SADDLE_PROGRAM_RUN);
}

/* Callback of an integrator that evaluates several stages at once. */
static int rhs_of_stages(void *self, const double *t, const double *y, double *dy)
{
    projected *d = self;
    if (!d->stages.lanes || !applies(d))
        return KMP_APART;
    const kmp_saddle_program_layout *layout = kmp_saddle_program_layout_of(d->saddle_program);
    size_t w = KMP_STAGE_LANES, n = (size_t)d->n;
    const double *out = run_stages(d, t, y);
    d->of_run = NULL;
    d->is_near = false;
    if (!out) {
        d->apart++;
        return KMP_APART;
    }
    memcpy(dy + n * w, out + (size_t)layout->qdd * w, n * w * sizeof *dy);
    if (d->has_work)
        memcpy(dy + 2 * n * w, out + (size_t)layout->power * w, w * sizeof *dy);
    if (!kmp_stage_lanes_exceed(layout->pivots, out + (size_t)layout->pivot * w, KMP_SADDLE_PROGRAM_PIVOT,
                                out + (size_t)layout->diagonal * w)) {
        d->apart++;
        return KMP_APART;
    }
    d->of_run = out;
    return kmp_stage_lanes_finite(d->n, dy + n * w) ? KMP_GO : KMP_RETRY;
}

/* Callback after rhs_of_stages: the factors of that run, in each lane, serve at places nearby. */
static int improve_stages(void *self, const double *t, const double *y, double *dy)
{
    projected *d = self;
    if (!d->near.lanes || !applies(d) || (!d->of_run && !d->is_near))
        return KMP_APART;
    size_t w = KMP_STAGE_LANES, n = (size_t)d->n;
    if (d->of_run) {
        kmp_lanes_set(d->near.lanes, KMP_IN_MU, kmp_lanes_run(d->stages.lanes, KMP_SADDLE_PROGRAM_FACTORS));
        kmp_lanes_set(d->near.lanes, KMP_IN_LAMBDA,
                      d->of_run + (size_t)kmp_saddle_program_layout_of(d->saddle_program)->lambda * w);
    }
    d->of_run = NULL;
    d->is_near = true;
    kmp_lanes_set(d->near.lanes, KMP_IN_QDD, dy + n * w);
    const double *out = kmp_stage_lanes_run(&d->near, 1, t, y, y + n * w), *lambda = out + n * w;
    kmp_lanes_set(d->near.lanes, KMP_IN_LAMBDA, lambda);
    memcpy(dy + n * w, out, n * w * sizeof *dy);
    if (d->has_work)
        memcpy(dy + 2 * n * w, lambda + (size_t)d->part.r * w, w * sizeof *dy);
    return kmp_stage_lanes_finite(d->n, dy + n * w) ? KMP_GO : KMP_RETRY;
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
    else if ((!as_it_is && !kmp_close(&closer, &rule, t, y).closed) || factor_at(d, t, y, y + n) != KMP_GO)
        said = KMP_RETRY;
    else {
        if (!as_it_is) {
            kmp_close_rates(&closer, d->violation, y + n);
            kmp_eval_bias(d->eval, y + n);
        }
        said = put_derivative(d, y, dy);
    }
    if (distance)
        *distance = kmp_rank_margin_at(d->margin, d->eval);
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
static double scaled_size(const projected *d, const double *x)
{
    double size = 0;
    for (int i = 0; i < d->n; i++)
        size = isfinite(x[i]) ? fmax(size, fabs(x[i]) / d->s->scale[i]) : INFINITY;
    return size;
}

/* True if a correction of rates is due to rounding: within KMP_RATE_ROUNDING of the fastest rate. A light body between
 * heavy ones that passes its dead centre quickly makes J qd round off that much. Near a loss of rank, h that is `open`
 * only by rounding moves q by dx = h / sigma, and J along the lost row by as much. Rates that are right at q then have
 * a relative error of dx / sigma = dx^2 / h at q + dx. */
static bool is_rounding(projected *d, double t, double open, const double *dqd, const double *qd)
{
    double most = scaled_size(d, dqd), fastest = scaled_size(d, qd), h = t - d->t, moved = scaled_size(d, d->dx);
    double lost = open <= KMP_CLOSED ? KMP_RATE_MARGIN * moved * moved / fmax(open, DBL_EPSILON) : 0;
    bool stays = d->refused_h > 0 && h <= 0.6 * d->refused_h && most > 0.5 * d->refused_size;
    d->refused_h = h;
    d->refused_size = most;
    if (stays && most <= KMP_RATE_NOISE * fastest)
        d->noise = fmax(d->noise, 4 * most / fastest);
    return most <= fmax(KMP_RATE_ROUNDING, fmin(fmax(d->noise, lost), KMP_RATE_NOISE)) * fastest;
}

/* The mass-orthogonal correction with the factors of the last evaluation. */
static void correct(projected *d, const double *violation, double *dx)
{
    if (d->by_program)
        kmp_saddle_program_correct(d->saddle_program, violation, dx);
    else
        kmp_saddle_solve(&d->saddle, NULL, violation, dx, NULL);
}

/* Corrects q, then qd at the corrected q, both with the present factors. If J loses a row, the projection would
 * remove a part of the rates: such a step is rejected too. On rejection y is unchanged. */
static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    projected *d = self;
    int n = d->n;
    (void)dy;
    if (d->by_program) {
        kmp_saddle_program_lend(d->saddle_program, t, y);
        d->cancelled = kmp_saddle_program_is_cancelled(d->saddle_program, d->rtol, d->rate_scale);
    }
    if (kmp_redundant_check(d->eval, &d->part, t, d->tolerance, &d->formulation.reason) != KMP_GO)
        return KMP_HALT;
    correct(d, d->eval->h, d->dx);
    bool small = is_small(n, d->dx, w);
    double open = kmp_eval_residual(d->eval);
    if (!small && open > KMP_CLOSED)
        return KMP_RETRY;
    for (int i = 0; i < n; i++)
        d->q[i] = y[i] + (small ? d->dx[i] : 0);
    kmp_eval_closure(d->eval, t, d->q);
    kmp_eval_rates(d->eval, y + n, d->violation);
    correct(d, d->violation, d->qd);
    if (!is_small(n, d->qd, w + n) && !is_rounding(d, t, open, d->qd, y + n))
        return KMP_RETRY;
    if (kmp_rank_margin_refuses(d->margin, d->eval, t))
        return KMP_RETRY;
    for (int i = 0; i < n; i++) {
        y[i] = d->q[i];
        y[n + i] += d->qd[i];
    }
    d->t = t;
    d->refused_h = 0;
    d->noise *= KMP_RATE_FADES;
    d->formulation.factorizations = d->saddle.factorizations + d->runs;
    d->formulation.one_by_one =
        d->stages.lanes &&
        (d->cancelled || (d->apart >= SOME_APART && (double)d->apart > MOST_APART * (double)d->batches));
    return KMP_GO;
}

/* As close_row, by a saddle system of M: where open loops leave a motion almost without inertia, articulated bodies
 * have lost the digits. The evaluator is left at another state. */
static bool close_row_by_mass(projected *d, double t, const double *y, double *q, double *qd)
{
    kmp_saddle by_mass;
    if (!d->eval->by_bodies || kmp_eval_add_composite(d->eval) != KEMPE_OK)
        return false;
    kmp_eval_set_by_bodies(d->eval, false);
    bool closed = kmp_saddle_init(&by_mass, d->eval, &d->part);
    if (closed) {
        const kmp_closer closer = kmp_saddle_closer(&by_mass, d->dx);
        memcpy(q, y, (size_t)d->n * sizeof *q);
        memcpy(qd, y + d->n, (size_t)d->n * sizeof *qd);
        closed = kmp_close_state(&closer, d->violation, t, q, qd);
    }
    kmp_saddle_free(&by_mass);
    kmp_eval_set_by_bodies(d->eval, true);
    return closed;
}

/* Closes a row's state to round-off; by the saddle program, then by the saddle system. false: it stays open. */
static bool close_row(projected *d, double t, const double *y, double *q, double *qd)
{
    size_t bytes = (size_t)d->n * sizeof *q;
    kmp_saddle_program_closing closing = {d->saddle_program, y + d->n};
    for (int attempt = applies(d) ? 0 : 1; attempt < 2; attempt++) {
        const kmp_closer closer =
            attempt == 0 ? kmp_saddle_program_closer(&closing, d->dx) : kmp_saddle_closer(&d->saddle, d->dx);
        memcpy(q, y, bytes);
        memcpy(qd, y + d->n, bytes);
        if (kmp_close_state(&closer, d->violation, t, q, qd)) {
            d->by_program = attempt == 0;
            d->by_mass = false;
            return true;
        }
    }
    d->by_program = false;
    d->by_mass = close_row_by_mass(d, t, y, q, qd);
    return d->by_mass;
}

/* Accelerations and multipliers of a row that close_row has closed. */
static void accelerate_row(projected *d, double t, const double *q, const double *qd, double *qdd, double *lambda)
{
    bool closed_by_program = d->by_program;
    const double *out = closed_by_program ? run_program(d, t, q, qd) : NULL;
    if (out) {
        const kmp_saddle_program_layout *layout = kmp_saddle_program_layout_of(d->saddle_program);
        memcpy(qdd, out + layout->qdd, (size_t)d->n * sizeof *qdd);
        memset(lambda, 0, (size_t)d->m * sizeof *lambda);
        for (int k = 0; k < layout->r; k++)
            lambda[d->part.rows[k]] = out[layout->lambda + k];
        return;
    }
    if (closed_by_program || d->by_mass)
        (void)factor_at(d, t, q, qd);
    else
        kmp_eval_bias(d->eval, qd);
    kmp_saddle_accelerations(&d->saddle, qdd, lambda);
}

/* Projects rows between steps too, to round-off. */
static int row(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    projected *d = (projected *)formulation;
    qd = qd ? qd : d->qd;
    if (!close_row(d, t, y, q, qd)) {
        kmp_text_printf(&formulation->reason, "the loops cannot be closed at the output time t = %.9g s", t);
        return KMP_HALT;
    }
    if (qdd)
        accelerate_row(d, t, q, qd, qdd, lambda);
    *work = d->has_work ? y[2 * d->n] : 0;
    return KMP_GO;
}

static void drop_nearby(projected *d)
{
    kmp_stage_lanes_free(&d->near);
    kmp_program_free(d->nearby);
    d->nearby = NULL;
    d->cycles_near = 0;
    d->of_run = NULL;
    d->is_near = false;
    d->sweeps = 0;
}

/* Makes the program of places nearby, if that is shorter enough. KMP_GO or KMP_HALT. */
static int make_nearby(projected *d)
{
    d->sweeps = LONG_MIN; /* once for a saddle program */
    if (kmp_saddle_program_write_nearby(d->saddle_program, &d->part, &d->nearby) != KEMPE_OK)
        return KMP_HALT;
    if (!d->nearby)
        return KMP_GO;
    double cycles = kmp_cycles_of_lanes(kmp_program_count(d->nearby, 1, 1), false);
    if (cycles <= NEARBY_WORTH * d->formulation.ode.cycles_of_lanes) {
        d->cycles_near = cycles;
        return kmp_stage_lanes_init(&d->near, d->nearby, d->eval) ? KMP_GO : KMP_HALT;
    }
    kmp_program_free(d->nearby);
    d->nearby = NULL;
    return KMP_GO;
}

/* Makes the saddle program for the charts at (t, q). KMP_GO or KMP_HALT. */
static int make_program(projected *d, double t, const double *q)
{
    drop_nearby(d);
    kmp_stage_lanes_free(&d->stages);
    kmp_saddle_program_free(d->saddle_program);
    d->saddle_program = NULL;
    d->by_program = false;
    kmp_eval_closure(d->eval, t, q);
    if (kmp_saddle_program_new(&d->saddle_program, d->eval, &d->part) != KEMPE_OK)
        return KMP_HALT;
    const kmp_program *program =
        d->lanes && d->saddle_program && !d->s->force ? kmp_saddle_program_code(d->saddle_program) : NULL;
    if (d->saddle_program)
        d->formulation.ode.cycles =
            kmp_cycles_of_one(kmp_saddle_program_count(d->saddle_program)) + (d->eval->nu ? kmp_cycles_of_passes() : 0);
    if (program)
        d->formulation.ode.cycles_of_lanes =
            kmp_cycles_of_lanes(kmp_saddle_program_count(d->saddle_program),
                                kmp_saddle_program_layout_of(d->saddle_program)->by_bodies) +
            (d->eval->nu ? kmp_cycles_of_passes_in_lanes() : 0);
    return kmp_stage_lanes_init(&d->stages, program, d->eval) ? KMP_GO : KMP_HALT;
}

/* Makes the saddle program from when on it pays. */
static int renew_program(projected *d, double t, const double *q)
{
    if (d->may_write && d->sweeps >= NEARBY_AFTER && make_nearby(d) != KMP_GO)
        return KMP_HALT;
    if (d->formulation.by_parts < d->due)
        return KMP_GO;
    d->due = LONG_MAX;
    return make_program(d, t, q);
}

/* Between steps. */
static int renew(kmp_formulation *formulation, double t, double *y, double *yp)
{
    (void)yp;
    return renew_program((projected *)formulation, t, y);
}

static int resume(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y, double *yp)
{
    projected *d = (projected *)formulation;
    if (formulation->rested) { /* what the last steps have shown was elsewhere */
        formulation->rested = false;
        d->cancelled = d->by_program = d->is_near = false;
        d->of_run = NULL;
        d->refused_h = d->noise = 0;
    }
    d->t = t;
    (void)yp;
    memcpy(y, q, (size_t)d->n * sizeof *y);
    memcpy(y + d->n, qd, (size_t)d->n * sizeof *y);
    return d->saddle_program && kmp_saddle_program_is_stale(d->saddle_program) ? make_program(d, t, q) : KMP_GO;
}

static void release(kmp_formulation *formulation)
{
    kmp_saddle_free(&((projected *)formulation)->saddle);
    drop_nearby((projected *)formulation);
    kmp_stage_lanes_free(&((projected *)formulation)->stages);
    kmp_saddle_program_free(((projected *)formulation)->saddle_program);
    kmp_partition_free(&((projected *)formulation)->part);
    kmp_formulation_free(formulation);
}

static kmp_formulation *create(const kmp_formulation_kind *kind, const kmp_formulation_start *start)
{
    projected *d = kmp_formulation_new(start, sizeof *d);
    if (!d)
        return NULL;
    int n = d->n = d->formulation.n;
    d->s = start->system;
    d->eval = start->eval;
    d->margin = start->margin;
    d->m = start->part->m;
    d->has_work = start->system->dissipative;
    d->tolerance = start->atol + start->rtol;
    d->t = start->t;
    d->rtol = start->rtol;
    d->rate_scale = start->rate_scale;
    (void)KMP_ARENA_MAKE(&d->formulation.arena, KMP_ROOM(double, d->m, &d->violation, &d->lambda),
                         KMP_ROOM(double, n, &d->dx, &d->q, &d->qd));
    kmp_formulation_make_unknowns(&d->formulation, 2 * n + d->has_work, false);
    d->formulation.part = &d->part;
    d->formulation.release = release;
    d->formulation.row = row;
    d->formulation.position = kmp_formulation_position_of_state;
    d->formulation.resume = resume;
    d->formulation.renew = renew;
    d->formulation.rests = true;
    d->formulation.ode =
        (kmp_ode){.n = d->formulation.size, .self = d, .rhs = rhs, .accept = accept, .closed = closed, .positions = n};
    d->lanes = start->lanes;
    d->may_write = !start->early;
    if (start->lanes) {
        d->formulation.ode.lanes = rhs_of_stages;
        d->formulation.ode.improve = improve_stages;
        d->formulation.ode.cycles_of_improve = &d->cycles_near;
        d->formulation.ode.width = KMP_STAGE_LANES;
        d->formulation.ode.quadratures = d->has_work;
    }
    bool made = !d->formulation.arena.failed && kmp_partition_copy(&d->part, start->part) &&
                (!start->lanes || !d->eval->nu ||
                 kmp_load_passes_init(&d->loads, &d->formulation.arena, d->s, &d->part, KMP_STAGE_LANES)) &&
                kmp_saddle_init(&d->saddle, d->eval, &d->part);
    /* By parts, accelerations are zero without rounding where friction by loads holds all coordinates. */
    const bool held = d->eval->nu && start->part->p == 0;
    bool solves = made && !held && kind != &kmp_formulation_near_singular;
    const kmp_program *program = kmp_eval_program(d->eval, d->eval->by_bodies);
    double operations = 0; /* of an evaluation without the saddle program */
    if (made)
        operations =
            (double)kmp_program_count(program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper + kmp_saddle_cost(&d->saddle);
    d->formulation.ode.cycles = kmp_cycles_by_parts(operations, d->eval->by_bodies);
    d->due = solves ? kmp_saddle_program_wait(d->eval, &d->part, operations, start->lanes) : LONG_MAX;
    if (start->early && d->due > 0 && d->due < LONG_MAX)
        d->due = 0;
    bool failed = !made || d->due < 0;
    if (!failed && d->due == 0 && !start->brief)
        failed = renew_program(d, start->t, start->q) != KMP_GO;
    if (failed) {
        (void)kmp_fail_memory(start->system->context);
        release(&d->formulation);
        return NULL;
    }
    kmp_formulation_begin_with_state(&d->formulation, start);
    if (d->has_work) {
        d->formulation.y[2 * n] = start->work;
        d->formulation.atol[2 * n] = KMP_UNCONTROLLED;
    }
    return &d->formulation;
}

const kmp_formulation_kind kmp_formulation_projected = {.formulation = "projected",
                                                        .form = "none",
                                                        .standard = true,
                                                        .corrected = true,
                                                        .by_bodies = true,
                                                        .by_products = true,
                                                        .in_lanes = true,
                                                        .lanes_first = true,
                                                        .create = create};

/* Uses M and C: the equations of articulated bodies have the square of J's condition. */
const kmp_formulation_kind kmp_formulation_near_singular = {
    .formulation = "near_singular", .form = "none", .corrected = true, .create = create};
