/* SPDX-License-Identifier: BSD-3-Clause */
/* Limit cycles: the motion over a period with its derivatives, Newton's method for a cycle, and the branch that it is
 * on. */
#include "analyses/limit_cycles/cycle_branch.h"
#include "analyses/dense/eigenvalues.h"
#include "analyses/limit_cycles/cycle_extremes.h"
#include "analyses/parts/ranges.h"
#include "analyses/sensitivity/sensitivity_trajectory.h"
#include "base/arena.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/tolerances.h"
#include "model/data/body.h"
#include "model/data/state.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* -- a motion over a time -------------------------------------------------------------------------------- */

/* -- construction ------------------------------------------------------------------------------------ */

const char *const kmp_flow_kinds[] = {"q", "qd", "state"};

const char *kmp_flow_name(const kempe_model *model, const kmp_flow_entry *entry)
{
    return entry->kind == KMP_FLOW_STATE ? kmp_state_of(model, entry->motion)->name
                                         : kmp_model_motion(model, entry->motion)->name;
}

static bool make_room(kmp_flow *f)
{
    int n = f->size;
    return KMP_ARENA_MAKE(
        &f->arena, KMP_ROOM(kmp_flow_entry, n, &f->entry), KMP_ROOM(double, n + 1, &f->values, &f->sizes),
        KMP_ROOM(double, n, &f->begin, &f->end, &f->begin_rate, &f->end_rate),
        KMP_ROOM(double, n *(n + 1), &f->slope, &f->monodromy), KMP_ROOM(double, KMP_FLOW_PIECES + 1, &f->times),
        KMP_ROOM(double, n *(KMP_FLOW_PIECES + 1), &f->history));
}

static double value_of(const kmp_flow_entry *e, const double *q, const double *qd)
{
    return (e->kind == KMP_FLOW_POSITION ? q : qd)[e->motion];
}

/* The state of a row, and at both ends also its rates and derivatives. */
static int take_row(void *user, const kmp_sensitivity_equations_row *row)
{
    kmp_flow *f = user;
    const int n = f->size, systems = f->rows->system->n, at = f->row++;
    if (at > f->pieces)
        return 0;
    bool first = at == 0, last = at == f->pieces;
    for (int i = 0; i < n; i++) {
        const kmp_flow_entry *e = &f->entry[i];
        double x = value_of(e, row->q, row->qd), rate = value_of(e, row->qd, row->qdd);
        f->history[i + (ptrdiff_t)at * n] = x;
        if (first)
            f->begin[i] = x, f->begin_rate[i] = rate;
        if (last)
            f->end[i] = x, f->end_rate[i] = rate;
        for (int k = 0; (first || last) && k <= n; k++) {
            double slope = value_of(e, row->dq + (ptrdiff_t)k * systems, row->dqd + (ptrdiff_t)k * systems);
            double *sum = &f->slope[i + (ptrdiff_t)k * n];
            *sum = first ? -slope : *sum + slope;
            if (last && k < n)
                f->monodromy[i + (ptrdiff_t)k * n] = slope;
        }
    }
    return 0;
}

static kempe_status make_runs(kmp_flow *f, const char *name, const char *outputs, const kempe_run_options *run)
{
    kmp_text names = {0};
    for (int i = 0; i < f->size; i++)
        kmp_text_printf(&names, "%s.%s,", kmp_flow_kinds[f->entry[i].kind],
                        kmp_flow_name(f->system->model, &f->entry[i]));
    kmp_text_put(&names, name);
    for (int k = 0; k <= KMP_FLOW_PIECES; k++)
        f->times[k] = (double)k / KMP_FLOW_PIECES;
    kempe_run_options own = *run;
    own.rtol = f->rtol;
    const kempe_sensitivity_options ask = {.parameters = names.s, .outputs = outputs, .run = &own};
    kempe_status status =
        names.failed ? kmp_fail_memory(f->context)
                     : kmp_slope_runs_new(f->system->model, &ask, KMP_FLOW_PIECES + 1, f->times, false, &f->runs);
    kmp_text_free(&names);
    return status;
}

