/* SPDX-License-Identifier: BSD-3-Clause */
/* From a rounded drawing to a system: assemble, look whether closures are redundant but for rounding, find the nearest
 * mechanism in which they are exactly so, and derive its equations; or take the closures as written where rounding does
 * not explain their gaps. */
#include "constraints/inexact/nearest_exact.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/random_walk.h"
#include "constraints/closing/rounding.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/tolerances.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/program_cache.h"
#include "dynamics/system_record.h"
#include "linalg/dense/lapack.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "symbolic/live.h"
#include <float.h>
#include <kempe/check.h>
#include <kempe/settings.h>
#include <math.h>
#include <string.h>

/* Closures are redundant if w' h = 0 for all w of the left null space of J in all configurations. At many
 * configurations q_k, reached by finite motions, these are conditions on the numbers p of the drawing: the points and
 * axes around its loops. They are solved by the Gauss-Newton method,
 *
 *     (w_k' dh/dp) dp = -w_k' h(q_k, p),     dp of least norm,
 *
 * with q_k closed again on independent rows after each step: w_k' J = 0, so that changes of q_k do not count. dh/dp is
 * computed from differences between closures derived with shifted numbers. Of several ranks of the conditions the
 * largest one counts whose step reduces the misfit. Near an exact mechanism the misfit of some numbers is of second
 * order (a Sarrus linkage with nearly parallel axes): their derivatives are small, and vanish with the misfit. Zero
 * numbers stay zero. A drawing shows the mechanism assembled: if its start is closed but for the tolerance, h = 0 there
 * is a condition too, of all rows. */

enum { MOST_DECIMALS = 12, MOST_NUMBERS = 600, MOST_PLACES = 128, LEAST_PLACES = 12, PER_NUMBER = 4, STEPS = 24 };

/* A coordinate of a point or a length, a component of an axis, or a rotation of a frame about an axis of the frame. */
typedef struct quantity {
    kmp_number *scalar; /* NULL: the number belongs to an axis or a frame */
    double *axes;       /* the axis, or the frame row by row */
    bool frame;
    int k;           /* component of the axis; axis of rotation of the frame */
    double rounding; /* unit of its last digit in the drawing, scaled */
    kmp_number scalar_drawn;
    double axes_drawn[9];
    kmp_expr *sum; /* for a scalar with an expression: that expression plus the shift; in the model's arena */
} quantity;

/* -- numbers of the drawing ---------------------------------------------------------------------------- */

typedef struct listing {
    kempe_model *model;
    quantity *list;
    int count, most;
} listing;

static size_t axes_size(const quantity *n)
{
    return (n->frame ? 9 : 3) * sizeof *n->axes;
}

/* Adds a number; bodies and points that several loops share are listed once. */
static void add_quantity(listing *x, quantity n)
{
    for (int i = 0; i < x->count; i++)
        if (x->list[i].scalar == n.scalar && x->list[i].axes == n.axes && x->list[i].k == n.k)
            return;
    if (x->count == x->most)
        return;
    if (n.axes)
        memcpy(n.axes_drawn, n.axes, axes_size(&n));
    if (n.scalar)
        n.scalar_drawn = *n.scalar;
    if (n.scalar && n.scalar->expr)
        n.sum = KMP_ARENA_NEW(&x->model->arena, kmp_expr, 2);
    x->list[x->count++] = n;
}

static void add_scalar(listing *x, kmp_number *scalar)
{
    if (scalar->value != 0)
        add_quantity(x, (quantity){.scalar = scalar});
}

static void add_axis(listing *x, double axis[3])
{
    for (int k = 0; k < 3; k++)
        if (axis[k] != 0 && fabs(axis[k]) != 1)
            add_quantity(x, (quantity){.axes = axis, .k = k});
}

static void add_frame(listing *x, bool turned, double frame[3][3])
{
    for (int k = 0; turned && k < 3; k++)
        add_quantity(x, (quantity){.axes = &frame[0][0], .frame = true, .k = k});
}

