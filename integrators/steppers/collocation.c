/* SPDX-License-Identifier: BSD-3-Clause */
/* Radau IIA with all stages of a step evaluated at once, in the lanes of vector registers: `radau` has 7 stages (order
 * 13) in 8 lanes or 4 stages (order 7) in 4 lanes, radau5 and radau9 have 3 and 5 for stiff motion. Error estimate of
 * the order of the stages, step control after Gustafsson, dense output from the stages (Hairer, Wanner, Solving
 * Ordinary Differential Equations II, 2nd ed., IV.5, IV.8).
 *
 * A one-step method: the formulation corrects y between steps. */
#include "integrators/steppers/collocation.h"
#include "integrators/decide/inlined.h"
#include "integrators/decide/step_control.h"
#include "integrators/steppers/collocation_newton.h"
#include "integrators/steppers/collocation_step.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* The choice of the iteration for the stages, from step to step: by contraction, and by the time simulated in a counted
 * processor cycle. */

/* Contraction of Picard's iteration that the next step aims at. */
static const double CONTRACTS = 0.3;
/* The next iteration is tried when the error permits steps WORTH times as long as this one for the cycles of a step,
 * SEVERAL times, which do not grow by HELD; Picard's returns when that contracts by EASY, SEVERAL times. A trial has
 * TRIAL steps. After one without success the next is twice as late. */
static const double WORTH = 1.3, EASY = 0.1, HELD = 1.2;
enum { SEVERAL = 3, TRIAL = 5, TRUST = 40, MOST_PATIENCE = 1000 };
/* Places are nearby where the first correction is less than this part of the values. */
static const double NEAR = 0.02;
/* Weight of the steps before in the pace of an iteration; steps longer by GROWS than the last one begin a new pace. The
 * costlier iteration must be BETTER: its longer steps have larger errors at the same tolerance. */
static const double FADES = 0.95, GROWS = 1.5, BETTER = 1.1;
/* Growth of the bound on steps after an iteration that failed; and where the iteration contracts by SURE. */
static const double RECOVERS = 1.1, RECOVERS_SURELY = 2, SURE = 0.01;
/* Cycles of an exact Jacobian over the cycles of an evaluation, about. */
static const double EXACT = 3;

bool kmp_collocation_in_lanes(const kmp_collocation *s)
{
    return s->base.ode.lanes && s->base.ode.width == s->w;
}

/* The program of all stages, and sums over the stages. */
double kmp_collocation_sweep_cost(const kmp_collocation *s)
{
    const kmp_ode *ode = &s->base.ode;
    bool lanes = kmp_collocation_in_lanes(s) && ode->cycles_of_lanes > 0;
    return (lanes ? ode->cycles_of_lanes : s->s * ode->cycles) + KMP_SWEEP_CYCLES_OF_UNKNOWN * (s->p + s->inner);
}

/* The next two are fitted to measured cycles of systems of 1 to 63 unknowns, 7 stages. */
double kmp_collocation_correction_cost(const kmp_collocation *s, kmp_iteration iteration)
{
    double n = s->inner, count = n * s->s, rows = n * s->w / 8;
    return iteration == KMP_ITERATION_PICARD   ? 0
           : iteration == KMP_ITERATION_NEWTON ? 60 + 8 * n * n + 8 * count
                                               : 60 + 3.4 * count * rows;
}

double kmp_collocation_matrix_cost(const kmp_collocation *s, kmp_iteration iteration)
{
    double n = s->inner, count = n * s->s, rows = n * s->w / 8;
    return iteration == KMP_ITERATION_PICARD   ? 0
           : iteration == KMP_ITERATION_NEWTON ? 500 + 10 * n * n + 1.7 * n * n * n
                                               : count * (100 + 21 * rows + 2.1 * count * rows);
}

double kmp_collocation_jacobian_cost(const kmp_collocation *s)
{
    double columns = ceil((s->p + s->inner) / (s->w - 1.0)), sweep = kmp_collocation_sweep_cost(s);
    return s->newton.whole ? sweep + EXACT * s->base.ode.cycles : columns * sweep;
}