kempe_status kmp_flow_new(const kempe_system *system, const char *name, const char *outputs,
                          const kempe_run_options *run, int size, const kmp_flow_entry *entry, kmp_flow **flow)
{
    KMP_MAKE(system->context, kmp_flow, f);
    *f = (kmp_flow){.context = system->context, .system = system, .size = size, .pieces = 1};
    f->rtol = run->rtol > 0 ? run->rtol : KMP_CYCLE_RTOL;
    kempe_status status = kmp_made(system->context, make_room(f));
    if (status == KEMPE_OK) {
        memcpy(f->entry, entry, (size_t)size * sizeof *entry);
        status = make_runs(f, name, outputs, run);
    }
    if (status == KEMPE_OK) {
        f->rows = kmp_slope_runs_rows(f->runs);
        kmp_slope_runs_watch(f->runs, take_row, f);
        kmp_slope_runs_keep_length(f->runs, system->length);
    }
    return KMP_GIVE_OR_FREE(status, flow, f, kmp_flow_free);
}

KMP_FREES(kmp_flow, flow, kmp_slope_runs_free(flow->runs), kmp_arena_free(&flow->arena))

/* -- a run -------------------------------------------------------------------------------------------- */

/* The largest of sizes of start values of a kind, over the sizes of their motions. */
static double largest_of(const kmp_flow *flow, const double *sizes, kmp_flow_kind kind)
{
    double most = 0;
    for (int i = 0; i < flow->size; i++)
        if (flow->entry[i].kind == kind)
            most = fmax(most, sizes[i] / flow->system->scale[flow->entry[i].motion]);
    return most;
}

/* Sets absolute tolerances by the sizes of the state (size) and of the parameter. */
static void weigh_flow(kmp_flow *f, const double *sizes, double parameter)
{
    double largest = fmax(largest_of(f, sizes, KMP_FLOW_POSITION), largest_of(f, sizes, KMP_FLOW_STATE));
    memcpy(f->sizes, sizes, (size_t)f->size * sizeof *sizes);
    f->sizes[f->size] = parameter;
    kmp_slope_runs_weigh(f->runs, f->rtol * (largest > 0 ? largest : 1), f->sizes);
}

kempe_status kmp_flow_run(kmp_flow *f, const double *x, double value, int pieces)
{
    memcpy(f->values, x, (size_t)f->size * sizeof *x);
    f->values[f->size] = value;
    f->row = 0;
    f->pieces = pieces;
    kmp_slope_runs_set_times(f->runs, pieces + 1, f->times);
    return kmp_slope_runs_at(f->runs, f->values);
}

/* Runs over a time from x (size) with a value of the parameter, in a number of pieces, 1 to KMP_FLOW_PIECES.
 * KEMPE_E_FAILED with its reason, KEMPE_STOPPED. */
static kempe_status run_flow(kmp_flow *f, const double *x, double time, double value, int pieces)
{
    for (int k = 0; k <= pieces; k++)
        f->times[k] = k == pieces ? time : time * k / pieces;
    return kmp_flow_run(f, x, value, pieces);
}

/* -- shooting -------------------------------------------------------------------------------------------- */

enum { MOST_CORRECTIONS = 10 };

/* A correction of this number of sizes leads to another cycle, or nowhere. */
#define FAR 1.0
/* Corrections that grow by more do not converge. */
#define GROWS 2.0

bool kmp_cycles_stable_between(const kmp_cycle *a, const kmp_cycle *b)
{
    bool one = a->stability == KMP_CYCLE_STABLE || b->stability == KMP_CYCLE_STABLE;
    return one && (a->stability == KMP_CYCLE_STABLE || a->word != KMP_CYCLE_REGULAR) &&
           (b->stability == KMP_CYCLE_STABLE || b->word != KMP_CYCLE_REGULAR);
}

const char *kmp_cycle_stability_text(const kmp_cycle *cycle)
{
    static const char *const words[] = {"stable", "unstable", "undecided"};
    return words[cycle->stability];
}

const char *kmp_cycle_text(const kmp_cycle *cycle)
{
    static const char *const words[] = {"", "Hopf", "fold", "doubling", "torus", "branching", "rest"};
    return words[cycle->word];
}