static void add_point(listing *x, int point)
{
    if (point < 0)
        return;
    kmp_point *p = &x->model->points[point];
    for (int k = 0; k < 3; k++)
        add_scalar(x, p->station > 0 ? &p->offset[k] : &p->at[k]);
    add_frame(x, p->turned, p->axes);
}

/* Lists the numbers around the loops of a variant's model that are not zero, at most `most`. Returns their number; -1:
 * no memory. */
static int list_numbers(kempe_model *model, int most, quantity *list)
{
    listing x = {.model = model, .list = list, .most = most};
    for (int c = 0; c < model->closure_count; c++) {
        kmp_closure *closure = &model->closures[c];
        for (int k = 0; k < 2 && closure->point[0] >= 0 && closure->point[1] >= 0; k++) {
            add_point(&x, closure->point[k]);
            add_axis(&x, closure->axis[k]);
            /* The joints between the point's body and the ground. */
            int body = model->points[closure->point[k]].body;
            for (; body != 0; body = x.model->bodies[body].parent) {
                kmp_body *b = &x.model->bodies[body];
                add_point(&x, b->at);
                add_point(&x, b->to);
                add_frame(&x, b->turned, b->frame);
                for (int i = b->first_motion; i < b->first_motion + b->motion_count; i++)
                    add_axis(&x, x.model->motions[i].axis);
            }
        }
        if (!closure->function)
            add_scalar(&x, &closure->number);
    }
    return model->arena.failed ? -1 : x.count;
}

/* -- rounding ---------------------------------------------------------------------------------------- */

/* Returns the number of decimals that a value is written with; -1: more than a drawing has. */
static int decimals_of(double value)
{
    double tens = 1;
    for (int d = 0; d <= MOST_DECIMALS; d++, tens *= 10)
        if (fabs(value * tens - round(value * tens)) <= 8 * DBL_EPSILON * fabs(value * tens))
            return d;
    return -1;
}

/* Finds the rounding of each number. Numbers with more decimals than a drawing has were computed, at least in single
 * precision. The others have the decimals of most of them, since trailing zeros are not written. Axes lost their digits
 * when they were normalised, and take the digits of the lengths. Returns the unit of the last digit of most numbers,
 * scaled.
 */
static double find_rounding(quantity *list, int count, double length)
{
    int with[MOST_DECIMALS + 1] = {0}, some = 0, most = 0;
    const double computed = FLT_EPSILON;
    for (int i = 0; i < count; i++) {
        int d = list[i].scalar ? decimals_of(list[i].scalar->value) : -1;
        some += d > 0;
        with[d > 0 ? d : 0] += d > 0;
    }
    for (int below = 0; most < MOST_DECIMALS && 2 * (below + with[most]) <= some; most++)
        below += with[most];
    double unit = some > 0 ? pow(10, -most) / length : computed;
    for (int i = 0; i < count; i++) {
        const kmp_number *p = list[i].scalar;
        list[i].rounding = p && decimals_of(p->value) < 0 ? fmin(unit, computed) : unit;
    }
    return unit;
}

/* -- shifts ------------------------------------------------------------------------------------------ */

/* Shifts a scalar. If it has an expression, it is computed from that expression plus the shift when parameters vary. */
static void move_scalar(quantity *n, double by)
{
    n->scalar->value += by;
    if (!n->sum)
        return;
    n->sum[0] = (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = by};
    n->sum[1] = (kmp_expr){.kind = KMP_EXPR_ADD, .a = n->scalar_drawn.expr, .b = &n->sum[0]};
    n->scalar->expr = &n->sum[1];
}

static void move_axes(const quantity *n, double by)
{
    double *a = n->axes;
    if (n->frame) {
        /* The frame turns about its own axis k. */
        const int i = (n->k + 1) % 3, j = (n->k + 2) % 3;
        for (double *row = a; row < a + 9; row += 3) {
            const double before = row[i];
            row[i] = cos(by) * before + sin(by) * row[j];
            row[j] = cos(by) * row[j] - sin(by) * before;
        }
        return;
    }
    a[n->k] += by;
    double size = hypot(hypot(a[0], a[1]), a[2]);
    for (int k = 0; k < 3; k++)
        a[k] /= size;
}

