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
#include <math.h>
#include <string.h>

enum { MOST_NUMBERS = 600, MOST_PLACES = 64, LEAST_PLACES = 12, STEPS = 12 };
#define DIFFERENCE 1e-4  /* shift of a number, characteristic lengths or rad: its square is what dh/dp is off by */
#define RANK       1e-5  /* of the conditions: above what dh/dp is off by, of the size of the rounding */
#define OFF        100.0 /* conditions are off by so many times the widest row, next to change points, and at most by: */
#define MOST_RANK  1e-2
#define WIDE       10.0  /* of the median misfit */
#define MET        2e-14 /* scaled |h| of redundant rows */
#define NEARLY_MET 1e-12 /* the same where it no longer falls: rounding of places where pivots are small */
#define LEAST      1e-15 /* a shift below is none */

typedef enum number_kind { NUMBER_POINT, NUMBER_AXIS, NUMBER_FRAME } number_kind;

/* A number of the copied model. */
typedef struct number {
    number_kind kind;
    double *at; /* itself; the axis; the frame, row by row */
    int k;      /* component of the axis; axis that the frame is turned about */
} number;

typedef struct mending {
    const kempe_system *s;
    const kempe_assembly *a;
    kempe_model *model;
    number *number;
    int count;
    bool *excluded; /* m: rows of drives */
    int rank;       /* of the others */
    int left;       /* conditions at a place */
    double *q;      /* n x places */
    double *w;      /* m x left x places */
    int places;
    bool drawn;    /* the start is closed as drawn */
    double *start; /* n */
    int conditions;
    double *slope;  /* dh/dp, scaled: rows of all places x count */
    double *matrix; /* conditions x count */
    double *rest;   /* conditions */
    double *shift;  /* count */
    double *total;  /* count */
} mending;

/* -- the copy ---------------------------------------------------------------------------------------- */

static size_t round_up(size_t size)
{
    return (size + 15) / 16 * 16;
}

static void *take(char **room, const void *from, size_t size)
{
    void *at = *room;
    memcpy(at, from, size);
    *room += round_up(size);
    return at;
}

/* The model and the arrays that are its own, in one piece. */
static kempe_model *copy_model(const kempe_model *m)
{
    size_t points = (size_t)m->point_count * sizeof *m->points, motions = (size_t)m->motion_count * sizeof *m->motions,
           bodies = (size_t)m->body_count * sizeof *m->bodies,
           closures = (size_t)m->closure_count * sizeof *m->closures;
    char *room = KMP_NEW(char, round_up(sizeof *m) + round_up(points) + round_up(motions) + round_up(bodies) +
                                   round_up(closures));
    if (!room)
        return NULL;
    kempe_model *c = take(&room, m, sizeof *m);
    c->points = take(&room, m->points, points);
    c->motions = take(&room, m->motions, motions);
    c->bodies = take(&room, m->bodies, bodies);
    c->closures = take(&room, m->closures, closures);
    return c;
}

/* -- its numbers ------------------------------------------------------------------------------------- */

static void add(mending *x, number_kind kind, double *at, int k)
{
    for (int i = 0; i < x->count; i++)
        if (x->number[i].at == at && x->number[i].k == k)
            return;
    if (x->count < MOST_NUMBERS)
        x->number[x->count++] = (number){kind, at, k};
}

static void add_axis(mending *x, double axis[3])
{
    for (int k = 0; k < 3; k++)
        if (axis[k] != 0 && fabs(axis[k]) != 1)
            add(x, NUMBER_AXIS, axis, k);
}

static void add_frame(mending *x, bool turned, double frame[3][3])
{
    for (int k = 0; turned && k < 3; k++)
        add(x, NUMBER_FRAME, &frame[0][0], k);
}

static void add_point(mending *x, int point)
{
    if (point < 0)
        return;
    kmp_point *p = &x->model->points[point];
    for (int k = 0; k < 3; k++)
        if (p->at[k].value != 0)
            add(x, NUMBER_POINT, &p->at[k].value, 0);
    add_frame(x, p->turned, p->axes);
}

static void add_chain(mending *x, int body, int top)
{
    for (; body != top; body = x->model->bodies[body].parent) {
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
            add_chain(x, x->model->points[closure->point[k]].body, 0);
        }
    }
}