/* -- choice -------------------------------------------------------------------------------------------- */

/* The length at which an iteration contracts well, from its contraction in a step h. */
static double length_of(const kmp_collocation *s, double h, double contraction)
{
    double fresh = s->iteration == KMP_ITERATION_NEWTON ? contraction / (2 * s->newton.age + 1) : contraction;
    bool measured = s->iteration != KMP_ITERATION_COUPLED && fresh > 0;
    return measured ? h * fmax(0.5, sqrt(CONTRACTS / fresh)) : INFINITY;
}

/* The longest step with a good contraction, by the one of a step h. With one Jacobian that is in proportion to the
 * longest way from there to a stage: half a step for a new one, a step more each time it is kept. */
static double collocation_longest(kmp_collocation *s, double h)
{
    double fresh =
        s->iteration == KMP_ITERATION_NEWTON ? s->past.contraction / (2 * s->newton.age + 1) : s->past.contraction;
    double most = length_of(s, h, s->past.contraction);
    if (s->past.ceiling > 0) {
        most = fmin(most, s->past.ceiling);
        s->past.ceiling *= fresh < SURE ? RECOVERS_SURELY : RECOVERS;
    }
    return most;
}

static void change_iteration(kmp_collocation *s, kmp_iteration to)
{
    s->iteration = to;
    s->choice.trial_steps = s->choice.limited = s->choice.free = 0;
    s->choice.trust = TRUST;
    s->past.ceiling = 0;
    s->newton.has_jacobian = s->newton.fresh = s->newton.factored = false;
}

void kmp_collocation_begin_with(kmp_collocation *s, kmp_iteration iteration)
{
    for (int k = 0; k < KMP_ITERATIONS; k++)
        s->choice.patience[k] = SEVERAL;
    s->choice.simulated[iteration] = s->choice.spent[iteration] = 0;
    change_iteration(s, iteration);
}

/* Tries an iteration, and judges the trial after some steps. */
static void try_iteration(kmp_collocation *s, kmp_iteration to)
{
    s->choice.before = s->iteration;
    change_iteration(s, to);
    s->choice.simulated[to] = s->choice.spent[to] = 0;
    s->choice.trial_steps = TRIAL;
}

/* True if the iteration simulates less time in a cycle than the other one did recently. */
static bool is_slower(const kmp_collocation *s, kmp_iteration other)
{
    double better = other > s->iteration ? 1 / BETTER : BETTER;
    return s->choice.simulated[s->iteration] * s->choice.spent[other] <
           better * s->choice.simulated[other] * s->choice.spent[s->iteration];
}

/* About the cycles of a step by an iteration, with as many sweeps as the last one. A trial of Newton's method keeps one
 * Jacobian; the matrices of each stage are not kept. */
static double step_cost(const kmp_collocation *s, kmp_iteration iteration)
{
    double sweep = kmp_collocation_sweep_cost(s), matrix = kmp_collocation_matrix_cost(s, iteration);
    double stages = KMP_STEP_CYCLES + s->base.ode.cycles_of_step +
                    s->sweeps * (sweep + kmp_collocation_correction_cost(s, iteration));
    double one = kmp_collocation_jacobian_cost(s), all = s->newton.whole ? s->s * one : (1 + s->p + s->inner) * sweep;
    return stages + (iteration == KMP_ITERATION_PICARD   ? 0
                     : iteration == KMP_ITERATION_NEWTON ? (one + matrix) / TRIAL
                                                         : all + matrix);
}

/* True if the next iteration exists and steps may be so much longer by the error that it may be worth its cost. */
static bool is_worth(const kmp_collocation *s, double by_error, double by_iteration)
{
    kmp_iteration next = s->iteration + 1;
    if (next == KMP_ITERATIONS || (next == KMP_ITERATION_COUPLED && !s->coupled.all))
        return false;
    return by_error * step_cost(s, s->iteration) > WORTH * by_iteration * step_cost(s, next);
}

