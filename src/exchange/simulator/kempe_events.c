/* SPDX-License-Identifier: BSD-3-Clause */
/* Search of events by bounds of the conditions, in the memory of a simulator: the function of kempe_watch in
 * kempe_simulator.h. The site is declared in simulator_steps.h. */
#include "exchange/simulator/kempe_simulator.h"
#include "integrators/events/event_pieces.h"
#include "integrators/events/watch_site.h"
#include "linalg/piece_bounds.h"
#include <kempe/runtime.h>
#include <stddef.h>
#include <string.h>

/* A bound lies in the place of four numbers. */
typedef char bound_fits[sizeof(kmp_bound) <= 4 * sizeof(double) ? 1 : -1];
typedef char step_fits[sizeof(kmp_bound_step) == 4 * sizeof(unsigned) ? 1 : -1];

typedef struct watcher {
    const kempe_watch *watch;
    const kmp_watch_site *site;
    kmp_bound_code code;
    kmp_bound *value;
    kmp_piece_search pieces;
} watcher;

/* -- tables -------------------------------------------------------------------------------------------- */

static double table_at(const kempe_watch_table *t, int derivative, double x)
{
    return kempe_interpolate(t->knots, t->x, t->y, (const double(*)[4])(const void *)t->pieces, derivative, x);
}

static int bound_table(const void *tables, unsigned number, int derivative, double from, double to, double *low,
                       double *high)
{
    const kempe_watch_table *t = (const kempe_watch_table *)tables + number;
    const double a = table_at(t, derivative, from), b = table_at(t, derivative, to);
    const bool smooth = t->degree > 1 && kmp_bends_smoothly(t->knots, t->x, t->pieces, from, to);
    *low = fmin(a, b);
    *high = fmax(a, b);
    from = fmax(from, t->x[0]);
    to = fmin(to, t->x[t->knots - 1]);
    for (int k = from <= to ? kempe_find_piece_(t->knots, t->x, from) : t->knots; k < t->knots - 1 && t->x[k] <= to;
         k++)
        kmp_piece_bounds(t->pieces + 4 * (ptrdiff_t)k, derivative, fmax(from - t->x[k], 0),
                         fmin(to, t->x[k + 1]) - t->x[k], low, high);
    return t->degree == 1 ? 1 : smooth ? 3 : 2;
}

/* -- a site of pieces ---------------------------------------------------------------------------------- */

/* A number of the motion and its rate, NAN where that is not known. */
static void take_number(const kmp_watch_site *at, const int *input, double *to)
{
    const int i = input[1];
    switch (input[0]) {
    case KEMPE_WATCH_Q:
        to[0] = at->q[i];
        to[1] = at->qd[i];
        return;
    case KEMPE_WATCH_QD:
        to[0] = at->qd[i];
        to[1] = at->qdd[i];
        return;
    case KEMPE_WATCH_QDD:
        to[0] = at->qdd[i];
        return;
    case KEMPE_WATCH_LAMBDA:
        to[0] = at->lambda[i];
        return;
    default:
        return;
    }
}

static int look(void *self, double t, kmp_event_probe *to)
{
    const watcher *w = self;
    const int status = w->site->look(w->site->self, t, to->change, to->solved);
    to->t = t;
    for (int k = 0; k < w->watch->inputs; k++)
        take_number(w->site, w->watch->input + 2 * (ptrdiff_t)k, to->state + 2 * (ptrdiff_t)k);
    return status;
}

static kmp_bound input_over(const watcher *w, int k, const kmp_step_piece *p)
{
    const kmp_watch_site *at = w->site;
    const int what = w->watch->input[2 * (ptrdiff_t)k], i = w->watch->input[2 * (ptrdiff_t)k + 1];
    if (what >= KEMPE_WATCH_STILL)
        return kmp_bound_still(what == KEMPE_WATCH_STILL       ? at->modes[i]
                               : what == KEMPE_WATCH_CHART     ? at->chart[i]
                               : what == KEMPE_WATCH_PARAMETER ? at->p[i]
                                                               : at->u[i]);
    const double *x = p->a->state + 2 * (ptrdiff_t)k, *y = p->b->state + 2 * (ptrdiff_t)k, h = p->b->t - p->a->t;
    const kmp_bound time = {p->a->t, p->b->t, 1, 1};
    switch (what) {
    case KEMPE_WATCH_TIME:
        return time;
    case KEMPE_WATCH_Q:
    case KEMPE_WATCH_QD:
        return kmp_bound_over(h, x[0], x[1], y[0], y[1]);
    default: /* accelerations and multipliers */
        return p->m ? kmp_bound_through(h, x[0], p->m->state[2 * (ptrdiff_t)k], y[0]) : kmp_bound_still(x[0]);
    }
}

