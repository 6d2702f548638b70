/* SPDX-License-Identifier: BSD-3-Clause */
/* The past of a signal as Chebyshev polynomials: a step is halved until the last coefficients are far below the
 * tolerance, and evaluated by Clenshaw's recurrence with three derivatives. */
#include "model/data/past_signals.h"
#include "base/context.h"
#include "base/memory.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    NODES = KMP_PAST_DEGREE + 1,
    LEVELS = 52,        /* halvings of a step: to the rounding of the time */
    PATIENCE = 4,       /* generations of halves, none accurate, before rounding is suspected */
    MOST_PIECES = 50000 /* of a step: some megabytes, or ten thousand oscillations */
};
/* A part of the time that rounding of times cannot change, in units of it. */
static const double INSTANT = 1024;

kmp_past *kmp_past_new(int count)
{
    kmp_past *past = KMP_NEW(kmp_past, 1);
    kmp_past_signal *signals = KMP_NEW(kmp_past_signal, count);
    if (past && signals) {
        *past = (kmp_past){.count = count, .signal = signals};
        return past;
    }
    kmp_free(past);
    kmp_free(signals);
    return NULL;
}

void kmp_past_free(kmp_past *past)
{
    for (int k = 0; past && k < past->count; k++)
        kmp_free(past->signal[k].piece);
    if (past)
        kmp_free(past->signal);
    kmp_free(past);
}

kmp_past *kmp_past_copy(const kmp_past *past)
{
    kmp_past *copy = kmp_past_new(past->count);
    if (!copy)
        return NULL;
    copy->known = past->known;
    for (int k = 0; k < past->count; k++) {
        const kmp_past_signal *from = &past->signal[k];
        kmp_past_signal *to = &copy->signal[k];
        *to = *from;
        to->piece = NULL;
        for (to->count = 0; to->count < from->count; to->count++) {
            kmp_past_piece *room = kmp_list_room(to->piece, (size_t)to->count, sizeof *room);
            if (!room) {
                kmp_past_free(copy);
                return NULL;
            }
            to->piece = room;
            room[to->count] = from->piece[to->count];
        }
    }
    return copy;
}

/* -- polynomials ------------------------------------------------------------------------------------- */

/* cos(pi m / KMP_PAST_DEGREE), m >= 0: in a table, because signals need it more often than anything else. */
static double cosine(int m)
{
    static const double table[2 * KMP_PAST_DEGREE] = {
        1,  0.92387953251128674,  0.70710678118654752,  0.38268343236508977,
        0,  -0.38268343236508977, -0.70710678118654752, -0.92387953251128674,
        -1, -0.92387953251128674, -0.70710678118654752, -0.38268343236508977,
        0,  0.38268343236508977,  0.70710678118654752,  0.92387953251128674};
    return table[m % (2 * KMP_PAST_DEGREE)];
}

/* Node k of [from, to], ascending, the first and the last one at the ends. */
static double past_node(double from, double to, int k)
{
    if (k == 0 || k == KMP_PAST_DEGREE)
        return k == 0 ? from : to;
    return 0.5 * (from + to) - 0.5 * (to - from) * cosine(k);
}

/* The coefficient of Chebyshev's polynomial i: a cosine sum over the nodes, of which the ends count half. */
static double coefficient(const double *values, int i)
{
    double sum = 0;
    for (int k = 0; k < NODES; k++) {
        double part = k == 0 || k == KMP_PAST_DEGREE ? 0.5 : 1;
        sum += part * values[k] * cosine(i * (KMP_PAST_DEGREE - k));
    }
    return (i == 0 || i == KMP_PAST_DEGREE ? 1.0 : 2.0) * sum / KMP_PAST_DEGREE;
}

/* The part of a polynomial by given values that one of lower degree does not have. */
static double past_tail(const double *values)
{
    return fmax(fabs(coefficient(values, KMP_PAST_DEGREE)), 0.1 * fabs(coefficient(values, KMP_PAST_DEGREE - 1)));
}