/* Chooses the iteration of the next step, after one of length h that could be as long as `by_error` and
 * `by_iteration`. The next iteration is tried when this one has kept several steps far below the error's limit.
 * Picard's returns when it would contract well, one Jacobian for all stages after some time. */
static void collocation_choose(kmp_collocation *s, double h, double by_error, double by_iteration)
{
    /* Adds a step to the time simulated and the cycles spent of its iteration; the ones of steps before fade. */
    double *simulated = &s->choice.simulated[s->iteration], *spent = &s->choice.spent[s->iteration];
    s->base.cycles += KMP_STEP_CYCLES + s->base.ode.cycles_of_step;
    double fades = h > GROWS * s->past.h ? 0 : FADES;
    *simulated = fades * *simulated + h;
    *spent = fades * *spent + s->base.cycles - s->choice.cycles_before;
    s->choice.cycles_before = s->base.cycles;
    s->far -= s->far > 0;
    if (s->mixing.on)
        by_iteration = fmin(by_iteration, length_of(s, h, s->past.unmixed));
    bool held = by_iteration < HELD * h && is_worth(s, by_error, by_iteration);
    s->choice.limited = held ? s->choice.limited + 1 : 0;
    s->choice.free =
        s->iteration > s->method->cheapest && !s->newton.whole && s->choice.picard < EASY ? s->choice.free + 1 : 0;
    if (s->choice.trial_steps > 0 && --s->choice.trial_steps == 0 && is_slower(s, s->choice.before)) {
        /* Returns to the iteration before, whose next trial is later. */
        int *patience = &s->choice.patience[s->iteration];
        *patience = *patience < MOST_PATIENCE ? 2 * *patience : MOST_PATIENCE;
        change_iteration(s, s->choice.before);
        s->choice.trust = *patience * TRUST / SEVERAL;
    } else if (s->choice.trial_steps > 0) {
        return;
    } else if (s->choice.free >= SEVERAL) {
        kmp_collocation_begin_with(s, s->method->cheapest);
    } else if (s->iteration < KMP_ITERATION_COUPLED && s->choice.limited >= s->choice.patience[s->iteration + 1]) {
        try_iteration(s, s->iteration + 1);
    } else if (s->iteration == KMP_ITERATION_COUPLED && --s->choice.trust <= 0) {
        try_iteration(s, KMP_ITERATION_NEWTON);
    }
}

bool kmp_collocation_is_near(const kmp_collocation *s, double size)
{
    const kmp_ode *ode = &s->base.ode;
    bool can = ode->improve && *ode->cycles_of_improve > 0 && s->iteration != KMP_ITERATION_COUPLED;
    return can && s->far == 0 && kmp_collocation_in_lanes(s) && size * s->widen * s->base.tolerance.rtol < NEAR;
}

void kmp_collocation_go_far(kmp_collocation *s)
{
    s->farther = s->farther == 0 ? TRUST : s->farther < MOST_PATIENCE ? 2 * s->farther : MOST_PATIENCE;
    s->far = s->farther;
}

/* True if corrections with the present Jacobian cost less in the next step than a new one and its corrections. */
static bool collocation_keeps_jacobian(const kmp_collocation *s)
{
    double later = s->past.contraction * (2 * s->newton.age + 3) / (2 * s->newton.age + 1);
    if (!s->newton.has_jacobian || s->iteration != KMP_ITERATION_NEWTON || !(later < 1))
        return false;
    double sweep = kmp_collocation_sweep_cost(s);
    double more = s->past.contraction > 0 ? s->sweeps * (log(s->past.contraction) / log(later) - 1) : 0;
    return more * (sweep + kmp_collocation_correction_cost(s, KMP_ITERATION_NEWTON)) <
           kmp_collocation_jacobian_cost(s) + kmp_collocation_matrix_cost(s, KMP_ITERATION_NEWTON);
}

enum { MOST_SWEEPS = 16 };
/* The remainder of iterations where equations follow the motion, over the remainder where none do: these have the error
 * of the motion's stages times its growth. It takes less than one sweep, and leaves a tenth to a hundredth of the
 * error. */
static const double FOLLOWED = 0.03;