static size_t size_of(const number *n)
{
    return (n->kind == NUMBER_POINT ? 1 : n->kind == NUMBER_AXIS ? 3 : 9) * sizeof(double);
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

static void move(const mending *x, const number *n, double by)
{
    double *a = n->at;
    if (n->kind == NUMBER_POINT) {
        *a += by * x->s->length;
    } else if (n->kind == NUMBER_FRAME) {
        turn(a, n->k, by);
    } else {
        a[n->k] += by;
        double size = hypot(hypot(a[0], a[1]), a[2]);
        for (int k = 0; k < 3; k++)
            a[k] /= size;
    }
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

/* The left null space at the walk's last state. */
static void keep_left(mending *x, kmp_walk *w, double *left)
{
    for (int r = 0; r < w->m; r++)
        for (int k = 0; k < w->n; k++)
            w->copy[k + r * w->n] = w->jacobian[r + k * w->m];
    (void)kmp_null_space(w->n, w->m, w->copy, 0, x->rank, w->basis, w->order, &w->last);
    memcpy(left, w->basis, (size_t)(w->m * x->left) * sizeof *left);
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
    return (size_t)(x->places + x->drawn) * (size_t)x->s->m;
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
    for (int k = 0; ok && k < x->places + x->drawn; k++, out += m) {
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

static bool find_slopes(mending *x)
{
    bool ok = true;
    for (int i = 0; ok && i < x->count; i++) {
        double before[9], *column = x->slope + (size_t)i * rows_of(x);
        const number *n = &x->number[i];
        for (int side = 1; ok && side >= -1; side -= 2) {
            memcpy(before, n->at, size_of(n));
            move(x, n, side * DIFFERENCE);
            ok = add_closures(x, side / (2 * DIFFERENCE), column);
            memcpy(n->at, before, size_of(n));
        }
    }
    return ok;
}

/* The conditions of a place at the walk's last state, and their slopes. */
static void take_conditions(mending *x, kmp_walk *w, int place)
{
    size_t m = (size_t)w->m, first = (size_t)place * m;
    if (place < x->places)
        keep_left(x, w, x->w + first * (size_t)x->left);
    contract(x, place, w->h, x->rest);
    for (int i = 0; i < x->count; i++)
        contract(x, place, x->slope + (size_t)i * rows_of(x) + first, x->matrix + (size_t)i * (size_t)x->conditions);
}

/* Places where rows are open much wider than at most others are next to a change point, or on a branch that is not
 * meant: their conditions do not count. The widest row of those that do. */
static double sift(mending *x, const double *open)
{
    double widest = 0;
    int places = x->places + x->drawn;
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
    for (int k = 0; w && k < x->places + x->drawn; k++) {
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

/* Whether the step leads nowhere but where rounding does. */
static bool is_near(const mending *x, double most)
{
    for (int i = 0; i < x->count; i++)
        if (!(fabs(x->total[i] - x->shift[i]) <= most))
            return false;
    return true;
}

/* `widest` is what the left null spaces are off by, more where pivots are small: directions of the conditions below
 * that are left to the next step, and more of them where they lead far. false: no memory, or farther than rounding
 * leads. */
static bool step(mending *x, double widest)
{
    double rank = fmin(fmax(RANK, OFF * widest), MOST_RANK), most = x->s->closure_tolerance / x->s->length;
    do {
        if (kmp_least_squares(x->conditions, x->count, x->matrix, x->rest, rank, x->shift) < 0)
            return false;
        rank *= 10;
    } while (!is_near(x, most) && rank <= MOST_RANK);
    for (int i = 0; i < x->count; i++) {
        x->total[i] -= x->shift[i];
        if (fabs(x->shift[i]) > LEAST)
            move(x, &x->number[i], -x->shift[i]);
    }
    for (int i = 0; i < x->count; i++)
        if (!(fabs(x->total[i]) <= most))
            return false;
    return true;
}

/* *mended stays NULL where the steps lead nowhere. */
static kempe_status go(mending *x, const char *word, kempe_system **mended)
{
    const kempe_system *now = x->s;
    kempe_system *next = NULL;
    double widest, before = INFINITY;
    kempe_status status = KEMPE_OK;
    bool on = true, met = false;
    for (int k = 0; on && !met && k < STEPS; k++) {
        met = now->m < x->s->m; /* rows have become exactly zero: the assembly will tell */
        if (met)
            break;
        on = look(x, now, &widest);
        met = on && now != x->s && (widest <= MET || (widest <= NEARLY_MET && widest > 0.5 * before));
        if (met || !on || !(widest < 0.5 * before) || !step(x, widest))
            break;
        before = widest;
        kempe_system_free(next);
        next = NULL;
        status = kmp_system_new_by(x->model, word, &next);
        on = status == KEMPE_OK;
        now = next;
    }
    if (met)
        *mended = next;
    else
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
    x->drawn = w && !x->a->chart && most * s->length <= s->closure_tolerance;
    kmp_walk_free(w);
    return w;
}

static bool begin(mending *x)
{
    const kempe_system *s = x->s;
    size_t n = (size_t)s->n, m = (size_t)s->m;
    x->excluded = KMP_NEW(bool, m);
    x->number = KMP_NEW(number, MOST_NUMBERS);
    x->model = copy_model(s->model);
    if (!x->excluded || !x->number || !x->model)
        return false;
    x->rank = s->rounding->rank - kmp_rounding_drives(s, x->a->dropped, x->excluded);
    x->left = s->m - x->rank;
    add_numbers(x);
    x->q = KMP_NEW(double, n *(MOST_PLACES + 1));
    x->start = KMP_NEW(double, n);
    x->w = KMP_NEW(double, m *(size_t)x->left *MOST_PLACES);
    if (!x->q || !x->w || !x->start || !find_places(x) || !look_at_start(x))
        return false;
    x->conditions = x->places * x->left + (x->drawn ? s->m : 0);
    size_t conditions = (size_t)x->conditions, count = (size_t)x->count;
    x->slope = KMP_NEW(double, rows_of(x) * count);
    x->matrix = KMP_NEW(double, conditions *count);
    x->rest = KMP_NEW(double, conditions);
    x->shift = KMP_NEW(double, count);
    x->total = KMP_NEW(double, count);
    return x->slope && x->matrix && x->rest && x->shift && x->total;
}

static void end(mending *x)
{
    void *const rooms[] = {x->excluded, x->number, x->model, x->q,     x->w,    x->start,
                           x->slope,    x->matrix, x->rest,  x->shift, x->total};
    for (size_t k = 0; k < sizeof rooms / sizeof *rooms; k++)
        kmp_free(rooms[k]);
}

/* What stays open as drawn, at the start or else elsewhere, for a system made of the same drawing. */
static void note_misfits(const kempe_system *drawn, const kempe_assembly *a, kempe_system *s)
{
    for (int c = 0; c < drawn->model->closure_count; c++)
        s->misfit[c] = drawn->misfit[c];
    for (int r = 0; r < drawn->m; r++) {
        double *most = &s->misfit[drawn->rows[r].closure];
        double open = a->misfit > KMP_CLOSED_ENOUGH ? a->open[r] : drawn->rounding->misfit;
        *most = a->dropped[r] && open > KMP_CLOSED_ENOUGH ? fmax(*most, open) : *most;
    }
}

static void describe(mending *x, kempe_system *mended)
{
    note_misfits(x->s, x->a, mended);
    for (int i = 0; i < x->count; i++)
        mended->mended_by = fmax(mended->mended_by, fabs(x->total[i]));
    mended->mended = x->model;
    x->model = NULL;
}

kempe_status kmp_mend(const kempe_system *rounded, const kempe_assembly *assembly, const char *word,
                      kempe_system **mended)
{
    mending x = {.s = rounded, .a = assembly};
    kempe_status status = begin(&x) ? KEMPE_OK : kmp_fail_memory(rounded->context);
    *mended = NULL;
    if (status == KEMPE_OK && x.count > 0 && find_slopes(&x))
        status = go(&x, word, mended);
    if (*mended)
        describe(&x, *mended);
    end(&x);
    return status;
}

/* -- systems ----------------------------------------------------------------------------------------- */

/* Larger ones are not looked at: their closures stay open where they are redundant but for rounding. */
enum { MOST_COORDINATES = 100, MOST_ROWS = 200 };

static bool may_mend(const kempe_system *s)
{
    bool varies = false;
    for (int k = 0; k < s->model->parameter_count; k++)
        varies = varies || s->model->parameters[k].varies;
    return s->m > 0 && s->closure_tolerance > 0 && !varies && s->n <= MOST_COORDINATES && s->m <= MOST_ROWS;
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

/* The mended system in place of *system, when it closes without any row that stays open. */
static kempe_status replace(kempe_system **system, kempe_system *mended)
{
    kempe_assembly *a = NULL;
    kempe_status status = kmp_assemble_start(mended, &a);
    bool good = status == KEMPE_OK && a->closed && !kmp_rounding_of(mended);
    kempe_assembly_free(a);
    if (good) {
        mended->build_s += (*system)->build_s;
        kempe_system_free(*system);
        *system = mended;
    } else {
        kempe_system_free(mended);
    }
    return status == KEMPE_E_MEMORY ? status : KEMPE_OK;
}

static kempe_status mend(kempe_system **system, const char *word)
{
    kempe_assembly *a = NULL;
    kempe_system *mended = NULL;
    kempe_status status = kmp_assemble_start(*system, &a);
    if (status == KEMPE_OK && a->closed && kmp_rounding_of(*system))
        status = kmp_mend(*system, a, word, &mended);
    if (status == KEMPE_OK && mended)
        status = replace(system, mended);
    if (status == KEMPE_OK && kmp_rounding_of(*system))
        note_misfits(*system, a, *system);
    kempe_assembly_free(a);
    kmp_context_clear((*system)->context);
    return status == KEMPE_E_MEMORY ? kmp_fail_memory((*system)->context) : KEMPE_OK;
}

kempe_status kempe_system_new_by(const kempe_model *model, const char *word, kempe_system **system)
{
    KMP_WANTED(NULL, model, "model");
    KMP_WANTED(model->context, system, "system");
    kempe_system *s = NULL;
    kempe_status status = kmp_system_new_by(model, word, &s);
    if (status == KEMPE_OK && may_mend(s))
        status = mend(&s, word);
    if (status == KEMPE_OK)
        tell(s);
    if (status == KEMPE_OK)
        *system = s;
    else
        kempe_system_free(s);
    return status;
}

kempe_status kempe_system_new(const kempe_model *model, kempe_system **system)
{
    return kempe_system_new_by(model, NULL, system);
}
