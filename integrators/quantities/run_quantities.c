/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/quantities/run_quantities.h"
#include "integrators/quantities/smooth_piece.h"
#include <math.h>
#include <string.h>

/* Halvings of a step, and pieces of one: at a kink the polynomials end with an error of the order of the shortest
 * piece. A value that is nothing but rounding is not smooth anywhere, and is given up after so many pieces. */
enum { MOST_HALVINGS = 10, MOST_PIECES = 48 };

/* Numbers of a quantity in an account: the value so far and its time, and the other extreme of a range. */
enum { VALUE, TIME, OTHER, NUMBERS };

int kmp_run_quantity_width(kmp_run_quantity_kind kind)
{
    return kind == KMP_TAKE_MAX || kind == KMP_TAKE_MIN ? 2 : 1;
}

bool kmp_run_quantity_inside(kmp_run_quantity_kind kind)
{
    return kind != KMP_TAKE_END;
}

/* An account: the numbers of each quantity, then of each channel its largest size. */
size_t kmp_account_size(const kmp_run_quantities *q)
{
    return (size_t)NUMBERS * (size_t)q->count + (size_t)q->channels;
}

/* The values at the points of a piece, by points. */
size_t kmp_account_piece(const kmp_run_quantities *q)
{
    return (size_t)KMP_PIECE_POINTS * (size_t)q->channels;
}

/* A piece of every level of halving. */
size_t kmp_account_room(const kmp_run_quantities *q)
{
    return (1 + MOST_HALVINGS) * kmp_account_piece(q);
}

void kmp_account_begin(const kmp_run_quantities *q, double *account)
{
    memset(account, 0, kmp_account_size(q) * sizeof *account);
    for (int k = 0; k < q->count; k++) {
        double *x = account + (ptrdiff_t)NUMBERS * k;
        x[TIME] = NAN;
        switch (q->of[k].kind) {
        case KMP_TAKE_MAX:
            x[VALUE] = -INFINITY;
            break;
        case KMP_TAKE_MIN:
            x[VALUE] = INFINITY;
            break;
        case KMP_TAKE_RANGE:
            x[VALUE] = -INFINITY;
            x[OTHER] = INFINITY;
            break;
        case KMP_TAKE_AT:
        case KMP_TAKE_FIRST:
            x[VALUE] = NAN;
            break;
        default:
            break;
        }
    }
}

/* True if a quantity takes part in an interval that has no begin or end of a span inside. */
static bool covers(const kmp_run_quantity *q, double from, double to)
{
    return !q->spanned || (from >= q->begin && to <= q->end);
}

/* -- one quantity on one piece ------------------------------------------------------------------------- */

static void take_largest(const kmp_piece *piece, double sign, double *value, double *time)
{
    double low, high, x[KMP_PIECE_POINTS];
    kmp_piece_bounds(piece, &low, &high);
    if ((sign > 0 ? high : -low) <= *value * sign)
        return;
    int count = kmp_piece_turns(piece, x);
    for (int k = 0; k < count; k++) {
        double at = kmp_piece_value(piece, x[k]);
        if (at * sign > *value * sign) {
            *value = at;
            if (time)
                *time = kmp_piece_time(piece, x[k]);
        }
    }
}

static bool holds_at(const kmp_run_quantity *q, double value)
{
    return q->or_equal ? value <= 0 : value < 0;
}

/* The condition begins to hold at t; `start`: it holds from the start, which is no beginning. */
static void begin_to_hold(const kmp_run_quantity *q, double t, bool start, double *x)
{
    if (q->kind == KMP_TAKE_COUNT)
        x[VALUE] += !start;
    else if (q->kind == KMP_TAKE_FIRST && isnan(x[VALUE]))
        x[VALUE] = t;
}

/* Between two turns the condition changes at most once. OTHER: 1 where it holds, else 0; TIME: until then. */
static void take_condition(const kmp_run_quantity *q, const kmp_piece *piece, double *x)
{
    double turn[KMP_PIECE_POINTS];
    int count = kmp_piece_turns(piece, turn);
    for (int k = 0; k < count; k++) {
        bool holds = holds_at(q, kmp_piece_value(piece, turn[k])), before = x[OTHER] > 0;
        double t = kmp_piece_time(piece, turn[k]);
        bool first = isnan(x[TIME]);
        double change = t;
        if (!first && k > 0 && holds != before)
            change = kmp_piece_time(piece, kmp_piece_zero(piece, turn[k - 1], turn[k]));
        if (holds && (first || !before))
            begin_to_hold(q, change, first, x);
        if (q->kind == KMP_TAKE_DURATION && !first)
            x[VALUE] += before ? change - x[TIME] : 0;
        if (q->kind == KMP_TAKE_DURATION && holds && !before)
            x[VALUE] += t - change;
        x[TIME] = t;
        x[OTHER] = holds;
    }
}