/* Safety, least and largest quotient of two steps. */
static const double SAFETY = 0.8, SHRINK = 0.2, GROW = 4;
/* Largest quotient of the next step with which step size and factors are kept. */
static const double KEEP_STEP = 1.2;
static const double OLD_ERROR_FLOOR = 1e-4;

/* -- creation ------------------------------------------------------------------------------------------ */

/* Lanes beyond the stages repeat the last one. */
static void set_constants(kmp_collocation *s)
{
    enum { E = KMP_COLLOCATION_EIGENVALUES };
    const kmp_collocation_table *t = s->table;
    static const double none[KMP_COLLOCATION_STAGES + 1] = {0};
    s->lanes.decay_power = log((2.0 * s->s - 1) / s->s) / log((s->s - 0.5) / (s->s - 2.5));
    for (int l = 0; l < s->w; l++) {
        int i = l < s->s ? l : s->s - 1;
        s->lanes.c[l] = t->node[i + 1];
        s->lanes.one[l] = 1;
        s->lanes.zero[l] = 0;
        s->lanes.filter[l] = l == KMP_END_SLOPE ? t->filter : 0;
        const double *legendre = l < KMP_COLLOCATION_DECAYS && l <= s->s ? t->legendre[s->s - l] : none;
        s->lanes.decay_start[l] = legendre[0];
        for (int j = 0; j < s->s; j++) {
            s->lanes.decay[j * s->w + l] = legendre[j + 1];
            s->lanes.a[j * s->w + l] = t->a[i][j];
            s->lanes.aa[j * s->w + l] = t->aa[i][j];
            s->lanes.end[j * s->w + l] = l < KMP_COLLOCATION_ENDS ? t->end[j][l] : 0;
        }
    }
    for (int j = 0; j < s->s; j++)
        for (int e = 0; e < E; e++) {
            s->newton.into[2 * E * j + e] = t->into_re[e][j];
            s->newton.into[2 * E * j + E + e] = t->into_im[e][j];
            s->newton.outof[2 * e * s->w + j] = t->outof_re[j][e];
            s->newton.outof[(2 * e + 1) * s->w + j] = t->outof_im[j][e];
        }
}