kempe_status kmp_shooting_init(kmp_shooting *s, kmp_flow *flow, int loads, const int *load, kmp_arena *cycles)
{
    int n = flow->size, w = n + 2;
    *s = (kmp_shooting){.flow = flow, .cycles = cycles, .size = n, .width = w, .loads = loads, .load = load};
    KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, w, &s->z, &s->scale, &s->span, &s->whole, &s->right),
                   KMP_ROOM(double, n, &s->reference, &s->direction, &s->re, &s->im),
                   KMP_ROOM(double, w *w, &s->matrix), KMP_ROOM(double, n *n, &s->copy),
                   KMP_ROOM(double, 4 * n * n, &s->vectors), KMP_ROOM(int, w, &s->pivot, &s->order));
    return kmp_made(flow->context, !s->arena.failed);
}

void kmp_shooting_free(kmp_shooting *shooting)
{
    kmp_arena_free(&shooting->arena);
}

/* -- sizes -------------------------------------------------------------------------------------------- */

void kmp_shooting_weigh(kmp_shooting *s, const double *x, const double *reach, double period, double parameter)
{
    double largest[3], motion;
    for (kmp_flow_kind kind = KMP_FLOW_POSITION; kind <= KMP_FLOW_STATE; kind++)
        largest[kind] = largest_of(s->flow, reach, kind);
    motion = fmax(largest[KMP_FLOW_POSITION], largest[KMP_FLOW_STATE]);
    for (int i = 0; i < s->size; i++) {
        const kmp_flow_entry *e = &s->flow->entry[i];
        double usual = e->kind == KMP_FLOW_RATE ? motion * 2 * acos(-1) / period : motion;
        double largest_here = fmax(largest[e->kind], usual) * s->flow->system->scale[e->motion], mean = fabs(x[i]);
        s->scale[i] = fmax(fmax(reach[i], KMP_CYCLE_STILL * largest_here), s->flow->rtol / KMP_CYCLE_CORRECTED * mean);
        s->span[i] = fmax(s->scale[i], KMP_CYCLE_RANGE * mean);
        s->whole[i] = fmax(s->span[i], largest_here);
    }
    s->scale[s->size] = s->span[s->size] = s->whole[s->size] = period;
    s->scale[s->size + 1] = s->span[s->size + 1] = s->whole[s->size + 1] = parameter;
    weigh_flow(s->flow, s->scale, parameter);
}

void kmp_shooting_refer(kmp_shooting *shooting, const double *x, const double *rate)
{
    memcpy(shooting->reference, x, (size_t)shooting->size * sizeof *x);
    memcpy(shooting->direction, rate, (size_t)shooting->size * sizeof *rate);
}

/* -- Newton's method ------------------------------------------------------------------------------------ */

/* The derivatives of all conditions, over the sizes, at the last run. */
static void fill_matrix(kmp_shooting *s, const double *border)
{
    const kmp_flow *f = s->flow;
    int n = s->size, w = s->width;
    for (int j = 0; j < w; j++) {
        double *column = s->matrix + (ptrdiff_t)j * w;
        for (int i = 0; i < n; i++)
            column[i] = (j == n  ? f->end_rate[i]
                         : j < n ? f->slope[i + (ptrdiff_t)j * n]
                                 : f->slope[i + (ptrdiff_t)n * n]) *
                        s->scale[j] / s->scale[i];
        column[n] = j < n ? s->direction[j] * s->scale[n] / s->scale[j] : 0;
        column[n + 1] = border[j] * s->scale[j] / s->span[j];
    }
}

static kempe_status fail_newton(const kmp_shooting *s, const char *why)
{
    return kmp_fail(s->flow->context, KEMPE_E_FAILED, "Newton's method finds no limit cycle near %.9g: %s",
                    s->z[s->width - 1], why);
}

/* A correction; *size: the largest part of it, *far: over the largest motions. */
static kempe_status correct_once(kmp_shooting *s, const double *guess, const double *border, double *size, double *far)
{
    KMP_TRY(run_flow(s->flow, s->z, s->z[s->size], s->z[s->size + 1], 1));
    fill_matrix(s, border);
    const kmp_flow *f = s->flow;
    int n = s->size;
    double phase = 0, beside = 0;
    for (int i = 0; i < n; i++) {
        s->right[i] = (f->begin[i] - f->end[i]) / s->scale[i];
        phase += s->direction[i] * s->scale[n] / s->scale[i] * (s->reference[i] - s->z[i]) / s->scale[i];
    }
    for (int j = 0; j < s->width; j++)
        beside += border[j] * (guess[j] - s->z[j]) / s->span[j];
    s->right[n] = phase;
    s->right[n + 1] = beside;
    if (kmp_lu_factor(s->width, s->matrix, s->pivot) != 0)
        return fail_newton(s, "its equations are singular");
    kmp_lu_solve(s->width, s->matrix, s->pivot, 1, s->right);
    *size = *far = 0;
    for (int j = 0; j < s->width; j++) {
        *size = fmax(*size, fabs(s->right[j]));
        *far = fmax(*far, fabs(s->right[j]) * s->scale[j] / s->whole[j]);
    }
    return isfinite(*size) ? KEMPE_OK : fail_newton(s, "a correction is not finite");
}

