/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/events/event_pieces.h"
#include <math.h>
#include <string.h>

enum {
    MOST_LOOKS = 100000, /* evaluations in one step, without the ones that narrow a change */
    FEW_LOOKS = 256,     /* the same after a step in which this number of evaluations has not decided */
    ZERO_FROM = 5,       /* number of halvings from which a condition that is exactly zero at three points counts as
                          * constantly zero */
    CONSTANT_FROM = 2    /* likewise one that is the same at three points but for rounding, by cancellation */
};

/* Cancellation: the value is below this part of the width of its bounds, and varies by less than this part of itself.
 * Bounds of two bodies that move together do not know that their distance stays. */
#define CANCELLED 1e-6
#define VARIES    0.0625

/* A polynomial of higher degree may exceed the control values of the cubic by this part of their distance from the
 * chord. It does not at twice the longest steps that integrators take of an oscillation, half a period. */
#define SLACK 0.25
/* Slack of a parabola: this part of its bend, and for its rates this part of their change. */
#define PARABOLA_SLACK 0.5

/* -- bounds over a piece ------------------------------------------------------------------------------ */

/* The compiler makes instructions of these comparisons, and calls of fmin and fmax. */
static double least_of(double a, double b)
{
    return a < b ? a : b;
}

static double most_of(double a, double b)
{
    return a > b ? a : b;
}

static void widen(double *low, double *high, double by)
{
    *low = least_of(*low, by);
    *high = most_of(*high, by);
}

KMP_LOCAL kmp_bound kmp_bound_over(double h, double x, double x_rate, double y, double y_rate)
{
    double a = x + h * x_rate / 3, b = y - h * y_rate / 3, between = 3 * (b - a) / h;
    double off = SLACK * most_of(fabs(a - (2 * x + y) / 3), fabs(b - (x + 2 * y) / 3));
    double rate_off = SLACK * fabs(between - (x_rate + y_rate) / 2);
    kmp_bound r = {least_of(x, y), most_of(x, y), least_of(x_rate, y_rate), most_of(x_rate, y_rate)};
    widen(&r.low, &r.high, a);
    widen(&r.low, &r.high, b);
    widen(&r.down, &r.up, between);
    return (kmp_bound){r.low - off, r.high + off, r.down - rate_off, r.up + rate_off};
}

KMP_LOCAL kmp_bound kmp_bound_through(double h, double x, double z, double y)
{
    double curvature = z - (x + y) / 2, control = z + curvature, off = PARABOLA_SLACK * fabs(curvature);
    double at_x = 2 * (control - x) / h, at_y = 2 * (y - control) / h, rate_off = PARABOLA_SLACK * fabs(at_y - at_x);
    kmp_bound r = {least_of(x, y), most_of(x, y), least_of(at_x, at_y), most_of(at_x, at_y)};
    widen(&r.low, &r.high, control);
    return (kmp_bound){r.low - off, r.high + off, r.down - rate_off, r.up + rate_off};
}

KMP_LOCAL kmp_bound kmp_bound_still(double x)
{
    return (kmp_bound){x, x, 0, 0};
}

/* -- decided conditions --------------------------------------------------------------------------------- */

/* The least possible value of a quantity between x and y, at a time distance h, with a rate within [down, up]. Without
 * a bound on the rate, as of the size of a reaction that may be zero, the ends show nothing. */
static double cone(double h, double x, double y, double down, double up)
{
    if (!(up - down < INFINITY))
        return -INFINITY;
    if (!(down < up))
        return fmin(x, y);
    double part = (x - y + up * h) / (up - down); /* of the time, down from x to the latest turn up to y */
    return fmin(fmin(x, y), x + down * fmin(fmax(part, 0), h));
}

/* True if the ends of a piece decide a condition. A fixed condition that holds is below zero; one that does not hold is
 * at least zero. */
static bool is_settled(const kmp_piece_search *s, int k, const kmp_event_probe *a, const kmp_event_probe *b)
{
    kmp_bound r = s->site->bound(s->self, k);
    if (r.down >= 0 || r.up <= 0)
        return true;
    bool holds = s->site->holds(s->self, k);
    double h = b->t - a->t, x = a->change[k], y = b->change[k];
    double low = holds ? fmax(-r.high, cone(h, -x, -y, -r.up, -r.down)) : fmax(r.low, cone(h, x, y, r.down, r.up));
    return holds ? low > 0 : low >= 0;
}