static void *create(const kmp_solver_kind *kind, const kmp_solver_setup *setup)
{
    kmp_collocation *s = kmp_solver_new(kind, setup, sizeof *s);
    if (!s)
        return NULL;
    const kmp_ode *ode = &s->base.ode;
    s->method = kind->method;
    s->w = s->method->stages > 0 ? (s->method->stages > 4 ? 8 : 4) : ode->lanes ? ode->width : 8;
    s->s = s->method->stages > 0 ? s->method->stages : s->w == 4 ? 4 : 7;
    s->n = ode->n;
    s->all_p = ode->positions;
    s->q = ode->quadratures;
    s->all = s->n - s->all_p - s->q;
    s->columns = kmp_collocation_in_lanes(s) ? ode->followers : 0;
    s->p = s->all_p / (1 + s->columns);
    s->inner = s->columns ? s->p : s->all;
    s->table = kmp_collocation_table_of(s->s);
    kmp_collocation_begin_with(s, s->method->cheapest);
    /* The estimate is of order s, dense output of order s + 1, and the ends of steps of order 2 s - 1: for errors in
     * proportion to rtol the estimate is compared with a power of rtol of the values. Iterations continue to `rest` of
     * rtol. */
    double rtol = s->method->part * pow(s->base.tolerance.rtol, s->method->power);
    s->widen = rtol / s->base.tolerance.rtol;
    double rest = s->method->rest / s->widen, least = 10 * DBL_EPSILON / rtol;
    s->limit = fmax(least, fmin(0.03, rest * (s->columns > 0 ? FOLLOWED : 1)));
    s->limit_of_columns = fmax(least, fmin(0.03, rest));
    s->most_sweeps = MOST_SWEEPS;
    int inner = s->all + s->q;
    kmp_arena *a = &s->base.arena;
    (void)KMP_ARENA_MAKE(a,
                         KMP_ROOM(double, s->n, &s->y, &s->y_old, &s->dy, &s->dy_new, &s->trial, &s->slope, &s->scale,
                                  &s->per_scale, &s->w_accept, &s->error, &s->fix, &s->slip),
                         KMP_ROOM(double, inner, &s->weight, &s->g_start, &s->g_start_old, &s->lead, &s->lead_old),
                         KMP_ROOM(double, (s->p + s->inner) * s->inner, &s->newton.jacobian),
                         KMP_ROOM(double, s->n, &s->newton.place), KMP_ROOM(int, s->inner, &s->newton.pivot));
    s->newton.whole = ode->jacobian && !s->columns ? KMP_ARENA_NEW(a, double, s->n * s->n) : NULL;
    struct {
        double **to;
        int size;
    } lanes[] = {{&s->g, inner},
                 {&s->g_old, inner},
                 {&s->stage, s->n},
                 {&s->f, s->n},
                 {&s->change, s->all},
                 {&s->g_before, s->all},
                 {&s->ends, s->all + s->q},
                 {&s->of_motion, s->columns ? 2 * s->p * s->p : 0},
                 {&s->of_parameters, s->columns * s->p},
                 {&s->lanes.at, 1},
                 {&s->lanes.once, s->s},
                 {&s->lanes.twice, s->s},
                 {&s->lanes.end, s->s},
                 {&s->lanes.one, 1},
                 {&s->lanes.zero, 1},
                 {&s->lanes.ahead, s->s + 1},
                 {&s->lanes.c, 1},
                 {&s->lanes.a, s->s},
                 {&s->lanes.aa, s->s},
                 {&s->lanes.hc, 1},
                 {&s->lanes.filter, 1},
                 {&s->lanes.decay, s->s},
                 {&s->lanes.decay_start, 1},
                 {&s->newton.outof, 2 * KMP_COLLOCATION_EIGENVALUES},
                 {&s->mixing.change, s->inner},
                 {&s->mixing.place, s->inner},
                 {&s->mixing.open, s->inner}};
    for (size_t k = 0; k < sizeof lanes / sizeof *lanes; k++)
        *lanes[k].to = kmp_arena_aligned(a, (size_t)lanes[k].size * (size_t)s->w);
    for (int k = 0; k < KMP_COLLOCATION_MIXED; k++) {
        s->mixing.by[k] = kmp_arena_aligned(a, (size_t)s->inner * (size_t)s->w);
        s->mixing.to[k] = kmp_arena_aligned(a, (size_t)s->inner * (size_t)s->w);
    }
    const size_t complex = 2 * KMP_COLLOCATION_EIGENVALUES; /* numbers of all eigenvalues */
    s->newton.lu = kmp_arena_aligned(a, complex * (size_t)s->inner * (size_t)s->inner);
    s->newton.z = kmp_arena_aligned(a, complex * (size_t)s->inner);
    s->newton.into = kmp_arena_aligned(a, complex * (size_t)s->s);
    if (kmp_collocation_allocate_coupled(s) && !a->failed)
        set_constants(s);
    return kmp_solver_made(s);
}

/* -- start --------------------------------------------------------------------------------------------- */

static void weigh(kmp_collocation *s)
{
    const double widen = s->widen, rtol = s->base.tolerance.rtol, *atol = s->base.tolerance.atol, *y = s->y;
    double *restrict scale = s->scale, *restrict per_scale = s->per_scale;
    for (int k = 0; k < s->n; k++) {
        scale[k] = widen * (atol[k] + rtol * fabs(y[k]));
        per_scale[k] = 1 / scale[k];
    }
}

static kempe_status start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    kmp_collocation *s = solver;
    (void)yp;
    kmp_solver_begin(&s->base, t, t_end, h0);
    s->first = true;
    s->rejected = s->has_step = s->collapsed = s->newton.has_jacobian = s->newton.fresh = s->newton.factored = false;
    s->choice.limited = s->choice.free = 0;
    s->past.ceiling = 0;
    s->choice.cycles_before = s->base.cycles;
    memcpy(s->y, y, (size_t)s->n * sizeof *y);
    int said = kmp_solver_call(&s->base, t, s->y, s->dy);
    if (said == KMP_GO && h0 == 0 && t_end > t) {
        weigh(s);
        said = kmp_solver_first_step(&s->base, s->s + 1, s->y, s->dy, s->scale, s->trial, s->slope);
    }
    return said == KMP_GO ? KEMPE_OK : KEMPE_E_FAILED;
}