/* Writes each number as drawn plus its shift into the model, whatever its parameters; shift NULL: as drawn. */
static void place_numbers(quantity *list, int count, const double *shift, double length)
{
    for (int i = 0; i < count; i++) {
        quantity *n = &list[i];
        if (n->scalar)
            *n->scalar = n->scalar_drawn;
        else
            memcpy(n->axes, n->axes_drawn, axes_size(n));
    }
    for (int i = 0; shift && i < count; i++)
        if (fabs(shift[i]) > KMP_MEND_NO_SHIFT && list[i].scalar)
            move_scalar(&list[i], shift[i] * length);
        else if (fabs(shift[i]) > KMP_MEND_NO_SHIFT)
            move_axes(&list[i], shift[i]);
}

/* -- the state of a search ----------------------------------------------------------------------------- */

/* Configurations closed on independent rows of one system, and their conditions. */
typedef struct survey {
    double *q;     /* n x (places + 1): the start comes last */
    double *rest;  /* conditions */
    double widest; /* redundant row */
    bool lags;     /* a place that does not count has followed the others, but not to the same accuracy */
} survey;

typedef struct search {
    const kempe_system *s;
    const kempe_assembly *a;
    kempe_model *model; /* holds the numbers */
    kmp_walk *walk;     /* of the drawing */
    quantity *number;
    int count;
    bool *excluded; /* m: rows of drives */
    int rank;       /* rank of the other rows */
    int left;       /* number of conditions at a place */
    int places;
    bool closed;     /* the start is a place, closed with the numbers as drawn: its m rows are conditions */
    int conditions;  /* of all places */
    double *w;       /* m x conditions */
    bool *counts;    /* places + 1 */
    double *drawn;   /* places + 1: the widest row of the drawing */
    double foreseen; /* misfit after a step, in the linear model, that may add more rows */
    bool strict;     /* a place that has followed the others counts */
    survey at, trial;
    kempe_system *system; /* with the numbers of `at`; NULL: as drawn */
    double *total, *goal; /* count: shifts of `at` and of `trial`, scaled */
    double *shift;        /* count: a step in units of the roundings */
    double *h;            /* rows of all places */
    double *matrix;       /* conditions x count */
} search;

static int all_places(const search *x)
{
    return x->places + x->closed;
}

/* -- conditions -------------------------------------------------------------------------------------- */

/* Writes w' h of the places that count to `out` (conditions). */
static void contract(const search *x, double *out)
{
    int m = x->s->m;
    for (int c = 0; c < x->conditions; c++) {
        int place = c < x->places * x->left ? c / x->left : x->places;
        const double *w = x->w + (size_t)c * (size_t)m, *h = x->h + (size_t)place * (size_t)m;
        out[c] = 0;
        for (int r = 0; x->counts[place] && r < m; r++)
            out[c] += w[r] * h[r];
    }
}