/* `begin` has marked the conditions that may change. */
static void bind(void *self, const kmp_step_piece *p, const bool *open)
{
    const watcher *w = self;
    (void)open;
    const unsigned *unknown = w->watch->output + w->site->conditions;
    for (int k = 0; k < w->watch->inputs; k++)
        if (w->watch->input[2 * (ptrdiff_t)k] < KEMPE_WATCH_STILL)
            w->value[w->watch->constants + k] = input_over(w, k, p);
    for (int k = 0; p->m && k < w->watch->solved; k++)
        kmp_bound_give(w->value, unknown[k],
                       kmp_bound_through(p->b->t - p->a->t, p->a->solved[k], p->m->solved[k], p->b->solved[k]));
    kmp_bound_run(&w->code, w->code.fixed, w->value);
}

static kmp_bound bound_of(const void *self, int k)
{
    const watcher *w = self;
    return kmp_bound_of(w->value, w->watch->output[k]);
}

static bool may_change(const void *self, int k)
{
    const watcher *w = self;
    return w->site->may_change(w->site->self, k);
}

static bool is_held(const void *self, int k)
{
    const watcher *w = self;
    return w->site->holds(w->site->self, k);
}

static int end_piece(void *self, const kmp_event_probe *a, const kmp_event_probe *b, bool *found)
{
    const watcher *w = self;
    return w->site->end(w->site->self, a->t, a->change, b->t, b->change, found);
}

/* Evaluates what depends only on parameters, and marks what conditions need in the present modes. */
static void begin(watcher *w, bool *needed)
{
    const kmp_bound open = {-INFINITY, INFINITY, -INFINITY, INFINITY};
    const int steps = w->code.steps;
    for (int k = 0; k < w->watch->inputs; k++)
        w->value[w->watch->constants + k] =
            w->watch->input[2 * (ptrdiff_t)k] < KEMPE_WATCH_STILL ? open : input_over(w, k, NULL);
    w->code.steps = w->code.fixed;
    kmp_bound_run(&w->code, 0, w->value);
    w->code.steps = steps;
    memset(needed, 0, (size_t)kmp_bound_values(&w->code) * sizeof *needed);
    for (int k = 0; k < w->site->conditions; k++)
        if (may_change(w, k))
            needed[w->watch->output[k] >> 1] = true;
    kmp_bound_mark(&w->code, w->value, needed);
    w->code.needed = needed;
}

/* -- the search ---------------------------------------------------------------------------------------- */

static double *take_room(double **at, int count)
{
    double *room = *at;
    *at += count;
    return room;
}

int kempe_watch_search(const kempe_watch *watch, double *room, const kmp_watch_site *site, double from, double to,
                       int *found)
{
    static const kmp_piece_site pieces = {look, bind, bound_of, may_change, is_held, end_piece};
    const int conditions = site->conditions;
    watcher w;
    double *at = room;
    bool any = false;
    memset(&w, 0, sizeof w);
    w.watch = watch;
    w.site = site;
    w.code.constants = watch->constants;
    w.code.inputs = watch->inputs;
    w.code.steps = watch->steps;
    w.code.fixed = watch->fixed;
    w.code.constant = watch->constant;
    w.code.step = (const kmp_bound_step *)(const void *)watch->step;
    w.code.tables = watch->table;
    w.code.table = bound_table;
    w.value = (kmp_bound *)(void *)take_room(&at, 4 * (watch->constants + watch->inputs + watch->steps));
    w.pieces.site = &pieces;
    w.pieces.self = &w;
    w.pieces.conditions = conditions;
    for (int i = 0; i < KMP_SEARCH_LOOKS; i++) {
        w.pieces.look[i].change = take_room(&at, conditions);
        w.pieces.look[i].state = take_room(&at, 2 * watch->inputs);
        w.pieces.look[i].solved = take_room(&at, watch->solved);
    }
    bool *third = (bool *)(void *)at;
    w.pieces.open = third + conditions;
    w.pieces.third = third;
    for (int k = 0; k < conditions; k++)
        third[k] = (watch->traits[k] & KEMPE_WATCH_MIDDLE) != 0;
    begin(&w, third + conditions * (KMP_SEARCH_DEPTH + 2));
    int status = look(&w, from, &w.pieces.look[0]);
    if (status == 0)
        status = look(&w, to, &w.pieces.look[1]);
    if (status == 0)
        memcpy(site->last, w.pieces.look[1].change, (size_t)conditions * sizeof *site->last);
    if (status == 0)
        status = kmp_pieces_search(&w.pieces, &any);
    *found = any;
    return status == 0 && w.pieces.undecided > 0 ? KMP_WATCH_UNDECIDED + w.pieces.which : status;
}