/* -- one attempt --------------------------------------------------------------------------------------- */

/* dy_new at y_old: from the last stage, which is there, if the formulation requires it. */
static int slopes_at_end(kmp_collocation *s, double t)
{
    if (!s->base.ode.end || !kmp_collocation_in_lanes(s))
        return kmp_solver_call(&s->base, t, s->y_old, s->dy_new);
    s->base.work.rhs++;
    s->base.cycles += s->base.ode.cycles;
    memcpy(s->dy_new, s->y_old + s->all_p, (size_t)s->all_p * sizeof *s->dy_new);
    for (int k = 0; k < s->all; k++)
        s->dy_new[s->all_p + k] = s->g[k * s->w + s->s - 1];
    return s->base.ode.end(s->base.ode.self, t, s->y_old, s->dy_new);
}

/* Asks the formulation to accept the step's end, which is left in y_old, its derivative in dy_new. */
static kmp_collocation_outcome finish(kmp_collocation *s, double h, double t_new)
{
    kmp_collocation_end(s, h);
    const double rtol = s->base.tolerance.rtol, *atol = s->base.tolerance.atol, *y = s->y, *end = s->y_old;
    double *restrict fix = s->fix, *restrict weight = s->w_accept;
    for (int k = 0; k < s->n; k++) {
        const double before = fabs(y[k]), after = fabs(end[k]); /* no call of fmax for each of many unknowns */
        fix[k] = end[k];
        weight[k] = atol[k] + rtol * (after > before ? after : before);
    }
    int said = slopes_at_end(s, t_new);
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_COLLOCATION_BAD_STAGE : KMP_COLLOCATION_HALTED;
    if (s->base.ode.accept)
        said = s->base.ode.accept(s->base.ode.self, t_new, s->y_old, s->dy_new, s->w_accept);
    for (int k = 0; k < s->n; k++)
        s->fix[k] = s->y_old[k] - s->fix[k];
    return said == KMP_GO      ? KMP_COLLOCATION_TAKEN
           : said == KMP_RETRY ? KMP_COLLOCATION_BAD_STEP
                               : KMP_COLLOCATION_HALTED;
}

/* -- control ------------------------------------------------------------------------------------------- */

static double permitted(const kmp_collocation *s, double error)
{
    return SAFETY * pow(error, -1.0 / (s->s + 1));
}

static double after_error(double h, double permitted)
{
    return h * fmax(SHRINK, fmin(GROW, permitted));
}

/* -- end of a step ------------------------------------------------------------------------------------- */

static void take(kmp_collocation *s, double h, double t_new, double error)
{
    double by = permitted(s, error), next = after_error(h, by);
    /* Gustafsson's prediction, ACM TOMS 20 (1994) 496. */
    if (!s->first)
        next =
            fmin(next, after_error(h, SAFETY * h / s->past.h * pow(s->past.error / (error * error), 1.0 / (s->s + 1))));
    kmp_iteration iteration = s->iteration;
    double most = collocation_longest(s, h), by_error = h * by;
    /* The derivatives at the start of the step: the values of f; without the stiff part of their difference from the
     * stages' polynomial where Newton's method has solved for these. */
    bool newton = iteration != KMP_ITERATION_PICARD;
    memcpy(s->g_start, s->dy + s->all_p, (size_t)(s->all + s->q) * sizeof *s->dy);
    for (int k = 0; newton && k < s->all; k++) {
        double sum = s->error[s->all_p + k] / (h * s->table->filter);
        for (int j = 0; j < s->s; j++)
            sum += s->table->start[j] * s->g[k * s->w + j];
        s->g_start[k] = sum;
    }
    if (s->method->by_rates)
        memcpy(s->slip, s->error + s->all_p, (size_t)s->all_p * sizeof *s->slip);
    collocation_choose(s, h, by_error, most);
    next = s->iteration > iteration ? next : fmin(next, most);
    if (s->rejected)
        next = fmin(next, h);
    s->newton.has_jacobian = collocation_keeps_jacobian(s);
    s->newton.age++;
    s->newton.fresh = false;
    if (s->newton.has_jacobian && next >= h && next <= KEEP_STEP * h)
        next = h;
    s->base.work.steps++;
    s->base.stiff = iteration != KMP_ITERATION_PICARD;
    s->past.error = fmax(OLD_ERROR_FLOOR, error);
    s->past.h = h;
    kmp_solver_swap(&s->y, &s->y_old);
    kmp_solver_swap(&s->dy, &s->dy_new);
    kmp_solver_swap(&s->g, &s->g_old);
    kmp_solver_swap(&s->g_start, &s->g_start_old);
    kmp_solver_swap(&s->lead, &s->lead_old);
    s->has_step = true;
    s->first = s->rejected = false;
    s->taken = h;
    s->base.t = t_new;
    s->base.h = next;
}