/* Adds scaled h of the model at all places, times the factor `times`, to x->h. */
static kempe_status add_closures(search *x, double times)
{
    const kmp_derivation_request scene = {.sets = KMP_SET_CLOSURE, .plain = true, .charted = true};
    const kempe_system *s = x->s;
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive_once(&eq, x->model, &scene));
    int m = s->m;
    double *value = KMP_GRAPH_NEW(eq.graph, double, kmp_graph_count(eq.graph));
    double *start = KMP_GRAPH_NEW(eq.graph, double, 1 + KMP_TIME_NUMBERS * x->model->input_count);
    uint8_t *live = KMP_GRAPH_NEW(eq.graph, uint8_t, kmp_graph_count(eq.graph)); /* of the rows of h, and zero */
    if (live) {
        live[kmp_id(KMP_ZERO)] = 1;
        kmp_live_mark(eq.graph, eq.m, eq.closures.h, live);
    }
    if (start)
        kmp_model_times(x->model, 0, start);
    for (int k = 0; value && start && live && k < all_places(x); k++) {
        const double *inputs[KMP_IN_COUNT] = {[KMP_IN_PARAMETER] = s->parameters,
                                              [KMP_IN_TIME] = start,
                                              [KMP_IN_Q] = x->at.q + (size_t)k * (size_t)s->n,
                                              [KMP_IN_CHART] = x->walk->eval->chart};
        kmp_graph_eval_live(eq.graph, inputs, live, value);
        /* Nodes that are the same for all q have their values from now on. */
        for (uint32_t id = 0; k == 0 && id < kmp_graph_count(eq.graph); id++)
            live[id] = live[id] && kmp_graph_node(eq.graph, id)->depends & 1u << KMP_IN_Q;
        for (int r = 0; r < m; r++) {
            int row = eq.closures.first[KMP_CLOSURE_ROWS * s->rows[r].closure + s->rows[r].component];
            kmp_ref h = row < 0 || x->excluded[r] ? KMP_ZERO : eq.closures.h[row];
            x->h[k * m + r] += (kmp_is_negative(h) ? -times : times) * value[kmp_id(h)] / s->row_scale[r];
        }
    }
    kempe_status status = value && start && live ? KEMPE_OK : KEMPE_E_MEMORY;
    kmp_equations_free(&eq);
    return status;
}

static kmp_walk *walk_of(const search *x, const kempe_system *s)
{
    kmp_walk *w = kmp_walk_new(s);
    if (!w)
        return NULL;
    w->rank = x->rank;
    w->excluded = x->excluded;
    if (x->a->chart)
        kmp_eval_set_charts(w->eval, x->a->chart);
    return w;
}

/* Closes the places of `at` again on independent rows of a system. false: no memory. */
static bool survey_place(search *x, const kempe_system *s, survey *at)
{
    size_t n = (size_t)s->n, m = (size_t)s->m;
    double open[MOST_PLACES + 1] = {0};
    kmp_walk *w = walk_of(x, s);
    for (int k = 0; w && k < all_places(x); k++) {
        double *q = at->q + (size_t)k * n;
        bool place = k < x->places, closed = !place || kmp_walk_close(w, q);
        if (place) {
            (void)kmp_walk_left(w, 0, x->rank);
            memcpy(x->w + (size_t)(k * x->left) * m, w->basis, m * (size_t)x->left * sizeof *x->w);
        } else {
            kmp_walk_evaluate(w, q);
        }
        memcpy(x->h + (size_t)k * m, w->h, m * sizeof *x->h);
        open[k] = closed ? kmp_rounding_opening(w, NULL) : INFINITY;
    }
    if (w) {
        /* Excludes places with rows much wider open than at most others (strict: and about as wide as in the drawing).
         * They are near a change point, or on another branch. */
        at->widest = 0;
        at->lags = false;
        int places = all_places(x);
        for (int k = 0; k < places; k++) {
            int narrower = 0;
            double followed = x->strict ? KMP_MEND_FOLLOWED * x->drawn[k] : 0;
            for (int i = 0; i < places; i++)
                narrower += !(open[k] <= fmax(KMP_MEND_WIDE * open[i], fmax(followed, KMP_MEND_STALLED)));
            x->counts[k] = narrower <= places / 2;
            at->widest = x->counts[k] ? fmax(at->widest, open[k]) : at->widest;
            at->lags = at->lags || (!x->counts[k] && open[k] <= KMP_MEND_FOLLOWED * x->drawn[k]);
        }
        x->counts[x->places] = true;
        if (s == x->s)
            for (int k = 0; k < all_places(x); k++)
                x->drawn[k] = isfinite(open[k]) ? open[k] : 0;
        contract(x, at->rest);
    }
    kmp_walk_free(w);
    return w;
}

/* -- steps ------------------------------------------------------------------------------------------- */

/* Returns the largest permitted shift of a number, scaled. */
static double farthest(const search *x, const quantity *n)
{
    if (x->s->model->closure_tolerance_given)
        return x->s->closure_tolerance / x->s->length;
    return fmax(KMP_MEND_DIGITS * n->rounding, n->scalar ? 0 : KMP_MEND_AXES);
}