static void take_piece(const kmp_run_quantity *q, const kmp_piece *piece, const kmp_piece *square, double *x)
{
    switch (q->kind) {
    case KMP_TAKE_MAX:
        take_largest(piece, 1, &x[VALUE], &x[TIME]);
        break;
    case KMP_TAKE_MIN:
        take_largest(piece, -1, &x[VALUE], &x[TIME]);
        break;
    case KMP_TAKE_RANGE:
        take_largest(piece, 1, &x[VALUE], NULL);
        take_largest(piece, -1, &x[OTHER], NULL);
        break;
    case KMP_TAKE_MEAN:
    case KMP_TAKE_INTEGRAL:
        x[VALUE] += kmp_piece_integral(piece);
        break;
    case KMP_TAKE_RMS:
        x[VALUE] += kmp_piece_integral(square);
        break;
    case KMP_TAKE_FIRST:
    case KMP_TAKE_COUNT:
    case KMP_TAKE_DURATION:
        take_condition(q, piece, x);
        break;
    default:
        break;
    }
}

/* -- a step ------------------------------------------------------------------------------------------- */

/* A step under way, and a part of it. */
typedef struct measuring {
    const kmp_run_quantities *q;
    double *account, *room;
    const kmp_measured_step *step;
    int pieces;
} measuring;

typedef struct part {
    double from, to;
    int halvings, index; /* one of 2^halvings parts of the step */
} part;

static double *values_at(const measuring *m, const part *at, int point)
{
    return m->room + (size_t)at->halvings * kmp_account_piece(m->q) + (size_t)(point * m->q->channels);
}

/* The channels at points of a part, one by one. */
static bool sample_points(const measuring *m, const part *at, int first, int last)
{
    for (int k = first; k <= last; k++) {
        double x = kmp_piece_point(k);
        double t = x <= -1 ? at->from : x >= 1 ? at->to : at->from + 0.5 * (1 + x) * (at->to - at->from);
        if (!m->step->channels(m->step->user, t, values_at(m, at, k)))
            return false;
    }
    return true;
}

/* The ends of a half are points of the piece that it is half of. */
static bool sample(const measuring *m, const part *at)
{
    enum { LAST = KMP_PIECE_POINTS - 1, MIDDLE = LAST / 2 };
    size_t bytes = (size_t)m->q->channels * sizeof *m->room;
    if (at->halvings == 0 && m->step->sampled) {
        memcpy(m->room, m->step->sampled, KMP_PIECE_POINTS * bytes);
        return true;
    }
    if (at->halvings == 0)
        return sample_points(m, at, 0, LAST);
    const part whole = {.halvings = at->halvings - 1};
    bool right = at->index % 2 == 1;
    memcpy(values_at(m, at, 0), values_at(m, &whole, right ? MIDDLE : 0), bytes);
    memcpy(values_at(m, at, LAST), values_at(m, &whole, right ? LAST : MIDDLE), bytes);
    return (m->step->parts && m->step->parts(m->step->user, at->halvings, at->index, values_at(m, at, 0))) ||
           sample_points(m, at, 1, LAST - 1);
}

static kmp_piece piece_through(const double values[KMP_PIECE_POINTS], bool square, const part *at)
{
    double squares[KMP_PIECE_POINTS];
    for (int k = 0; k < KMP_PIECE_POINTS; k++)
        squares[k] = values[k] * values[k];
    return kmp_piece_of(at->from, at->to, square ? squares : values);
}

/* The values of a channel, or their squares, as a polynomial. */
static kmp_piece piece_of(const measuring *m, int channel, bool square, const part *at)
{
    double values[KMP_PIECE_POINTS];
    for (int k = 0; k < KMP_PIECE_POINTS; k++)
        values[k] = values_at(m, at, k)[channel];
    return piece_through(values, square, at);
}

static void note_sizes(const measuring *m, const part *at)
{
    double *size = m->account + (ptrdiff_t)NUMBERS * m->q->count;
    for (int k = 0; k < KMP_PIECE_POINTS; k++)
        for (int c = 0; c < m->q->channels; c++)
            size[c] = fmax(size[c], fabs(values_at(m, at, k)[c]));
}

/* True for a quantity that depends on all values in a part. */
static bool takes_part(const kmp_run_quantity *q, const part *at)
{
    return q->kind != KMP_TAKE_END && q->kind != KMP_TAKE_AT && covers(q, at->from, at->to);
}