static void set_piece(kmp_past_piece *piece, double from, double to, int jump, const double *values)
{
    *piece = (kmp_past_piece){.from = from, .to = to, .jump = jump};
    for (int i = 0; i < NODES; i++)
        piece->c[i] = coefficient(values, i);
}

bool kmp_past_add(kmp_past_signal *signal, double from, double to, const double *values)
{
    kmp_past_piece *room = kmp_list_room(signal->piece, (size_t)signal->count, sizeof *room);
    if (!room)
        return false;
    signal->piece = room;
    set_piece(&room[signal->count++], from, to, signal->jump, values);
    signal->jump = KMP_PAST_SMOOTH;
    return true;
}

/* -- recording --------------------------------------------------------------------------------------- */

int kmp_past_room(int signals)
{
    return signals * NODES * (LEVELS + 1);
}

/* A step under way. */
typedef struct recording {
    const kmp_past_source *x;
    int pieces, fast; /* so far; the signal that was worst last */
} recording;

static double *values_of(const kmp_past_source *x, int depth, int k)
{
    return x->room + ((ptrdiff_t)depth * x->past->count + k) * NODES;
}

/* A signal from its values at all nodes: what its polynomial lacks, over the tolerance. */
static double excess(const kmp_past_source *x, int k, const double *values)
{
    double size = 0;
    for (int i = 0; i < NODES; i++)
        size = fmax(size, fabs(values[i]));
    return past_tail(values) / fmax(x->tolerance(x->user, k, size), x->past->signal[k].rounding);
}

/* The largest excess of all signals over a part of the step. */
static kempe_status sample_part(recording *r, double from, double to, int depth, double *most)
{
    const kmp_past_source *x = r->x;
    const double *now;
    *most = 0;
    for (int i = 0; i < NODES; i++) {
        KMP_TRY(x->sample(x->user, past_node(from, to, i), &now));
        for (int k = x->first; k <= x->last; k++)
            values_of(x, depth, k)[i] = now[k];
    }
    for (int k = x->first; k <= x->last; k++) {
        double by = excess(x, k, values_of(x, depth, k));
        r->fast = by > *most ? k : r->fast;
        *most = fmax(*most, by);
    }
    return KEMPE_OK;
}

static bool is_divisible(double from, double to, int depth)
{
    return depth < LEVELS && to - from > INSTANT * DBL_EPSILON * fmax(fabs(from), fabs(to));
}

/* Follows halves of a part, each other side in turn. A part that is not accurate down to the rounding of the time is
 * rounding of the signals, which they have from then on. */
static kempe_status find_rounding(recording *r, double from, double to, int depth)
{
    const kmp_past_source *x = r->x;
    double most = INFINITY;
    for (; most > 1 && is_divisible(from, to, depth); depth++) {
        double middle = 0.5 * (from + to);
        *(depth % 2 ? &from : &to) = middle;
        KMP_TRY(sample_part(r, from, to, depth + 1, &most));
    }
    for (int k = x->first; most > 1 && k <= x->last; k++) {
        double lacks = past_tail(values_of(x, depth, k));
        if (excess(x, k, values_of(x, depth, k)) > 1)
            x->past->signal[k].rounding = 4 * lacks;
    }
    return KEMPE_OK;
}

/* `rough`: generations without an accurate polynomial. */
static kempe_status record(recording *r, double from, double to, int depth, int rough)
{
    const kmp_past_source *x = r->x;
    double most, middle = 0.5 * (from + to);
    KMP_TRY(sample_part(r, from, to, depth, &most));
    if (most > 1 && rough > 0 && rough % PATIENCE == 0) {
        KMP_TRY(find_rounding(r, from, to, depth));
        KMP_TRY(sample_part(r, from, to, depth, &most));
    }
    if (most > 1 && is_divisible(from, to, depth)) {
        if (r->pieces > MOST_PIECES)
            return KEMPE_STOPPED;
        KMP_TRY(record(r, from, middle, depth + 1, rough + 1));
        return record(r, middle, to, depth + 1, rough + 1);
    }
    r->pieces++;
    for (int k = x->first; k <= x->last; k++)
        if (!kmp_past_add(&x->past->signal[k], from, to, values_of(x, depth, k)))
            return KEMPE_E_MEMORY;
    return KEMPE_OK;
}