/* Moves to the goal of a step if every number stays within the permitted shift and the misfit is reduced there.
 * KEMPE_E_INPUT: a closure has become invalid. */
static kempe_status try_goal(search *x, bool *reduced)
{
    kempe_system *s = NULL;
    bool near = true;
    for (int i = 0; i < x->count; i++) {
        x->goal[i] = x->total[i] - x->shift[i] * x->number[i].rounding;
        near = near && fabs(x->goal[i]) <= farthest(x, &x->number[i]);
    }
    if (!near)
        return KEMPE_OK;
    place_numbers(x->number, x->count, x->goal, x->s->length);
    kempe_status status = kmp_system_of_closures(x->model, &s);
    if (status != KEMPE_OK)
        return status;
    memcpy(x->trial.q, x->at.q, (size_t)(x->s->n * (x->places + 1)) * sizeof *x->at.q);
    x->trial.widest = s->m < x->s->m ? 0 : INFINITY; /* rows have become exactly zero: the assembly decides */
    if (s->m == x->s->m && !survey_place(x, s, &x->trial))
        status = KEMPE_E_MEMORY;
    if (s->m > x->s->m) {
        /* Axes that are parallel as drawn have turned apart: the largest condition after the step, in the linear
         * model. */
        double most = 0;
        for (int c = 0; c < x->conditions; c++) {
            double left = x->at.rest[c];
            for (int i = 0; i < x->count; i++)
                left -= x->matrix[(size_t)c + (size_t)i * (size_t)x->conditions] * x->shift[i];
            most = fmax(most, fabs(left));
        }
        x->foreseen = fmin(x->foreseen, most);
    }
    *reduced = status == KEMPE_OK && x->trial.widest < KMP_MEND_REDUCED * x->at.widest;
    if (*reduced) {
        survey was = x->at;
        x->at = x->trial;
        x->trial = was;
        memcpy(x->total, x->goal, (size_t)x->count * sizeof *x->total);
        kempe_system_free(x->system);
        x->system = s;
        return KEMPE_OK;
    }
    kempe_system_free(s);
    return status;
}

/* The error of the left null spaces is the widest row, more where pivots are small. Directions of the conditions below
 * that error are left to the next step. If a step goes too far or fails, more directions are left. */
static kempe_status step(search *x, bool *reduced)
{
    double widest = x->at.widest;
    /* Computes derivatives of the conditions by the shift of each number in units of its rounding: a step of least norm
     * then weights all numbers equally. */
    kempe_status status = KEMPE_OK;
    for (int i = 0; status == KEMPE_OK && i < x->count; i++) {
        double drawn = x->total[i];
        memset(x->h, 0, (size_t)(all_places(x) * x->s->m) * sizeof *x->h);
        for (int side = 1; status == KEMPE_OK && side >= -1; side -= 2) {
            x->total[i] = drawn + side * KMP_MEND_DIFFERENCE;
            place_numbers(x->number, x->count, x->total, x->s->length);
            status = add_closures(x, side / (2 * KMP_MEND_DIFFERENCE) * x->number[i].rounding);
        }
        x->total[i] = drawn;
        contract(x, x->matrix + (size_t)i * (size_t)x->conditions);
    }
    *reduced = false;
    double rank = fmin(fmax(KMP_MEND_RANK, KMP_MEND_OFF * widest), KMP_MEND_MOST_RANK);
    while (rank <= KMP_MEND_MOST_RANK && !*reduced && status == KEMPE_OK) {
        if (kmp_least_squares(x->conditions, x->count, x->matrix, x->at.rest, rank, x->shift) < 0)
            return KEMPE_E_MEMORY;
        status = try_goal(x, reduced);
        rank *= 10;
    }
    return status;
}

/* True if the mechanism closes, no row remains open, and none opens on the path to most other places. */
static bool is_whole(const kempe_system *s, int rank)
{
    kempe_assembly *a = NULL;
    kmp_rounding_trial trial = {.rank = rank, .tolerance = KMP_CLOSED_DROPPED};
    bool whole = kmp_assemble_start(s, &a) == KEMPE_OK && a->closed && !kmp_rounding_of(s);
    if (whole) {
        trial.dropped = a->dropped;
        whole = kmp_rounding_try(&trial, s, a->inner_q ? a->inner_q : a->q, a->chart) && trial.holds;
    }
    kempe_assembly_free(a);
    return whole;
}