static kempe_status step(void *solver)
{
    kmp_collocation *s = solver;
    if (!(s->base.t < s->base.t_end))
        return KEMPE_OK;
    weigh(s);
    for (int tries = 0; tries < KMP_STEP_ATTEMPTS; tries++) {
        double t_new, error = 0, shorter = 0.5, h = kmp_step_next(s->base.t, s->base.t_end, s->base.h, &t_new);
        if (!(h > 0) || s->collapsed)
            return KEMPE_E_FAILED;
        kmp_collocation_outcome what = kmp_collocation_find_stages(s, h, &error, &shorter);
        if (what == KMP_COLLOCATION_TAKEN)
            what = finish(s, h, t_new);
        if (what == KMP_COLLOCATION_HALTED)
            return KEMPE_E_FAILED;
        if (what == KMP_COLLOCATION_TAKEN) {
            s->collapsed = kmp_step_collapsed(&s->base.hopeless, h, t_new);
            s->base.t_old = s->base.t;
            take(s, h, t_new, error);
            return KEMPE_OK;
        }
        s->base.work.rejected += what == KMP_COLLOCATION_BAD_ERROR;
        s->base.work.refused += what != KMP_COLLOCATION_BAD_ERROR;
        s->base.h = what == KMP_COLLOCATION_BAD_ERROR       ? fmin(after_error(h, permitted(s, error)), 0.9 * h)
                    : what == KMP_COLLOCATION_BAD_ITERATION ? shorter * h
                    : what == KMP_COLLOCATION_BAD_STAGE     ? h / 4
                                                            : h / 2;
        if (what == KMP_COLLOCATION_BAD_ITERATION) {
            s->past.ceiling = s->base.h;
            s->newton.has_jacobian = s->newton.has_jacobian && s->newton.fresh;
        }
        s->rejected = true;
    }
    return KEMPE_E_FAILED;
}

/* Stages are predicted as at a start, since the stages of the step before are lost. */
static void undo(void *solver, double h)
{
    kmp_collocation *s = solver;
    if (!kmp_solver_take_back(&s->base, h))
        return;
    kmp_solver_swap(&s->y, &s->y_old);
    kmp_solver_swap(&s->dy, &s->dy_new);
    s->first = true;
    s->has_step = s->newton.has_jacobian = s->collapsed = false;
}

/* -- dense output -------------------------------------------------------------------------------------- */

/* start[k] weight[0] + sum of `stages` stages of the last step. */
KMP_INLINE double sum_of(const kmp_collocation *s, int stages, int k, const double *weight)
{
    const double *g = s->g_old + k * s->w;
    double sum = weight[0] * s->g_start_old[k];
    for (int j = 0; j < stages; j++)
        sum += weight[j + 1] * g[j];
    return sum;
}

/* Written out for the seven stages of lanes: each row of results needs it for each unknown. */
static double between(const kmp_collocation *s, int k, const double *weight)
{
    return s->s == KMP_COLLOCATION_STAGES ? sum_of(s, KMP_COLLOCATION_STAGES, k, weight) : sum_of(s, s->s, k, weight);
}