static bool is_smooth_for(const measuring *m, const kmp_run_quantity *q, const part *at)
{
    bool square = q->kind == KMP_TAKE_RMS;
    const kmp_piece piece = piece_of(m, q->channel, square, at);
    double most = m->account[(ptrdiff_t)NUMBERS * m->q->count + q->channel];
    return kmp_piece_error(&piece) <= m->step->rtol * (square ? most * most : most);
}

static bool is_smooth(const measuring *m, const part *at)
{
    for (int k = 0; k < m->q->count; k++)
        if (takes_part(&m->q->of[k], at) && !is_smooth_for(m, &m->q->of[k], at))
            return false;
    return true;
}

/* A jump: straight lines between the points, since a polynomial through all of them passes beyond the values. */
static void take_lines(const measuring *m, const kmp_run_quantity *q, const part *at, double *x)
{
    for (int j = 0; j + 1 < KMP_PIECE_POINTS; j++) {
        double size = 0.5 * (at->to - at->from), line[KMP_PIECE_POINTS];
        double a = values_at(m, at, j)[q->channel], b = values_at(m, at, j + 1)[q->channel];
        const part between = {.from = at->from + size * (1 + kmp_piece_point(j)),
                              .to = at->from + size * (1 + kmp_piece_point(j + 1))};
        for (int k = 0; k < KMP_PIECE_POINTS; k++)
            line[k] = a + 0.5 * (1 + kmp_piece_point(k)) * (b - a);
        const kmp_piece piece = piece_through(line, false, &between), square = piece_through(line, true, &between);
        take_piece(q, &piece, &square, x);
    }
}

static void take(const measuring *m, const part *at)
{
    for (int k = 0; k < m->q->count; k++) {
        const kmp_run_quantity *q = &m->q->of[k];
        double *x = m->account + (ptrdiff_t)NUMBERS * k;
        if (!takes_part(q, at))
            continue;
        if (at->halvings == MOST_HALVINGS && !is_smooth_for(m, q, at)) {
            take_lines(m, q, at, x);
            continue;
        }
        const kmp_piece piece = piece_of(m, q->channel, false, at),
                        square = q->kind == KMP_TAKE_RMS ? piece_of(m, q->channel, true, at) : piece;
        take_piece(q, &piece, &square, x);
    }
}

/* Pieces in the order of time. */
static bool measure(measuring *m, const part *at)
{
    if (!sample(m, at))
        return false;
    note_sizes(m, at);
    double middle = at->from + 0.5 * (at->to - at->from);
    bool splits = at->halvings < MOST_HALVINGS && m->pieces < MOST_PIECES && middle > at->from && middle < at->to;
    if (!splits || is_smooth(m, at)) {
        take(m, at);
        return true;
    }
    m->pieces++;
    const part left = {at->from, middle, at->halvings + 1, 2 * at->index},
               right = {middle, at->to, at->halvings + 1, 2 * at->index + 1};
    return measure(m, &left) && measure(m, &right);
}

/* Values at given times within the step, or at the start. */
static bool take_times(const measuring *m, double from, double to)
{
    for (int k = 0; k < m->q->count; k++) {
        const kmp_run_quantity *q = &m->q->of[k];
        double *x = m->account + (ptrdiff_t)NUMBERS * k;
        if (q->kind != KMP_TAKE_AT || !isnan(x[TIME]) || !(q->time >= from && q->time <= to))
            continue;
        if (!m->step->channels(m->step->user, q->time, m->room))
            return false;
        x[VALUE] = m->room[q->channel];
        x[TIME] = q->time;
    }
    return true;
}

/* The first begin or end of a span between two times, or the later one of them. */
static double next_cut(const kmp_run_quantities *q, double from, double to)
{
    double cut = to;
    for (int k = 0; k < q->count; k++) {
        const double at[] = {q->of[k].begin, q->of[k].end};
        for (int i = 0; i < 2; i++)
            if (q->of[k].spanned && at[i] > from && at[i] < cut)
                cut = at[i];
    }
    return cut;
}

/* From one cut of the step to the next; known points belong to the whole step alone. */
static bool measure_between(const kmp_run_quantities *q, double *account, double *room, const kmp_measured_step *step)
{
    double from = step->from, to;
    while (from < step->to) {
        to = next_cut(q, from, step->to);
        kmp_measured_step between = *step;
        if (from > step->from || to < step->to) {
            between.from = from;
            between.to = to;
            between.sampled = NULL;
            between.parts = NULL;
        }
        measuring m = {q, account, room, &between, 0};
        const part whole = {.from = from, .to = to};
        bool needed = false;
        for (int k = 0; k < q->count; k++)
            needed = needed || takes_part(&q->of[k], &whole);
        if (needed && !measure(&m, &whole))
            return false;
        from = to;
    }
    return true;
}