/* -- the search -------------------------------------------------------------------------------------- */

static bool begin_search(search *x, kmp_arena *arena)
{
    const kempe_system *s = x->s;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(bool, s->m, &x->excluded), KMP_ROOM(bool, MOST_PLACES + 1, &x->counts),
                        KMP_ROOM(quantity, MOST_NUMBERS, &x->number)))
        return false;
    x->rank = s->rounding->rank - kmp_rounding_drives(s, x->a->dropped, x->excluded);
    x->left = s->m - x->rank;
    x->count = list_numbers(x->model, MOST_NUMBERS, x->number);
    ptrdiff_t places = MOST_PLACES + 1, conditions = MOST_PLACES * x->left + s->m;
    x->walk = walk_of(x, s);
    if (x->count < 0 || !x->walk)
        return false;
    KMP_ARENA_MAKE(arena, KMP_ROOM(double, conditions * s->m, &x->w), KMP_ROOM(double, places * s->m, &x->h),
                   KMP_ROOM(double, conditions * x->count, &x->matrix), KMP_ROOM(double, places, &x->drawn),
                   KMP_ROOM(double, places * s->n, &x->at.q, &x->trial.q),
                   KMP_ROOM(double, conditions, &x->at.rest, &x->trial.rest));
    if (!KMP_ARENA_EACH(arena, double, x->count, &x->total, &x->goal, &x->shift))
        return false;
    /* Places of the loops' motion, the last one at the model's start. */
    kmp_waypoint place[MOST_PLACES];
    int wanted = LEAST_PLACES + PER_NUMBER * x->count / x->left;
    memcpy(x->at.q, x->a->inner_q ? x->a->inner_q : x->a->q, (size_t)s->n * sizeof *x->at.q);
    x->places =
        kmp_rounding_waypoints(x->walk, NULL, wanted < MOST_PLACES ? wanted : MOST_PLACES, INFINITY, x->at.q, place);
    double *start = x->at.q + (size_t)x->places * (size_t)s->n;
    for (int i = 0; i < s->n; i++)
        start[i] = s->model->start.q[i].value;
    kmp_walk_evaluate(x->walk, start);
    x->closed = !x->a->chart && kmp_rounding_opening(x->walk, NULL) * s->length <= s->closure_tolerance;
    x->conditions = x->places * x->left + (x->closed ? s->m : 0);
    for (int r = 0; r < s->m; r++)
        x->w[(x->places * x->left + r) * s->m + r] = 1;
    return survey_place(x, s, &x->at);
}

/* Shifts the numbers of the variant if there is an exact mechanism. Its model belongs to a rounded system, has the
 * closures only, or is equal to it; `a` is the system's assembly. *by: the largest shift, scaled. KEMPE_E_MEMORY. */