/* True if a condition is constant by cancellation at the three points of a piece, over which it has been bounded. */
static bool stays_by_cancellation(const kmp_piece_search *s, int k, const kmp_step_piece *p)
{
    const double a = p->a->change[k], m = p->m->change[k], b = p->b->change[k];
    const kmp_bound r = s->site->bound(s->self, k);
    return fmax(fabs(a - m), fabs(b - m)) <= VARIES * fabs(m) && fabs(m) <= CANCELLED * (r.high - r.low) &&
           r.high - r.low < INFINITY;
}

/* Decides open conditions: conditions that need a third point if the piece has one, otherwise the others. Returns true
 * if any is still open. */
static bool find_open(kmp_piece_search *s, int depth, const kmp_step_piece *p)
{
    int count = s->conditions;
    bool *open = s->open + (size_t)depth * (size_t)count, wanted = false, any = false;
    for (int k = 0; k < count && !wanted; k++)
        wanted = open[k] && s->third[k] == (p->m != NULL);
    if (wanted && depth >= s->least)
        s->site->bind(s->self, p, open);
    for (int k = 0; k < count; k++) {
        if (!open[k])
            continue;
        if (p->m && depth >= ZERO_FROM && p->a->change[k] == 0 && p->m->change[k] == 0 && p->b->change[k] == 0)
            open[k] = false; /* by cancellation, as the difference of two equal coordinates: bounds have both signs */
        if (p->m && open[k] && depth >= CONSTANT_FROM && depth >= s->least && stays_by_cancellation(s, k, p))
            open[k] = false;
        if (s->third[k] == (p->m != NULL) && depth >= s->least)
            open[k] = open[k] && !is_settled(s, k, p->a, p->b);
        any = any || open[k];
    }
    return any;
}

/* Starts with the conditions that were open in the parent piece. */
static void begin_piece(kmp_piece_search *s, int depth)
{
    size_t count = (size_t)s->conditions;
    bool *open = s->open + (size_t)depth * count;
    if (depth > 0)
        memcpy(open, open - count, count * sizeof *open);
    for (size_t k = 0; depth == 0 && k < count; k++)
        open[k] = s->site->may_change(s->self, (int)k);
}

/* -- the search -------------------------------------------------------------------------------------- */

/* Counts a piece that stays undecided. */
static void note_undecided(kmp_piece_search *s, int depth, double t)
{
    const bool *open = s->open + (size_t)depth * (size_t)s->conditions;
    int k = 0;
    while (k + 1 < s->conditions && !open[k])
        k++;
    if (s->undecided++ == 0) {
        s->which = k;
        s->since = t;
    }
}

static int search_piece(kmp_piece_search *s, int depth, const kmp_event_probe *a, const kmp_event_probe *b, bool *found)
{
    kmp_event_probe *m = &s->look[depth + 2];
    double middle = a->t + (b->t - a->t) / 2;
    kmp_step_piece ends = {a, NULL, b};
    begin_piece(s, depth);
    bool open = find_open(s, depth, &ends) && middle > a->t && middle < b->t;
    if (open && s->left == 0)
        note_undecided(s, depth, a->t);
    if (!open || s->left == 0)
        return s->site->end(s->self, a, b, found);
    s->left--;
    int status = s->site->look(s->self, middle, m);
    if (status != 0)
        return status;
    ends.m = m;
    bool deeper = find_open(s, depth, &ends) && depth < KMP_SEARCH_DEPTH;
    status = deeper ? search_piece(s, depth + 1, a, m, found) : s->site->end(s->self, a, m, found);
    if (status != 0 || *found)
        return status;
    return deeper ? search_piece(s, depth + 1, m, b, found) : s->site->end(s->self, m, b, found);
}

KMP_LOCAL int kmp_pieces_search(kmp_piece_search *s, bool *found)
{
    s->left = s->undecided > 0 ? FEW_LOOKS : MOST_LOOKS;
    return search_piece(s, 0, &s->look[0], &s->look[1], found);
}

KMP_LOCAL bool kmp_pieces_are_clear(kmp_piece_search *s, const kmp_step_piece *piece)
{
    const kmp_step_piece ends = {piece->a, NULL, piece->b};
    begin_piece(s, 0);
    return !find_open(s, 0, &ends) || (piece->m && !find_open(s, 0, piece));
}