kempe_status kmp_shooting_correct(kmp_shooting *s, const double *guess, const double *border)
{
    double last = FAR, size = 0, far = 0;
    memcpy(s->z, guess, (size_t)s->width * sizeof *guess);
    for (s->iterations = 1; s->iterations <= MOST_CORRECTIONS; s->iterations++) {
        KMP_TRY(correct_once(s, guess, border, &size, &far));
        if (far > GROWS * last || far > FAR || s->right[s->size] < -0.5)
            return fail_newton(s, "its corrections grow");
        for (int j = 0; j < s->width; j++)
            s->z[j] += s->right[j] * s->scale[j];
        if (size <= KMP_CYCLE_CORRECTED)
            return KEMPE_OK;
        last = fmax(far, KMP_CYCLE_CORRECTED);
    }
    return fail_newton(s, "its corrections do not become small");
}

/* -- a cycle ------------------------------------------------------------------------------------------- */

kmp_cycle *kmp_shooting_room(kmp_shooting *s)
{
    int n = s->size, outputs = s->flow->rows->columns;
    kmp_cycle *c = KMP_ARENA_NEW(s->cycles, kmp_cycle, 1);
    return c && KMP_ARENA_MAKE(s->cycles, KMP_ROOM(double, n, &c->x, &c->rate, &c->re, &c->im, &c->reach),
                               KMP_ROOM(double, n + 2, &c->tangent), KMP_ROOM(double, outputs, &c->high, &c->low),
                               KMP_ROOM(double, s->loads, &c->load))
               ? c
               : NULL;
}

/* Means over the period; NaN where every other value has another mean, as with a motion faster than the values. */
static void take_loads(const kmp_shooting *s, kmp_cycle *c)
{
    const kempe_sensitivity *rows = s->flow->rows;
    int pieces = s->flow->pieces;
    for (int k = 0; k < s->loads; k++) {
        double even = 0, odd = 0, largest = 0;
        for (int row = 0; row + 1 < pieces; row += 2) {
            largest = fmax(largest, fabs(kmp_sensitivity_value(rows, row, s->load[k])));
            even += 2 * kmp_sensitivity_value(rows, row, s->load[k]) / pieces;
            odd += 2 * kmp_sensitivity_value(rows, row + 1, s->load[k]) / pieces;
        }
        c->load[k] = (even + odd) / 2;
        if (fabs(even - odd) > KMP_CYCLE_MEAN * (fabs(even) + fabs(odd)) + s->flow->rtol * largest)
            c->load[k] = NAN;
    }
}

/* Multipliers by their size, without the one nearest to 1; of a pair the one above the axis comes first. */
static kempe_status take_multipliers(kmp_shooting *s, kmp_cycle *c)
{
    int n = s->size, nearest = 0, taken = 0;
    double *v = s->vectors;
    memcpy(s->copy, s->flow->monodromy, (size_t)(n * n) * sizeof *s->copy);
    if (kmp_eigen_general(n, s->copy, s->re, s->im, v, v + n * n, v + 2 * n * n, v + 3 * n * n) != 0)
        return kmp_fail(s->flow->context, KEMPE_E_FAILED, "the multipliers of the cycle at %.9g are not found",
                        c->value);
    for (int i = 0; i < n; i++)
        if (hypot(s->re[i] - 1, s->im[i]) < hypot(s->re[nearest] - 1, s->im[nearest]))
            nearest = i;
    c->along = hypot(s->re[nearest] - 1, s->im[nearest]);
    for (int i = 0; i < n; i++) {
        int at = taken;
        if (i == nearest)
            continue;
        for (; at > 0 && hypot(s->re[i], s->im[i]) > hypot(c->re[at - 1], c->im[at - 1]); at--) {
            c->re[at] = c->re[at - 1];
            c->im[at] = c->im[at - 1];
        }
        c->re[at] = s->re[i];
        c->im[at] = s->im[i];
        taken++;
    }
    c->multipliers = taken;
    return KEMPE_OK;
}