bool kmp_account_step(const kmp_run_quantities *q, double *account, double *room, const kmp_measured_step *step)
{
    const measuring m = {q, account, room, step, 0};
    return take_times(&m, step->from, step->to) && measure_between(q, account, room, step);
}

/* -- steps that change nothing --------------------------------------------------------------------------- */

bool kmp_quantities_may_pass(const kmp_run_quantities *q)
{
    for (int k = 0; k < q->count; k++)
        if (q->of[k].kind == KMP_TAKE_MEAN || q->of[k].kind == KMP_TAKE_RMS || q->of[k].kind == KMP_TAKE_INTEGRAL)
            return false;
    return q->inside;
}

/* True if a quantity of values between two bounds is what it was before. */
static bool stays(const kmp_run_quantity *q, const kmp_measured_step *step, double low, double high, const double *x)
{
    bool known = !isnan(x[TIME]), never = low > 0, always = high < 0;
    if (q->spanned && (step->to <= q->begin || step->from >= q->end))
        return true;
    if (!covers(q, step->from, step->to))
        return false;
    switch (q->kind) {
    case KMP_TAKE_END:
        return true;
    case KMP_TAKE_AT:
        return known || !(q->time >= step->from && q->time <= step->to);
    case KMP_TAKE_MAX:
        return high <= x[VALUE];
    case KMP_TAKE_MIN:
        return low >= x[VALUE];
    case KMP_TAKE_RANGE:
        return high <= x[VALUE] && low >= x[OTHER];
    case KMP_TAKE_FIRST:
        return !isnan(x[VALUE]) || (known && never);
    case KMP_TAKE_COUNT:
    case KMP_TAKE_DURATION:
        return known && (x[OTHER] > 0 ? always : never);
    default:
        return false;
    }
}

static void pass(const kmp_run_quantity *q, const kmp_measured_step *step, double *x)
{
    if (!covers(q, step->from, step->to))
        return;
    if (q->kind == KMP_TAKE_DURATION && x[OTHER] > 0)
        x[VALUE] += step->to - x[TIME];
    if (q->kind == KMP_TAKE_FIRST || q->kind == KMP_TAKE_COUNT || q->kind == KMP_TAKE_DURATION)
        x[TIME] = step->to;
}

bool kmp_account_pass(const kmp_run_quantities *q, double *account, const kmp_measured_step *step)
{
    double *size = account + (ptrdiff_t)NUMBERS * q->count;
    for (int k = 0; k < q->count; k++) {
        const kmp_run_quantity *of = &q->of[k];
        double values[KMP_PIECE_POINTS], low = 0, high = 0;
        for (int j = 0; j < KMP_PIECE_POINTS && of->kind != KMP_TAKE_END && of->kind != KMP_TAKE_AT; j += 2)
            values[j] = step->sampled[j * q->channels + of->channel];
        if (of->kind != KMP_TAKE_END && of->kind != KMP_TAKE_AT)
            kmp_piece_rough_bounds(values, &low, &high);
        if (!stays(of, step, low, high, account + (ptrdiff_t)NUMBERS * k))
            return false;
    }
    for (int k = 0; k < q->count; k++)
        pass(&q->of[k], step, account + (ptrdiff_t)NUMBERS * k);
    for (int c = 0; c < q->channels; c++)
        for (int j = 0; j < KMP_PIECE_POINTS; j += 2)
            size[c] = fmax(size[c], fabs(step->sampled[j * q->channels + c]));
    return true;
}

void kmp_account_values(const kmp_run_quantities *q, const double *account, double t_start, double t_end,
                        const double *end, double *values)
{
    for (int k = 0; k < q->count; k++) {
        const kmp_run_quantity *of = &q->of[k];
        const double *x = account + (ptrdiff_t)NUMBERS * k;
        double *v = values + of->first_value;
        double span = of->spanned ? fmin(of->end, t_end) - fmax(of->begin, t_start) : t_end - t_start;
        v[0] = x[VALUE];
        if (of->spanned && !(span > 0))
            v[0] = NAN;
        else if (of->kind == KMP_TAKE_END)
            v[0] = end[of->channel];
        else if (of->kind == KMP_TAKE_RANGE)
            v[0] = x[VALUE] - x[OTHER];
        else if (of->kind == KMP_TAKE_MEAN)
            v[0] = x[VALUE] / span;
        else if (of->kind == KMP_TAKE_RMS)
            v[0] = sqrt(fmax(x[VALUE] / span, 0));
        if (kmp_run_quantity_width(of->kind) == 2)
            v[1] = x[TIME];
    }
}