kempe_status kmp_past_record(const kmp_past_source *source, double from, double to, int *fast)
{
    recording r = {.x = source};
    kempe_status status = record(&r, from, to, 0, 0);
    *fast = r.fast;
    return status;
}

/* -- pieces ------------------------------------------------------------------------------------------ */

void kmp_past_drop(kmp_past_signal *signal, double first)
{
    int gone = (int)(first - signal->dropped);
    if (gone <= 0)
        return;
    signal->count -= gone;
    signal->dropped = first;
    memmove(signal->piece, signal->piece + gone, (size_t)signal->count * sizeof *signal->piece);
}

double kmp_past_last(const kmp_past_signal *signal, double number)
{
    while (kmp_past_has(signal, number + 1) && kmp_past_piece_of(signal, number + 1)->jump >= KMP_PAST_SMOOTH)
        number++;
    return number;
}

void kmp_past_cut(kmp_past *past, double t)
{
    for (int k = 0; k < past->count; k++) {
        kmp_past_signal *signal = &past->signal[k];
        while (signal->count > 1 && signal->piece[signal->count - 1].from >= t)
            signal->count--;
        kmp_past_piece *last = &signal->piece[signal->count - 1];
        double number = signal->dropped + signal->count - 1, values[NODES], u[4];
        for (int i = 0; i < NODES; i++) {
            kmp_past_values(signal, number, number, past_node(last->from, t, i) + signal->delay, u);
            values[i] = u[0];
        }
        if (last->to > t)
            set_piece(last, last->from, t, last->jump, values);
    }
    past->known = t;
}

/* A step of Clenshaw's recurrence for the sum of coefficients times T_k(x). */
typedef struct clenshaw {
    double b, before;
} clenshaw;

static inline void step(clenshaw *sum, double x, double c)
{
    const double next = 2 * x * sum->b - sum->before + c;
    sum->before = sum->b;
    sum->b = next;
}

/* The value and three derivatives together. Coefficients of a derivative by x follow from those before it: c'[k-1] =
 * c'[k+1] + 2 k c[k], and half of it for k = 1. */
void kmp_past_values(const kmp_past_signal *signal, double first, double last, double t, double values[4])
{
    /* The last of the pieces that begins at `at` or before, or else the first one. */
    double at = t - signal->delay;
    int low = (int)(first - signal->dropped), high = (int)(last - signal->dropped);
    while (low < high) {
        int middle = high - (high - low) / 2;
        if (signal->piece[middle].from <= at)
            low = middle;
        else
            high = middle - 1;
    }
    const kmp_past_piece *piece = &signal->piece[low];
    const double half = 0.5 * (piece->to - piece->from);
    double x = (t - signal->delay - piece->from) / half - 1;
    x = fmin(fmax(x, -1), 1); /* beyond its ends by rounding, or where a first step is estimated */
    clenshaw u = {0}, u1 = {0}, u2 = {0}, u3 = {0};
    double c1 = 0, c2 = 0, c3 = 0, above1 = 0, above2 = 0, above3 = 0; /* c'[k] of each, and c'[k+1] */
    for (int k = KMP_PAST_DEGREE; k > 0; k--) {
        const double c = piece->c[k];
        const double below1 = above1 + 2 * k * c, below2 = above2 + 2 * k * c1, below3 = above3 + 2 * k * c2;
        step(&u, x, c);
        step(&u1, x, c1);
        step(&u2, x, c2);
        step(&u3, x, c3);
        above1 = c1, above2 = c2, above3 = c3;
        c1 = below1, c2 = below2, c3 = below3;
    }
    const double by_t = 1 / half, by_t2 = by_t / half, by_t3 = by_t2 / half;
    values[0] = x * u.b - u.before + piece->c[0];
    values[1] = by_t * (x * u1.b - u1.before + 0.5 * c1);
    values[2] = by_t2 * (x * u2.b - u2.before + 0.5 * c2);
    values[3] = by_t3 * (x * u3.b - u3.before + 0.5 * c3);
}