/* The direction of the branch: along the conditions of a cycle, with `border` . tangent = 1 over the spans. */
static kempe_status take_tangent(kmp_shooting *s, const double *border, kmp_cycle *c)
{
    fill_matrix(s, border);
    if (kmp_lu_factor(s->width, s->matrix, s->pivot) != 0)
        return fail_newton(s, "the branch has no direction there");
    memset(s->right, 0, (size_t)s->width * sizeof *s->right);
    s->right[s->width - 1] = 1;
    kmp_lu_solve(s->width, s->matrix, s->pivot, 1, s->right);
    for (int j = 0; j < s->width; j++)
        c->tangent[j] = s->right[j] * s->scale[j];
    return KEMPE_OK;
}

kempe_status kmp_shooting_finish(kmp_shooting *s, const double *border, kmp_cycle **cycle)
{
    kmp_cycle *c = kmp_shooting_room(s);
    KMP_TRY(kmp_made(s->flow->context, c));
    KMP_TRY(run_flow(s->flow, s->z, s->z[s->size], s->z[s->size + 1], KMP_FLOW_PIECES));
    const kmp_flow *f = s->flow;
    int n = s->size;
    c->period = s->z[n];
    c->value = s->z[n + 1];
    for (int i = 0; i < n; i++) {
        double high = -INFINITY, low = INFINITY;
        for (int k = 0; k < f->pieces; k++) {
            high = fmax(high, f->history[i + (ptrdiff_t)k * n]);
            low = fmin(low, f->history[i + (ptrdiff_t)k * n]);
        }
        c->x[i] = f->begin[i];
        c->rate[i] = f->begin_rate[i];
        c->reach[i] = (high - low) / 2;
        c->residual = fmax(c->residual, fabs(f->end[i] - f->begin[i]) / s->scale[i]);
    }
    c->amplitude = fmax(largest_of(f, c->reach, KMP_FLOW_POSITION), largest_of(f, c->reach, KMP_FLOW_STATE));
    take_loads(s, c);
    KMP_TRY(take_multipliers(s, c));
    /* Multipliers on the circle, as far as they are known, decide nothing. */
    double noise = fmax(KMP_CYCLE_ON_CIRCLE, KMP_CYCLE_ERRORS * c->along);
    bool on_circle = false;
    for (int k = 0; k < c->multipliers; k++) {
        double size = hypot(c->re[k], c->im[k]);
        c->growing += size > 1;
        on_circle = on_circle || fabs(size - 1) <= noise;
    }
    bool grows = c->multipliers > 0 && hypot(c->re[0], c->im[0]) > 1 + noise;
    c->stability = grows ? KMP_CYCLE_UNSTABLE : on_circle ? KMP_CYCLE_UNDECIDED : KMP_CYCLE_STABLE;
    KMP_TRY(take_tangent(s, border, c));
    KMP_TRY(kmp_cycle_take_extremes(s, c));
    *cycle = c;
    return KEMPE_OK;
}

/* -- branches -------------------------------------------------------------------------------------------- */

enum { FEW_CORRECTIONS = 4, MOST_BISECTIONS = 40 };

typedef struct follower {
    kmp_shooting *s;
    const kmp_branch_options *options;
    kmp_cycle_branch *branch;
    kmp_arena arena;
    double *border, *guess; /* of the next cycle */
    double step;
    double range; /* size of the parameter */
} follower;

static kempe_context *context_of(const follower *f)
{
    return f->s->flow->context;
}

kempe_status kmp_branch_add(kempe_context *context, kmp_arena *arena, kmp_cycle_branch *branch, kmp_cycle *cycle)
{
    kmp_cycle **list = kmp_arena_room(arena, branch->cycle, branch->count, sizeof(kmp_cycle *));
    KMP_TRY(kmp_made(context, list));
    branch->cycle = list;
    branch->cycle[branch->count++] = cycle;
    return KEMPE_OK;
}

/* -- a step --------------------------------------------------------------------------------------------- */