static kempe_status exact_find(const kempe_system *s, const kempe_assembly *a, kmp_variant *variant,
                               kmp_drawn_model *found, double *by)
{
    /* Numbers of flexible bodies are not among the numbers that may be rounded. */
    bool explained = s->model->closure_tolerance_given || s->model->flexible_count > 0,
         exact = false; /* or there are too many numbers to decide */
    kempe_status status = KEMPE_OK;
    for (int strict = 0; strict < 2 && status != KEMPE_E_MEMORY && !exact; strict++) {
        search x = {.s = s, .a = a, .model = kmp_variant_model(variant), .strict = strict, .foreseen = INFINITY};
        kmp_arena arena = {0};
        status = begin_search(&x, &arena) ? KEMPE_OK : KEMPE_E_MEMORY;
        double drawn = x.at.widest, unit = find_rounding(x.number, x.count, s->length);
        bool reduced = x.count > 0;
        for (int k = 0; k < STEPS && reduced && status == KEMPE_OK && x.at.widest > KMP_MEND_MET; k++)
            status = step(&x, &reduced);
        exact = status != KEMPE_E_MEMORY && x.system && x.at.widest <= KMP_MEND_STALLED && !x.at.lags &&
                is_whole(x.system, s->rounding->rank);
        explained = explained || x.count == MOST_NUMBERS ||
                    fmin(x.at.widest, x.foreseen) <= fmax(KMP_MEND_EXPLAINED * drawn, unit * unit);
        *by = 0;
        for (int i = 0; exact && i < x.count; i++)
            *by = fmax(*by, fabs(x.total[i]));
        place_numbers(x.number, x.count, exact ? x.total : NULL, s->length);
        kempe_system_free(x.system);
        kmp_walk_free(x.walk);
        kmp_arena_free(&arena);
        kmp_context_clear(s->context);
    }
    *found = exact ? KMP_DRAWING_EXACT : explained ? KMP_DRAWING_OPEN : KMP_DRAWING_UNEXPLAINED;
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(s->context) : KEMPE_OK;
}

/* Bounds for the search: in larger models closures that are redundant but for rounding stay open. */
enum { MOST_COORDINATES = 100, MOST_ROWS = 200 };

/* Only the closures of a model, assembled, and the exact mechanism of the drawing. */
typedef struct meaning {
    kempe_system *closures;
    kempe_assembly *a;
    bool rounded;
    kmp_drawn_model drawing;
    kmp_variant *variant; /* its model has the numbers of an exact mechanism */
    double by;            /* the largest shift, scaled */
} meaning;

/* Assembles at the start; *rounded: closures are redundant but for rounding of the model's numbers. */
static kempe_status assemble_first(kempe_system *s, kempe_assembly **a, bool *rounded)
{
    bool looked = s->m > 0 && s->closure_tolerance > 0;
    kempe_status status = looked ? kmp_assemble_start(s, a) : KEMPE_OK;
    *rounded = looked && status == KEMPE_OK && (*a)->closed && kmp_rounding_of(s);
    kmp_context_clear(s->context);
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(s->context) : KEMPE_OK;
}

/* Looks for an exact mechanism if the closures are rounded and not too many. `given`: the variant that owns the model,
 * NULL: one is made. */
static kempe_status find_meaning(const kempe_model *model, kmp_variant *given, meaning *x)
{
    *x = (meaning){.variant = given};
    KMP_TRY(kmp_system_of_closures(model, &x->closures));
    KMP_TRY(assemble_first(x->closures, &x->a, &x->rounded));
    if (!x->rounded || x->closures->n > MOST_COORDINATES || x->closures->m > MOST_ROWS)
        return KEMPE_OK;
    if (!given)
        KMP_TRY(kmp_variant_new(model, 0, NULL, &x->variant));
    return exact_find(x->closures, x->a, x->variant, &x->drawing, &x->by);
}

/* Frees all except the given variant. */
static void end_meaning(meaning *x, const kmp_variant *given)
{
    if (x->variant != given)
        kmp_variant_free(x->variant);
    kempe_assembly_free(x->a);
    kempe_system_free(x->closures);
}

kempe_status kmp_meant(const kempe_model *model, kmp_variant **meant)
{
    meaning x;
    kempe_status status = find_meaning(model, NULL, &x);
    *meant = status == KEMPE_OK && x.drawing == KMP_DRAWING_EXACT ? x.variant : NULL;
    end_meaning(&x, *meant);
    return status;
}

/* -- systems ----------------------------------------------------------------------------------------- */

/* Records in a system of the same drawing the gaps as drawn, at the start or else elsewhere. */
static void note_misfits(const kempe_system *rounded, const kempe_assembly *a, kempe_system *s)
{
    for (int c = 0; c < rounded->model->closure_count; c++)
        s->misfit[c] = rounded->misfit[c];
    for (int r = 0; r < rounded->m; r++) {
        double *most = &s->misfit[rounded->rows[r].closure];
        double open = a->misfit > KMP_CLOSED_ENOUGH ? a->open[r] : rounded->rounding->misfit;
        *most = a->dropped[r] && open > KMP_CLOSED_ENOUGH ? fmax(*most, open) : *most;
    }
}

