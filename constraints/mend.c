/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures are redundant where w' h = 0 for all w of the left null space of J, wherever the mechanism goes. At many
 * configurations q_k, reached by finite motions, these are conditions on the numbers p of the drawing: the points and
 * axes around its loops. They are met by Gauss and Newton's method,
 *
 *     (w_k' dh/dp) dp = -w_k' h(q_k, p),     dp of least norm,
 *
 * q_k being closed anew on independent rows after each step: w_k' J = 0, so that the moves of q_k do not count. dh/dp
 * is made of differences between closures derived with shifted numbers, once: what it is off by, and w_k by rounding,
 * makes each step a small part of the one before. Numbers that are zero stay zero. A drawing shows the mechanism
 * assembled: where its start is closed but for the tolerance, h = 0 there is a condition too, of all rows. */
#include "constraints/mend.h"
#include "base/memory.h"
#include "constraints/charts.h"
#include "constraints/doctor_walk.h"
#include "constraints/rounding.h"
#include "constraints/tolerances.h"
#include "dynamics/equations.h"
#include "linalg/least.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_NUMBERS = 600, MOST_PLACES = 64, LEAST_PLACES = 12, STEPS = 12, MOST_DECIMALS = 12 };
#define DIFFERENCE 1e-4  /* shift of a number, characteristic lengths or rad: its square is what dh/dp is off by */
#define RANK       1e-5  /* of the conditions: above what dh/dp is off by, of the size of the rounding */
#define OFF        100.0 /* conditions are off by so many times the widest row, next to change points, and at most by: */
#define MOST_RANK  1e-2
#define WIDE       3.0   /* times the median misfit */
#define MET        2e-14 /* scaled |h| of redundant rows */
#define NEARLY_MET 1e-12 /* the same where it no longer falls: rounding of places where pivots are small */
#define EXPLAINED                                                                                                      \
    1e-2            /* part of the misfit, or of the rounding squared, that may remain where rounding explains it      \
                     */
#define LEAST 1e-15 /* a shift below is none */

/* A number of the model that may be shifted: a coordinate of a point, a component of an axis, a rotation of a frame. */
typedef struct number {
    kmp_number *point; /* NULL: the number belongs to an axis or frame */
    double *axes;      /* the axis, or the frame, row by row */
    bool frame;
    int k;           /* component of the axis; axis of rotation of the frame */
    double rounding; /* the unit of its last digit in the drawing, scaled */
    double total;    /* shift so far, scaled */
} number;

/* The original values of a number, as drawn. */
typedef struct drawn {
    kmp_number point;
    double axes[9];
} drawn;

typedef struct mending {
    const kempe_system *s;
    const kempe_assembly *a;
    kmp_variant *variant; /* its model holds the numbers */
    kempe_model *model;
    number *number;
    drawn *drawn;
    int count;
    double unit;    /* unit of the last digit of most numbers, scaled */
    bool *excluded; /* m: rows of drives */
    int rank;       /* of the others */
    int left;       /* conditions at a place */
    double *q;      /* n x places */
    double *w;      /* m x left x places */
    int places;
    bool closed;   /* the start is closed with the numbers as drawn */
    double *start; /* n */
    int conditions;
    double *slope;  /* dh/dp, scaled: rows of all places x count */
    double *matrix; /* conditions x count */
    double *rest;   /* conditions */
    double *shift;  /* count */
    bool explained; /* by rounding of the numbers, or there are too many numbers to decide */
    bool done;      /* the loops close with the shifted numbers */
} mending;

/* -- numbers that may be shifted ----------------------------------------------------------------------- */

static void add(mending *x, number n)
{
    for (int i = 0; i < x->count; i++)
        if (x->number[i].point == n.point && x->number[i].axes == n.axes && x->number[i].k == n.k)
            return;
    if (x->count < MOST_NUMBERS)
        x->number[x->count++] = n;
}

static void add_number(mending *x, kmp_number *n)
{
    if (n->value != 0)
        add(x, (number){.point = n});
}

static void add_axis(mending *x, double axis[3])
{
    for (int k = 0; k < 3; k++)
        if (axis[k] != 0 && fabs(axis[k]) != 1)
            add(x, (number){.axes = axis, .k = k});
}

static void add_frame(mending *x, bool turned, double frame[3][3])
{
    for (int k = 0; turned && k < 3; k++)
        add(x, (number){.axes = &frame[0][0], .frame = true, .k = k});
}

static void add_point(mending *x, int point)
{
    if (point < 0)
        return;
    kmp_point *p = &x->model->points[point];
    for (int k = 0; k < 3; k++)
        add_number(x, &p->at[k]);
    add_frame(x, p->turned, p->axes);
}

static void add_chain(mending *x, int body)
{
    for (; body != 0; body = x->model->bodies[body].parent) {
        kmp_body *b = &x->model->bodies[body];
        add_point(x, b->at);
        add_point(x, b->to);
        add_frame(x, b->turned, b->frame);
        for (int k = b->first_motion; k < b->first_motion + b->motion_count; k++)
            add_axis(x, x->model->motions[k].axis);
    }
}

static void add_numbers(mending *x)
{
    for (int c = 0; c < x->model->closure_count; c++) {
        kmp_closure *closure = &x->model->closures[c];
        for (int k = 0; k < 2 && closure->point[0] >= 0 && closure->point[1] >= 0; k++) {
            add_point(x, closure->point[k]);
            add_axis(x, closure->axis[k]);
            add_chain(x, x->model->points[closure->point[k]].body);
        }
        if (!closure->function)
            add_number(x, &closure->length);
    }
}

/* Returns the number of decimals that a value is written with; -1: more than a drawing has. */
static int decimals_of(double value)
{
    double tens = 1;
    for (int d = 0; d <= MOST_DECIMALS; d++, tens *= 10)
        if (fabs(value * tens - round(value * tens)) <= 8 * DBL_EPSILON * fabs(value * tens))
            return d;
    return -1;
}

/* Determines the rounding of each number. Numbers with more decimals than a drawing has were computed, at least in
 * single precision. The others have the decimals of most of them, since trailing zeros are not written. Axes lost
 * their digits when they were normalised and take those of the lengths. A given tolerance takes precedence over the
 * digits. */
static void find_rounding(mending *x)
{
    int with[MOST_DECIMALS + 1] = {0}, some = 0, most = 0;
    const double computed = FLT_EPSILON;
    for (int i = 0; i < x->count; i++) {
        int d = x->number[i].point ? decimals_of(x->number[i].point->value) : -1;
        some += d > 0;
        with[d > 0 ? d : 0] += d > 0;
    }
    for (int below = 0; most < MOST_DECIMALS && 2 * (below + with[most]) <= some; most++)
        below += with[most];
    x->unit = some > 0 ? pow(10, -most) / x->s->length : computed;
    for (int i = 0; i < x->count; i++) {
        const kmp_number *p = x->number[i].point;
        x->number[i].rounding = p && decimals_of(p->value) < 0 ? fmin(x->unit, computed) : x->unit;
    }
}

/* Of a frame: turned about its own axis k. */
static void turn(double *r, int k, double by)
{
    int i = (k + 1) % 3, j = (k + 2) % 3;
    double c = cos(by), s = sin(by);
    for (int row = 0; row < 3; row++) {
        double a = r[3 * row + i], b = r[3 * row + j];
        r[3 * row + i] = c * a + s * b;
        r[3 * row + j] = c * b - s * a;
    }
}

static size_t axes_size(const number *n)
{
    return (n->point ? 0 : n->frame ? 9 : 3) * sizeof(double);
}

static void keep(const number *n, drawn *d)
{
    if (n->point)
        d->point = *n->point;
    memcpy(d->axes, n->axes ? n->axes : d->axes, axes_size(n));
}

static void put_back(const number *n, const drawn *d)
{
    if (n->point)
        *n->point = d->point;
    else
        memcpy(n->axes, d->axes, axes_size(n));
}

/* Shifts a number of the model. false: no memory. */
static bool move(const mending *x, const number *n, double by)
{
    double *a = n->axes;
    if (n->point)
        return kmp_variant_shift(x->variant, n->point, by * x->s->length);
    if (n->frame) {
        turn(a, n->k, by);
        return true;
    }
    a[n->k] += by;
    double size = hypot(hypot(a[0], a[1]), a[2]);
    for (int k = 0; k < 3; k++)
        a[k] /= size;
    return true;
}

/* -- configurations ---------------------------------------------------------------------------------- */

static kmp_walk *walk_of(const mending *x, const kempe_system *s)
{
    kmp_walk *w = kmp_walk_new(s);
    if (!w)
        return NULL;
    w->rank = x->rank;
    w->excluded = x->excluded;
    if (x->a->chart)
        kmp_plant_set_charts(w->plant, x->a->chart);
    return w;
}

static bool find_places(mending *x)
{
    kmp_waypoint place[MOST_PLACES];
    int wanted = LEAST_PLACES + 2 * x->count / x->left;
    kmp_walk *w = walk_of(x, x->s);
    wanted = wanted < MOST_PLACES ? wanted : MOST_PLACES;
    memcpy(x->q, x->a->inner_q ? x->a->inner_q : x->a->q, (size_t)x->s->n * sizeof *x->q);
    if (w)
        x->places = kmp_rounding_waypoints(w, NULL, wanted, x->q, place);
    kmp_walk_free(w);
    return w;
}

/* -- conditions -------------------------------------------------------------------------------------- */

static size_t rows_of(const mending *x)
{
    return (size_t)(x->places + x->closed) * (size_t)x->s->m;
}

static const double *place_at(const mending *x, int place)
{
    return place < x->places ? x->q + (size_t)place * (size_t)x->s->n : x->start;
}

/* w_k' h of scaled h (m) at place k, or of its derivative, to `out` (conditions); h itself at the start as drawn, which
 * comes last. */
static void contract(const mending *x, int place, const double *h, double *out)
{
    int m = x->s->m;
    for (int r = 0; place == x->places && r < m; r++)
        out[place * x->left + r] = x->excluded[r] ? 0 : h[r];
    for (int l = 0; place < x->places && l < x->left; l++) {
        const double *w = x->w + ((size_t)place * (size_t)x->left + (size_t)l) * (size_t)m;
        out[place * x->left + l] = 0;
        for (int r = 0; r < m; r++)
            out[place * x->left + l] += x->excluded[r] ? 0 : w[r] * h[r];
    }
}

/* Scaled h of the copied model at all places, added `times` to `out` (m a place). false: no memory, or what is no
 * closure any more. */
static bool add_closures(mending *x, double times, double *out)
{
    static const double start = 0;
    const kmp_scene scene = {.sets = KMP_SET_CLOSURE, .plain = true, .charted = true};
    const kempe_system *s = x->s;
    kmp_equations eq;
    if (kmp_equations_derive_once(&eq, x->model, &scene) != KEMPE_OK)
        return false;
    int m = s->m, charts = KMP_CHART_SIZE * s->chart_count;
    double *value = KMP_NEW(double, kmp_graph_count(eq.graph)), *chart = KMP_NEW(double, charts);
    bool ok = value && chart;
    if (ok && x->a->chart)
        memcpy(chart, x->a->chart, (size_t)charts * sizeof *chart);
    else if (ok)
        kmp_charts_reset(s, chart);
    for (int k = 0; ok && k < x->places + x->closed; k++, out += m) {
        const double *inputs[KMP_IN_COUNT] = {[KMP_IN_PARAMETER] = s->parameters,
                                              [KMP_IN_TIME] = &start,
                                              [KMP_IN_Q] = place_at(x, k),
                                              [KMP_IN_CHART] = chart};
        kmp_graph_eval(eq.graph, inputs, value);
        for (int r = 0; r < m; r++) {
            int row = eq.row[KMP_CLOSURE_ROWS * s->rows[r].closure + s->rows[r].component];
            kmp_ref of = row < 0 ? KMP_ZERO : eq.h[row];
            out[r] += row < 0 ? 0 : (kmp_is_negative(of) ? -times : times) * value[kmp_id(of)] / s->row_scale[r];
        }
    }
    kmp_free(value);
    kmp_free(chart);
    kmp_equations_free(&eq);
    return ok;
}

/* Computes derivatives by the shift of each number in units of its rounding: a step of least norm then shifts all
 * alike. */
static bool find_slopes(mending *x)
{
    bool ok = true;
    for (int i = 0; ok && i < x->count; i++) {
        const number *n = &x->number[i];
        for (int side = 1; ok && side >= -1; side -= 2) {
            ok = move(x, n, side * DIFFERENCE) &&
                 add_closures(x, side / (2 * DIFFERENCE) * n->rounding, x->slope + (size_t)i * rows_of(x));
            put_back(n, &x->drawn[i]);
        }
    }
    return ok;
}

/* The conditions of a place at the walk's last state, and their slopes. */
static void take_conditions(mending *x, kmp_walk *w, int place)
{
    size_t m = (size_t)w->m, first = (size_t)place * m;
    if (place < x->places) {
        (void)kmp_walk_left(w, 0, x->rank);
        memcpy(x->w + first * (size_t)x->left, w->basis, m * (size_t)x->left * sizeof *x->w);
    }
    contract(x, place, w->h, x->rest);
    for (int i = 0; i < x->count; i++)
        contract(x, place, x->slope + (size_t)i * rows_of(x) + first, x->matrix + (size_t)i * (size_t)x->conditions);
}

/* Places where rows are open much wider than at most others are next to a change point, or on a branch that is not
 * meant: their conditions do not count. The widest row of those that do. */
static double sift(mending *x, const double *open)
{
    double widest = 0;
    int places = x->places + x->closed;
    for (int k = 0; k < places; k++) {
        int narrower = 0;
        for (int i = 0; i < places; i++)
            narrower += !(open[k] <= fmax(WIDE * open[i], NEARLY_MET));
        bool counts = narrower <= places / 2;
        widest = counts ? fmax(widest, open[k]) : widest;
        for (int l = k * x->left; !counts && k < x->places && l < (k + 1) * x->left; l++) {
            x->rest[l] = 0;
            for (int i = 0; i < x->count; i++)
                x->matrix[(size_t)l + (size_t)i * (size_t)x->conditions] = 0;
        }
    }
    return widest;
}

/* The places closed anew on independent rows of a system: the conditions, and the widest row. false: no memory, or
 * other rows. */
static bool look(mending *x, const kempe_system *s, double *widest)
{
    kmp_walk *w = s->m == x->s->m ? walk_of(x, s) : NULL;
    double open[MOST_PLACES + 1];
    for (int k = 0; w && k < x->places + x->closed; k++) {
        bool closed = k == x->places || kmp_walk_close(w, x->q + (size_t)k * (size_t)s->n);
        if (k == x->places)
            kmp_walk_evaluate(w, x->start);
        take_conditions(x, w, k);
        open[k] = closed ? kmp_rounding_opening(w, NULL) : INFINITY;
    }
    *widest = w ? sift(x, open) : INFINITY;
    kmp_walk_free(w);
    return w;
}

/* -- steps ------------------------------------------------------------------------------------------- */

/* Returns how far a number may be shifted, scaled. */
static double farthest(const mending *x, const number *n)
{
    if (x->s->model->closure_tolerance_given)
        return x->s->closure_tolerance / x->s->length;
    return fmax(KMP_MEND_DIGITS * n->rounding, n->point ? 0 : KMP_MEND_AXES);
}

/* True if every number stays within the shift that rounding allows. */
static bool is_near(const mending *x)
{
    for (int i = 0; i < x->count; i++)
        if (!(fabs(x->number[i].total - x->shift[i]) <= farthest(x, &x->number[i])))
            return false;
    return true;
}

/* Returns the largest residual of the linearised conditions after a step. */
static double left_by(const mending *x)
{
    double most = 0;
    for (int c = 0; c < x->conditions; c++) {
        double left = x->rest[c];
        for (int i = 0; i < x->count; i++)
            left -= x->matrix[(size_t)c + (size_t)i * (size_t)x->conditions] * x->shift[i];
        most = fmax(most, fabs(left));
    }
    return most;
}

/* `widest` is what the left null spaces are off by, more where pivots are small: directions of the conditions below
 * that are left to the next step, and more of them where they lead far. false: no memory, or farther than rounding
 * leads. */
static bool step(mending *x, double widest)
{
    double rank = fmin(fmax(RANK, OFF * widest), MOST_RANK), left = INFINITY;
    bool near = false;
    for (; !near && rank <= MOST_RANK; rank *= 10) {
        if (kmp_least_squares(x->conditions, x->count, x->matrix, x->rest, rank, x->shift) < 0)
            return false;
        left = left_by(x);
        for (int i = 0; i < x->count; i++)
            x->shift[i] *= x->number[i].rounding;
        near = is_near(x);
    }
    x->explained = x->explained || (near && left <= fmax(EXPLAINED * widest, x->unit * x->unit));
    for (int i = 0; near && i < x->count; i++) {
        x->number[i].total -= x->shift[i];
        if (fabs(x->shift[i]) > LEAST)
            near = move(x, &x->number[i], -x->shift[i]);
    }
    return near;
}

/* True if the mechanism closes and no row remains open. */
static bool is_whole(const kempe_system *s)
{
    kempe_assembly *a = NULL;
    bool whole = kmp_assemble_start(s, &a) == KEMPE_OK && a->closed && !kmp_rounding_of(s);
    kempe_assembly_free(a);
    return whole;
}

/* Iterates until the closures agree to rounding; sets x->done if they do. */
static kempe_status go(mending *x)
{
    const kempe_system *now = x->s;
    kempe_system *next = NULL;
    double widest, before = INFINITY;
    kempe_status status = KEMPE_OK;
    bool met = false;
    for (int k = 0; k < STEPS; k++, before = widest) {
        met = now->m < x->s->m; /* rows have become exactly zero: the assembly will tell */
        if (met || !look(x, now, &widest))
            break;
        met = k > 0 && (widest <= MET || (widest <= NEARLY_MET && widest > 0.5 * before));
        if (met || !(widest < 0.5 * before) || !step(x, widest))
            break;
        kempe_system_free(next);
        next = NULL;
        status = kmp_system_of_closures(x->model, &next);
        if (status != KEMPE_OK)
            break;
        now = next;
    }
    x->done = met && is_whole(next);
    kempe_system_free(next);
    return status == KEMPE_E_MEMORY ? status : KEMPE_OK;
}

/* Whether the start is closed as drawn. false: no memory. */
static bool look_at_start(mending *x)
{
    const kempe_system *s = x->s;
    kmp_walk *w = walk_of(x, s);
    double most = 0;
    for (int i = 0; i < s->n; i++)
        x->start[i] = s->model->start.q[i].value;
    if (w)
        kmp_walk_evaluate(w, x->start);
    for (int r = 0; w && r < s->m; r++)
        most = fmax(most, fabs(w->h[r]));
    x->closed = w && !x->a->chart && most * s->length <= s->closure_tolerance;
    kmp_walk_free(w);
    return w;
}

static bool begin(mending *x)
{
    const kempe_system *s = x->s;
    size_t n = (size_t)s->n, m = (size_t)s->m;
    x->excluded = KMP_NEW(bool, m);
    x->number = KMP_NEW(number, MOST_NUMBERS);
    x->drawn = KMP_NEW(drawn, MOST_NUMBERS);
    if (!x->excluded || !x->number || !x->drawn)
        return false;
    x->rank = s->rounding->rank - kmp_rounding_drives(s, x->a->dropped, x->excluded);
    x->left = s->m - x->rank;
    add_numbers(x);
    x->explained = x->count == MOST_NUMBERS;
    find_rounding(x);
    for (int i = 0; i < x->count; i++)
        keep(&x->number[i], &x->drawn[i]);
    x->q = KMP_NEW(double, n *(MOST_PLACES + 1));
    x->start = KMP_NEW(double, n);
    x->w = KMP_NEW(double, m *(size_t)x->left *MOST_PLACES);
    if (!x->q || !x->w || !x->start || !find_places(x) || !look_at_start(x))
        return false;
    x->conditions = x->places * x->left + (x->closed ? s->m : 0);
    size_t conditions = (size_t)x->conditions, count = (size_t)x->count;
    x->slope = KMP_NEW(double, rows_of(x) * count);
    x->matrix = KMP_NEW(double, conditions *count);
    x->rest = KMP_NEW(double, conditions);
    x->shift = KMP_NEW(double, count);
    return x->slope && x->matrix && x->rest && x->shift;
}

static void end(mending *x)
{
    void *const rooms[] = {x->excluded, x->number, x->drawn,  x->q,    x->w,
                           x->start,    x->slope,  x->matrix, x->rest, x->shift};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        kmp_free(rooms[k]);
}

/* Larger ones are not looked at: their closures stay open where they are redundant but for rounding. */
enum { MOST_COORDINATES = 100, MOST_ROWS = 200 };

typedef enum outcome { AS_DRAWN, UNEXPLAINED, MENDED } outcome;

/* Shifts the numbers of the variant, whose model is that of a rounded system or equal to it. *by: largest shift,
 * scaled. */
static kempe_status mend(const kempe_system *s, const kempe_assembly *a, kmp_variant *variant, outcome *out, double *by)
{
    mending x = {.s = s, .a = a, .variant = variant, .model = kmp_variant_model(variant)};
    kempe_status status = begin(&x) ? KEMPE_OK : kmp_fail_memory(s->context);
    *by = 0;
    if (status == KEMPE_OK && x.count > 0 && find_slopes(&x))
        status = go(&x);
    for (int i = 0; i < x.count; i++) {
        *by = fmax(*by, fabs(x.number[i].total));
        if (!x.done)
            put_back(&x.number[i], &x.drawn[i]);
    }
    *out = x.done ? MENDED : x.explained || s->model->closure_tolerance_given ? AS_DRAWN : UNEXPLAINED;
    end(&x);
    return status;
}

/* Assembles at the start; *rounded: closures are redundant but for rounding of the model's numbers. */
static kempe_status assemble_first(kempe_system *s, kempe_assembly **a, bool *rounded)
{
    bool looked = s->m > 0 && s->closure_tolerance > 0;
    kempe_status status = looked ? kmp_assemble_start(s, a) : KEMPE_OK;
    *rounded = looked && status == KEMPE_OK && (*a)->closed && kmp_rounding_of(s);
    kmp_context_clear(s->context);
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(s->context) : KEMPE_OK;
}

/* Assembles, and looks for an exact mechanism if the system is rounded and not too large. *variant is made if it is
 * NULL, and freed if nothing is shifted. */
static kempe_status look_for_rounding(kempe_system *s, kempe_assembly **a, kmp_variant **variant, outcome *out,
                                      double *by)
{
    bool given = *variant, rounded;
    *out = AS_DRAWN;
    kempe_status status = assemble_first(s, a, &rounded);
    if (status == KEMPE_OK && rounded && s->n <= MOST_COORDINATES && s->m <= MOST_ROWS) {
        status = given ? KEMPE_OK : kmp_variant_new(s->model, 0, NULL, variant);
        if (status == KEMPE_OK)
            status = mend(s, *a, *variant, out, by);
        kmp_context_clear(s->context);
    }
    if (!given && *out != MENDED) {
        kmp_variant_free(*variant);
        *variant = NULL;
    }
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(s->context) : KEMPE_OK;
}

kempe_status kmp_meant(const kempe_model *model, kmp_variant **meant)
{
    kempe_system *s = NULL;
    kempe_assembly *a = NULL;
    outcome out;
    double by;
    *meant = NULL;
    kempe_status status = kmp_system_of_closures(model, &s);
    if (status == KEMPE_OK)
        status = look_for_rounding(s, &a, meant, &out, &by);
    kempe_assembly_free(a);
    kempe_system_free(s);
    return status;
}

/* -- systems ----------------------------------------------------------------------------------------- */

/* What stays open as drawn, at the start or else elsewhere, for a system made of the same drawing. */
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

/* What stays open as drawn; those that a mended system closes are told with it. */
static void tell(const kempe_system *s)
{
    for (int c = 0; c < s->model->closure_count; c++) {
        kmp_text text = {0};
        kmp_put_misfit(&text, s, c);
        if (text.s && text.length > 0)
            kmp_log(s->context, KEMPE_LOG_WARNING, "%s", text.s);
        kmp_text_free(&text);
    }
}

void kmp_put_misfit(kmp_text *text, const kempe_system *s, int closure)
{
    if (!(s->misfit[closure] > 0))
        return;
    kmp_text_printf(text,
                    "closure '%s' stays open by %.2g m as drawn: taken as rounding of the model's numbers "
                    "(closure_tolerance %.2g m)",
                    s->model->closures[closure].name, s->misfit[closure] * s->length, s->closure_tolerance);
    if (s->mended)
        kmp_text_printf(text, "; points and axes moved by at most %.2g of the length of %.3g m make it close",
                        s->mended_by, s->length);
}

/* Replaces *system by the system of the exact mechanism. If rounding does not explain the misfit the closures hold
 * as written. */
static kempe_status take_up(kempe_system **system, const kempe_system *closures, const kempe_assembly *a,
                            kmp_variant *variant, outcome out, const char *word)
{
    kempe_system *s = *system, *mended = NULL;
    kempe_status status = KEMPE_OK;
    if (out == MENDED) {
        status = kmp_system_new_by(kmp_variant_model(variant), word, &mended);
        if (status != KEMPE_OK)
            return status;
        mended->mended = true;
        mended->build_s += s->build_s;
        note_misfits(closures, a, mended);
        kempe_system_free(s);
        *system = mended;
    } else if (out == UNEXPLAINED) {
        s->strict = true;
        atomic_store(&s->rounding->state, 0);
    } else {
        note_misfits(closures, a, s);
    }
    return status;
}

/* Replaces a rounded system s. The closures alone decide, as in kmp_meant, so that both give the same bits. */
static kempe_status settle(kempe_system **s, kmp_variant **variant, const char *word, double *by)
{
    kempe_system *closures = NULL;
    kempe_assembly *a = NULL;
    outcome out;
    kempe_status status = kmp_system_of_closures((*s)->model, &closures);
    if (status == KEMPE_OK)
        status = look_for_rounding(closures, &a, variant, &out, by);
    if (status == KEMPE_OK && a && kmp_rounding_of(closures))
        status = take_up(s, closures, a, *variant, out, word);
    kempe_assembly_free(a);
    kempe_system_free(closures);
    return status;
}

/* `given`: the variant that owns the model, if its parameters vary. */
static kempe_status new_system(const kempe_model *model, kmp_variant *given, const char *word, kempe_system **system)
{
    kempe_system *s = NULL;
    kempe_assembly *a = NULL;
    kmp_variant *variant = given;
    bool rounded = false;
    double by = 0;
    kempe_status status = kmp_system_new_by(model, word, &s);
    if (status == KEMPE_OK)
        status = assemble_first(s, &a, &rounded);
    kempe_assembly_free(a);
    if (status == KEMPE_OK && rounded)
        status = settle(&s, &variant, word, &by);
    if (status != KEMPE_OK) {
        kempe_system_free(s);
        if (!given)
            kmp_variant_free(variant);
        return status;
    }
    s->own = given ? NULL : variant;
    s->mended_by = s->mended ? by : 0;
    tell(s);
    *system = s;
    return KEMPE_OK;
}

kempe_status kempe_system_new_by(const kempe_model *model, const char *word, kempe_system **system)
{
    KMP_WANTED(NULL, model, "model");
    KMP_WANTED(model->context, system, "system");
    return new_system(model, NULL, word, system);
}

kempe_status kempe_system_new(const kempe_model *model, kempe_system **system)
{
    return kempe_system_new_by(model, NULL, system);
}

kempe_status kmp_system_of_variant(kmp_variant *variant, kempe_system **system)
{
    return new_system(kmp_variant_model(variant), variant, NULL, system);
}