/* Sizes and phase of a cycle; `border` becomes its tangent, of length 1 over the spans. */
static void stand_at(follower *f, const kmp_cycle *c)
{
    kmp_shooting *s = f->s;
    double length = 0;
    kmp_shooting_weigh(s, c->x, c->reach, c->period, f->range);
    kmp_shooting_refer(s, c->x, c->rate);
    for (int j = 0; j < s->width; j++) {
        f->border[j] = c->tangent[j] / s->span[j];
        length += f->border[j] * f->border[j];
    }
    for (int j = 0; j < s->width; j++)
        f->border[j] /= sqrt(length);
}

static double part_of(const kmp_shooting *s, const kmp_cycle *c, int j)
{
    return j < s->size ? c->x[j] : j == s->size ? c->period : c->value;
}

/* The cycle at a distance of `step` from c, with the sizes of c. */
static kempe_status step_from(follower *f, const kmp_cycle *c, double step, kmp_cycle **next)
{
    kmp_shooting *s = f->s;
    for (int j = 0; j < s->width; j++)
        f->guess[j] = part_of(s, c, j) + step * f->border[j] * s->span[j];
    KMP_TRY(kmp_shooting_correct(s, f->guess, f->border));
    return kmp_shooting_finish(s, f->border, next);
}

/* The angle between the branch at the last cycle and at the next one. */
static double angle_to(const follower *f, const kmp_cycle *next)
{
    double along = 0, length = 0;
    for (int j = 0; j < f->s->width; j++) {
        double x = next->tangent[j] / f->s->span[j];
        along += x * f->border[j];
        length += x * x;
    }
    return acos(fmin(1, along / sqrt(length)));
}

/* The distance of a cycle from its prediction, over the step. */
static double miss_of(const follower *f, const kmp_cycle *next, double step)
{
    double square = 0;
    for (int j = 0; j < f->s->width; j++) {
        double x = (part_of(f->s, next, j) - f->guess[j]) / f->s->span[j];
        square += x * x;
    }
    return sqrt(square) / step;
}

/* A multiplier passes the unit circle, beyond errors at one end at least. */
static bool changes(const kmp_cycle *a, const kmp_cycle *b)
{
    bool known = a->stability != KMP_CYCLE_UNDECIDED || b->stability != KMP_CYCLE_UNDECIDED;
    return a->multipliers > 0 && a->growing != b->growing && known;
}

/* True if a step leads along the branch, not to another one nearby. Near a fold the other part of a branch is as near,
 * and its cycles have another number of growing multipliers. */
static bool is_along(const follower *f, const kmp_cycle *c, const kmp_cycle *next, double step)
{
    return step <= KMP_CYCLE_CORNER ||
           (angle_to(f, next) <= KMP_CYCLE_ANGLE && miss_of(f, next, step) <= KMP_CYCLE_ANGLE &&
            (!changes(c, next) || step <= KMP_CYCLE_SURE));
}

/* The next cycle, with a step that is shortened where needed. KEMPE_E_FAILED: there is none. */
static kempe_status advance(follower *f, const kmp_cycle *c, kmp_cycle **next)
{
    stand_at(f, c);
    for (;;) {
        kempe_status status = step_from(f, c, f->step, next);
        if (status == KEMPE_OK && is_along(f, c, *next, f->step))
            return KEMPE_OK;
        if (status != KEMPE_OK && status != KEMPE_E_FAILED)
            return status;
        if (f->step <= KMP_CYCLE_SHORTEST)
            return KEMPE_E_FAILED;
        kmp_context_clear(context_of(f));
        f->step = fmax(f->step / 2, KMP_CYCLE_SHORTEST);
    }
}

/* -- special cycles ------------------------------------------------------------------------------------- */

static double climb(const kmp_shooting *s, const kmp_cycle *c)
{
    return c->tangent[s->width - 1];
}

/* The fold within a step of length `whole` from a to b, NULL: the searches on the way fail. */
static kempe_status find_fold(follower *f, const kmp_cycle *a, const kmp_cycle *b, double whole, kmp_cycle **fold)
{
    kmp_bracket search = kmp_bracket_of(0, climb(f->s, a), whole, climb(f->s, b));
    double at;
    *fold = NULL;
    stand_at(f, a);
    while (!kmp_interrupted(context_of(f)) && kmp_bracket_next(&search, KMP_CYCLE_LOCATED * whole, &at)) {
        kmp_cycle *c;
        kempe_status status = step_from(f, a, at, &c);
        if (status == KEMPE_E_FAILED) {
            kmp_context_clear(context_of(f));
            break;
        }
        KMP_TRY(status);
        kmp_bracket_take(&search, at, climb(f->s, c), climb(f->s, c) * climb(f->s, a) < 0);
        *fold = c;
    }
    if (*fold)
        (*fold)->word = KMP_CYCLE_FOLD;
    return KEMPE_OK;
}