void kmp_put_misfit(kmp_text *text, const kempe_system *s, int closure)
{
    if (!(s->misfit[closure] > 0))
        return;
    kmp_text_printf(text,
                    "closure '%s' is open by %.2g m as drawn, accepted as rounding of the model's numbers "
                    "(closure_tolerance %.2g m)",
                    s->model->closures[closure].name, s->misfit[closure] * s->length, s->closure_tolerance);
    if (s->mended)
        kmp_text_printf(text, "; it closes if points and axes move by at most %.2g of the length of %.3g m",
                        s->mended_by, s->length);
}

/* Replaces a rounded system by the system of the exact mechanism. If rounding does not explain the misfit, the closures
 * hold as written. Only the closures decide, as in kmp_meant, so that both give the same bits. */
static kempe_status settle_meaning(kempe_system **system, kmp_variant *given, const char *word)
{
    kempe_system *s = *system;
    meaning x;
    kempe_status status = find_meaning(s->model, given, &x);
    bool exact = status == KEMPE_OK && x.drawing == KMP_DRAWING_EXACT;
    if (exact)
        status = kmp_system_new_by(kmp_variant_model(x.variant), word, system);
    if (exact && status == KEMPE_OK) {
        (*system)->mended = true;
        (*system)->mended_by = x.by;
        (*system)->build_s += s->build_s;
        (*system)->own = given ? NULL : x.variant;
        x.variant = given;
        kempe_system_free(s);
    }
    if (status == KEMPE_OK && x.drawing == KMP_DRAWING_UNEXPLAINED) {
        s->strict = true;
        atomic_store(&s->rounding->state, KMP_ROUNDING_UNKNOWN);
    } else if (status == KEMPE_OK && x.rounded) {
        note_misfits(x.closures, x.a, *system);
    }
    end_meaning(&x, given);
    return status;
}

/* Derives a system. `given`: the variant that owns the model, if its parameters vary. */
static kempe_status derive_system(const kempe_model *model, kmp_variant *given, const char *word, kempe_system **system)
{
    kempe_system *s = NULL;
    kempe_assembly *a = NULL;
    bool rounded = false;
    kempe_status status = kmp_system_new_by(model, word, &s);
    if (status == KEMPE_OK)
        status = assemble_first(s, &a, &rounded);
    kempe_assembly_free(a);
    if (status == KEMPE_OK && rounded)
        status = settle_meaning(&s, given, word);
    else if (status == KEMPE_OK && !given && !kmp_rounding_of(s)) {
        kmp_program_cache_set_key(s, word);
        kmp_system_keep(s);
    }
    return KMP_GIVE_OR_FREE(status, system, s, kempe_system_free);
}

static kempe_status new_system(const kempe_model *model, kmp_variant *given, const char *word, kempe_system **system)
{
    kempe_system *s = given ? NULL : kmp_system_recall(model, word);
    if (s)
        kmp_context_clear(model->context);
    else
        KMP_TRY(derive_system(model, given, word, &s));
    for (int c = 0; c < s->model->closure_count; c++) { /* gaps as drawn, also where a mended system closes them */
        kmp_text text = {0};
        kmp_put_misfit(&text, s, c);
        if (text.s && text.length > 0)
            kmp_log(s->context, KEMPE_LOG_WARNING, "%s", text.s);
        kmp_text_free(&text);
    }
    *system = s;
    return KEMPE_OK;
}

kempe_status kmp_system_new(const kempe_model *model, const char *word, kempe_system **system)
{
    return new_system(model, NULL, word, system);
}

kempe_status kmp_system_of_variant(kmp_variant *variant, kempe_system **system)
{
    return new_system(kmp_variant_model(variant), variant, NULL, system);
}

kempe_status kempe_system_new_with_algorithm(const kempe_model *model, const char *word, kempe_system **system)
{
    KMP_WANTED_BOTH(model, system);
    return kmp_system_new(model, word, system);
}