/* The polynomial through the derivatives at the start and the stages, integrated once or twice; the formulation's
 * correction belongs to its end. */
static kempe_status dense(void *solver, double t, double *y, double *yp)
{
    kmp_collocation *s = solver;
    double once[KMP_COLLOCATION_STAGES + 1], twice[KMP_COLLOCATION_STAGES + 1], h = s->taken;
    (void)yp;
    bool at_end = t == s->base.t || !(s->base.t > s->base.t_old); /* no step yet, or the last one failed */
    memcpy(y, at_end ? s->y : s->y_old, (size_t)s->n * sizeof *y);
    if (at_end || !(t > s->base.t_old))
        return KEMPE_OK;
    double x = (t - s->base.t_old) / h;
    kmp_collocation_integrals(s->table, x, once, twice);
    if (s->method->by_rates) {
        /* Weights of positions: the integral of the polynomial through the rates of the stages, which are h A g. */
        twice[0] = 0;
        for (int j = 0; j < s->s; j++) {
            twice[j + 1] = 0;
            for (int i = 0; i < s->s; i++)
                twice[j + 1] += once[i + 1] * s->table->a[i][j];
        }
    }
    for (int k = 0; k < s->all_p; k++)
        y[k] += h * (x * s->y_old[s->all_p + k] + once[0] * s->slip[k] + h * between(s, k, twice)) + x * s->fix[k];
    for (int k = s->all_p; k < s->n; k++)
        y[k] += h * between(s, k - s->all_p, once) + x * s->fix[k];
    return KEMPE_OK;
}

static void transfer(void *solver, kmp_number_stream *stream)
{
    kmp_collocation *s = solver;
    kmp_solver_transfer_times(&s->base, stream);
    kmp_stream_numbers(stream, 1, &s->taken);
    kmp_stream_numbers(stream, s->n, s->y);
    if (!(s->base.t > s->base.t_old))
        return;
    kmp_stream_numbers(stream, s->n, s->y_old);
    kmp_stream_numbers(stream, (s->all + s->q) * s->w, s->g_old);
    kmp_stream_numbers(stream, s->all + s->q, s->g_start_old);
    kmp_stream_numbers(stream, s->n, s->slip);
    kmp_stream_numbers(stream, s->n, s->fix);
}

#define KMP_COLLOCATION_FUNCTIONS                                                                                      \
    .corrects = true, .create = create, .release = kmp_solver_free, .start = start, .step = step, .undo = undo,        \
    .repeats = KMP_REPEATED_CONTACTS, .dense = dense, .transfer = transfer

/* Powers, and the remainder of an iteration over rtol: for radau found on the mechanisms of bench/collocation, where
 * errors anywhere in a run are about the errors of dop853; for the others the powers of Hairer's codes, and for radau5
 * the remainder of RADAU5. The ends of steps of radau9 are of order 9, and show a larger remainder. */
static const kmp_collocation_method
    ANY = {.cheapest = KMP_ITERATION_PICARD, .part = 1, .power = 0.8, .rest = 0.01},
    OF_3 =
        {.stages = 3, .cheapest = KMP_ITERATION_NEWTON, .part = 0.1, .power = 2. / 3, .rest = 0.03, .by_rates = true},
    OF_5 = {.stages = 5, .cheapest = KMP_ITERATION_NEWTON, .part = 0.1, .power = 0.6, .rest = 0.01, .by_rates = true};

const kmp_solver_kind kmp_solver_radau = {
    .name = "radau", .lanes = true, .standard = true, .method = &ANY, KMP_COLLOCATION_FUNCTIONS};
const kmp_solver_kind kmp_solver_radau5 = {
    .name = "radau5", .implicit = true, .method = &OF_3, KMP_COLLOCATION_FUNCTIONS};
const kmp_solver_kind kmp_solver_radau9 = {
    .name = "radau9", .implicit = true, .method = &OF_5, KMP_COLLOCATION_FUNCTIONS};