/* The kind of a change of stability, by the multiplier nearest to the unit circle. */
static kmp_cycle_word word_of(const kmp_cycle *c)
{
    double least = INFINITY;
    kmp_cycle_word word = KMP_CYCLE_BRANCHING;
    for (int k = 0; k < c->multipliers; k++) {
        double away = fabs(hypot(c->re[k], c->im[k]) - 1);
        if (away >= least)
            continue;
        least = away;
        word = c->im[k] != 0 ? KMP_CYCLE_TORUS : c->re[k] < 0 ? KMP_CYCLE_DOUBLING : KMP_CYCLE_BRANCHING;
    }
    return word;
}

/* The place of a change of stability within a step, by bisection. */
static kempe_status find_change(follower *f, const kmp_cycle *a, double whole, kmp_cycle **change)
{
    double low = 0, high = whole;
    *change = NULL;
    stand_at(f, a);
    for (int k = 0; k < MOST_BISECTIONS && high - low > KMP_CYCLE_CHANGED * whole; k++) {
        kmp_cycle *c;
        kempe_status status = step_from(f, a, (low + high) / 2, &c);
        if (status == KEMPE_E_FAILED) {
            kmp_context_clear(context_of(f));
            break;
        }
        KMP_TRY(status);
        if (c->growing == a->growing)
            low = (low + high) / 2;
        else
            high = (low + high) / 2;
        *change = c;
    }
    if (*change)
        (*change)->word = word_of(*change);
    return KEMPE_OK;
}

/* -- requested values ----------------------------------------------------------------------------------- */

/* The cycle at a value of the parameter between the values of a and b. */
static kempe_status find_value(follower *f, const kmp_cycle *a, const kmp_cycle *b, double value, kmp_cycle **found)
{
    kmp_shooting *s = f->s;
    double part = (value - a->value) / (b->value - a->value);
    const kmp_cycle *nearest = part < 0.5 ? a : b;
    stand_at(f, nearest);
    for (int j = 0; j < s->width; j++) {
        f->guess[j] = part_of(s, a, j) + part * (part_of(s, b, j) - part_of(s, a, j));
        f->border[j] = j == s->width - 1;
    }
    KMP_TRY(kmp_shooting_correct(s, f->guess, f->border));
    KMP_TRY(kmp_shooting_finish(s, f->border, found));
    for (int j = 0; j < s->width && climb(s, a) < 0; j++)
        (*found)->tangent[j] = -(*found)->tangent[j];
    return KEMPE_OK;
}

/* Cycles at the requested values between a and b, where the parameter climbs or falls; a value without a cycle there
 * is left out. */
static kempe_status add_values(follower *f, const kmp_cycle *a, const kmp_cycle *b)
{
    bool along = (b->value > a->value) == (f->options->to > f->options->from);
    for (int i = 0; i < f->options->count; i++) {
        int k = along ? i : f->options->count - 1 - i;
        const kmp_range range = {.from = f->options->from, .to = f->options->to};
        double value = kmp_range_value(&range, k, f->options->count);
        kmp_cycle *found;
        if (!((value - a->value) * (value - b->value) < 0))
            continue;
        kempe_status status = find_value(f, a, b, value, &found);
        if (status == KEMPE_E_FAILED) {
            kmp_context_clear(context_of(f));
            continue;
        }
        KMP_TRY(status);
        KMP_TRY(kmp_branch_add(context_of(f), f->s->cycles, f->branch, found));
    }
    return KEMPE_OK;
}

static bool is_outside(const follower *f, double value)
{
    return (value - f->options->from) * (value - f->options->to) > 0;
}

/* -- the branch ------------------------------------------------------------------------------------------ */

/* True where the branch ends at b, after a. */
static bool ends(follower *f, const kmp_cycle *a, const kmp_cycle *b)
{
    kmp_cycle_branch *branch = f->branch;
    const kmp_cycle *first = branch->cycle[0];
    /* an error of the runs is one of growth over a period */
    double level = KMP_CYCLE_LEVEL * fabs(f->options->to - f->options->from) * fmax(1, first->period / b->period);
    branch->ends_at_hopf = b->amplitude < KMP_CYCLE_LAST * KMP_CYCLE_FIRST && b->amplitude < a->amplitude;
    if (is_outside(f, b->value))
        branch->end = kmp_arena_printf(f->s->cycles, "it reaches the end of the range");
    else if (branch->ends_at_hopf)
        branch->end = kmp_arena_printf(f->s->cycles, "its amplitude vanishes near %.6g", b->value);
    else if (first->word == KMP_CYCLE_HOPF && fabs(b->value - first->value) <= level &&
             b->amplitude > KMP_CYCLE_CENTRE * KMP_CYCLE_FIRST)
        branch->end = kmp_arena_printf(
            f->s->cycles,
            "all its cycles are at %.9g up to an amplitude of %.3g characteristic sizes, as in a conservative motion",
            b->value, b->amplitude);
    else if (branch->count >= f->options->most)
        branch->end = kmp_arena_printf(f->s->cycles, "it has %d cycles", branch->count);
    return branch->end;
}

/* A fold is one if the parameter differs from it on both sides: along cycles of a conservative motion it does not. */
static bool is_fold(const follower *f, const kmp_cycle *a, const kmp_cycle *fold, const kmp_cycle *b)
{
    double least = KMP_CYCLE_LEVEL * fabs(f->options->to - f->options->from);
    return fold && fabs(a->value - fold->value) > least && fabs(b->value - fold->value) > least;
}

static kempe_status follow(follower *f, kmp_cycle *first)
{
    kmp_cycle *at = first, *next;
    KMP_TRY(kmp_branch_add(context_of(f), f->s->cycles, f->branch, first));
    for (;;) {
        if (kmp_interrupted(context_of(f)))
            return KEMPE_STOPPED;
        kempe_status status = advance(f, at, &next);
        if (status == KEMPE_E_FAILED) {
            const char *why = kempe_context_message(context_of(f));
            f->branch->end = kmp_arena_printf(f->s->cycles, "it cannot be followed beyond %.6g%s%s", at->value,
                                              *why ? ": " : "", why);
            kmp_context_clear(context_of(f));
            return KEMPE_OK;
        }
        KMP_TRY(status);
        double whole = f->step;
        bool easy = f->s->iterations <= FEW_CORRECTIONS && angle_to(f, next) < KMP_CYCLE_ANGLE / 2;
        f->step = fmin(easy ? 1.5 * f->step : f->step, KMP_CYCLE_LONGEST);
        /* All that lies between a and the next cycle b, and b itself, unless the range ends before it. */
        kmp_cycle *special = NULL;
        bool folds = climb(f->s, at) * climb(f->s, next) < 0;
        if (folds)
            KMP_TRY(find_fold(f, at, next, whole, &special));
        else if (changes(at, next))
            KMP_TRY(find_change(f, at, whole, &special));
        special = folds && !is_fold(f, at, special, next) ? NULL : special;
        KMP_TRY(add_values(f, at, special && folds ? special : next));
        if (special)
            KMP_TRY(kmp_branch_add(context_of(f), f->s->cycles, f->branch, special));
        if (special && folds)
            KMP_TRY(add_values(f, special, next));
        if (!is_outside(f, next->value))
            KMP_TRY(kmp_branch_add(context_of(f), f->s->cycles, f->branch, next));
        kmp_progress(context_of(f), KMP_PROGRESS_STUDY, f->branch->count, f->options->most, "cycles");
        if (ends(f, at, next))
            return KEMPE_OK;
        at = next;
    }
}

kempe_status kmp_branch_follow(kmp_shooting *shooting, const kmp_branch_options *options, kmp_cycle *first,
                               kmp_cycle_branch *branch)
{
    follower f = {.s = shooting, .options = options, .branch = branch, .step = KMP_CYCLE_BEGIN};
    f.range = KMP_CYCLE_RANGE * fabs(options->to - options->from);
    KMP_ARENA_EACH(&f.arena, double, shooting->width, &f.border, &f.guess);
    kempe_status status = kmp_made(context_of(&f), !f.arena.failed);
    if (status == KEMPE_OK)
        status = follow(&f, first);
    kmp_arena_free(&f.arena);
    return status;
}
