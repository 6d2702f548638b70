/* SPDX-License-Identifier: BSD-3-Clause */
/* Extremes, integrals and conditions of a run, from polynomials over halved parts of each step. A part is resolved when
 * the last coefficients of every quantity that takes part are below its tolerance; kinks are located and cut at, jumps
 * become straight lines. Arguments of functions are watched, too, since a function can hide a peak between samples. */
#include "output/quantities/run_quantities.h"
#include "base/text.h"
#include "output/quantities/smooth_piece.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    LEVELS = 52,      /* halvings of a step: to the rounding of the time */
    LANE_LEVELS = 30, /* of which parts are evaluated in lanes */
    PATIENCE = 4,     /* generations of parts none of which is resolved, before rounding is suspected */
    LATE = 8          /* a wave within one point in eight */
};
/* Halvings of a run: seconds for a small mechanism. A sine of 1e5 turns needs 1e5. */
static const double MOST_PARTS = 4e5;
/* A part of the time that rounding of times cannot change, in units of it. */
static const double INSTANT = 1024;
/* A part may lack this multiple of the size of the last terms. */
static const double MARGIN = 8;

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

/* An account: the numbers of each quantity, then of each channel its largest size (of an argument in an exponential
 * its largest value), and the size of its rounding; the number of halvings, and the channel that made the last one. */
enum { HALVINGS, WHICH, COUNTS };

size_t kmp_account_size(const kmp_run_quantities *q)
{
    return (size_t)NUMBERS * (size_t)q->count + 2 * (size_t)q->channels + COUNTS;
}

static double *sizes_of(const kmp_run_quantities *q, double *account)
{
    return account + (ptrdiff_t)NUMBERS * q->count;
}

static double *rounding_of(const kmp_run_quantities *q, double *account)
{
    return sizes_of(q, account) + q->channels;
}

static double *counts_of(const kmp_run_quantities *q, double *account)
{
    return rounding_of(q, account) + q->channels;
}

/* The channel of an argument. */
static int channel_of(const kmp_run_quantities *q, int argument)
{
    return q->channels - q->arguments + argument;
}

/* The values at the points of a piece, by points. */
size_t kmp_account_piece(const kmp_run_quantities *q)
{
    return (size_t)KMP_PIECE_POINTS * (size_t)q->channels;
}

/* The step, and two halves at each level. */
size_t kmp_account_room(const kmp_run_quantities *q)
{
    return (1 + 2 * LEVELS) * kmp_account_piece(q);
}

void kmp_account_begin(const kmp_run_quantities *q, double *account)
{
    static const struct {
        double value, other;
    } first[KMP_TAKE_KINDS] = {[KMP_TAKE_MAX] = {-INFINITY, 0},
                               [KMP_TAKE_MIN] = {INFINITY, 0},
                               [KMP_TAKE_RANGE] = {-INFINITY, INFINITY},
                               [KMP_TAKE_AT] = {NAN, 0},
                               [KMP_TAKE_FIRST] = {NAN, 0}};
    memset(account, 0, kmp_account_size(q) * sizeof *account);
    for (int k = 0; k < q->count; k++) {
        double *x = account + (ptrdiff_t)NUMBERS * k;
        x[VALUE] = first[q->of[k].kind].value;
        x[OTHER] = first[q->of[k].kind].other;
        x[TIME] = NAN;
    }
    for (int k = 0; k < q->arguments; k++)
        if (q->argument[k].kind == KMP_ARGUMENT_PEAK)
            sizes_of(q, account)[channel_of(q, k)] = -INFINITY;
}

void kmp_account_renew(const kmp_run_quantities *q, double *account)
{
    counts_of(q, account)[HALVINGS] = 0;
}

void kmp_account_round(const kmp_run_quantities *q, double *account, int channel, double size)
{
    double *rounding = &rounding_of(q, account)[channel];
    *rounding = fmax(*rounding, size);
}

/* True if a quantity takes part in an interval that has no begin or end of a span inside. */
static bool covers(const kmp_run_quantity *q, double from, double to)
{
    return !q->spanned || (from >= q->begin && to <= q->end);
}

/* -- one quantity on one piece ------------------------------------------------------------------------- */

static void take_largest(const kmp_smooth_piece *piece, double sign, double *value, double *time)
{
    double low, high, x[KMP_PIECE_POINTS];
    kmp_piece_extremes(piece, &low, &high);
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

/* Between two turns the condition changes at most once. OTHER: 1 where it holds, else 0; TIME: until then. */
static void take_condition(const kmp_run_quantity *q, const kmp_smooth_piece *piece, double *x)
{
    double turn[KMP_PIECE_POINTS];
    int count = kmp_piece_turns(piece, turn);
    for (int k = 0; k < count; k++) {
        const double value = kmp_piece_value(piece, turn[k]), t = kmp_piece_time(piece, turn[k]);
        const bool holds = q->or_equal ? value <= 0 : value < 0;
        const bool before = x[OTHER] > 0;
        const bool first = isnan(x[TIME]); /* what holds from the start is not a beginning */
        double change = t;
        if (!first && k > 0 && holds != before)
            change = kmp_piece_time(piece, kmp_piece_zero(piece, turn[k - 1], turn[k]));
        if (holds && !first && !before && q->kind == KMP_TAKE_COUNT)
            x[VALUE]++;
        if (holds && (first || !before) && q->kind == KMP_TAKE_FIRST && isnan(x[VALUE]))
            x[VALUE] = change;
        if (q->kind == KMP_TAKE_DURATION && !first)
            x[VALUE] += before ? change - x[TIME] : 0;
        if (q->kind == KMP_TAKE_DURATION && holds && !before)
            x[VALUE] += t - change;
        x[TIME] = t;
        x[OTHER] = holds;
    }
}

static void take_piece(const kmp_run_quantity *q, const kmp_smooth_piece *piece, const kmp_smooth_piece *square,
                       double *x)
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
} measuring;

typedef struct part {
    double from, to;
    int halvings;
    long long index; /* one of 2^halvings parts of the step */
    bool equal;      /* of these, which are equal; else it ends at a kink */
} part;

/* The halves at a level have one place each. */
static double *values_at(const measuring *m, const part *at, int point)
{
    size_t place = at->halvings == 0 ? 0 : (size_t)(2 * at->halvings - 1 + at->index % 2);
    return m->room + place * kmp_account_piece(m->q) + (size_t)(point * m->q->channels);
}

/* Records the largest sizes that the channels have had. */
static void note_sizes(const measuring *m, const part *at)
{
    double *size = sizes_of(m->q, m->account);
    for (int k = 0; k < KMP_PIECE_POINTS; k++) {
        const double *value = values_at(m, at, k);
        for (int c = 0; c < m->q->channels; c++) {
            int argument = c - channel_of(m->q, 0);
            bool peak = argument >= 0 && m->q->argument[argument].kind == KMP_ARGUMENT_PEAK;
            size[c] = fmax(size[c], peak ? value[c] : fabs(value[c]));
        }
    }
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

static bool sample_whole(const measuring *m, const part *at)
{
    if (m->step->sampled)
        memcpy(m->room, m->step->sampled, kmp_account_piece(m->q) * sizeof *m->room);
    else if (!sample_points(m, at, 0, KMP_PIECE_POINTS - 1))
        return false;
    note_sizes(m, at);
    return true;
}

/* The ends of a half are points of the part that it is half of. One at a kink is its own. */
static bool sample_half(const measuring *m, const part *whole, const part *half)
{
    enum { LAST = KMP_PIECE_POINTS - 1, MIDDLE = LAST / 2 };
    size_t bytes = (size_t)m->q->channels * sizeof *m->room;
    bool right = half->index % 2 == 1;
    if (right || half->equal)
        memcpy(values_at(m, half, LAST), values_at(m, whole, right ? LAST : MIDDLE), bytes);
    if (!right || half->equal)
        memcpy(values_at(m, half, 0), values_at(m, whole, right ? MIDDLE : 0), bytes);
    bool given = half->equal && m->step->parts && half->halvings <= LANE_LEVELS &&
                 m->step->parts(m->step->user, half->halvings, (int)half->index, values_at(m, half, 0));
    if (!given && !sample_points(m, half, half->equal || !right, half->equal || right ? LAST - 1 : LAST))
        return false;
    note_sizes(m, half);
    return true;
}

/* False for a part within the rounding of times. */
static bool is_divisible(const part *at)
{
    return at->halvings < LEVELS && at->to - at->from > INSTANT * DBL_EPSILON * fmax(fabs(at->from), fabs(at->to));
}

static kmp_smooth_piece piece_through(const double values[KMP_PIECE_POINTS], bool square, const part *at)
{
    double squares[KMP_PIECE_POINTS];
    for (int k = 0; square && k < KMP_PIECE_POINTS; k++)
        squares[k] = values[k] * values[k];
    return kmp_piece_of(at->from, at->to, square ? squares : values);
}

static void values_of(const measuring *m, int channel, const part *at, double values[KMP_PIECE_POINTS])
{
    for (int k = 0; k < KMP_PIECE_POINTS; k++)
        values[k] = values_at(m, at, k)[channel];
}

static kmp_smooth_piece piece_of(const measuring *m, int channel, bool square, const part *at)
{
    double values[KMP_PIECE_POINTS];
    values_of(m, channel, at, values);
    return piece_through(values, square, at);
}

/* True for a quantity of the values in a part. */
static bool takes_part(const kmp_run_quantity *q, const part *at)
{
    return q->kind != KMP_TAKE_END && q->kind != KMP_TAKE_AT && covers(q, at->from, at->to);
}

/* True if values between two bounds do not change an extreme or a condition. */
static bool is_indifferent(const kmp_run_quantity *q, double low, double high, const double *x)
{
    switch (q->kind) {
    case KMP_TAKE_MAX:
        return high <= x[VALUE];
    case KMP_TAKE_MIN:
        return low >= x[VALUE];
    case KMP_TAKE_RANGE:
        return high <= x[VALUE] && low >= x[OTHER];
    case KMP_TAKE_FIRST:
    case KMP_TAKE_COUNT:
    case KMP_TAKE_DURATION:
        return low > 0 || high < 0;
    default:
        return false;
    }
}

/* The error of the polynomial of a quantity, over the tolerance; 0: that does not matter. Errors of integrals add up
 * over the step. `lacks`: the error itself. */
static double excess_of_quantity(const measuring *m, int k, const part *at, double *lacks)
{
    const kmp_run_quantity *q = &m->q->of[k];
    bool square = q->kind == KMP_TAKE_RMS;
    double most = sizes_of(m->q, m->account)[q->channel], rounding = rounding_of(m->q, m->account)[q->channel];
    const kmp_smooth_piece piece = piece_of(m, q->channel, square, at);
    double error = kmp_piece_error(&piece), low, high, part_of_step = 1;
    if (!(fabs(error) < INFINITY)) { /* 2: it has a value at some point */
        for (int p = 0; p < KMP_PIECE_POINTS; p++)
            if (fabs(values_at(m, at, p)[q->channel]) < INFINITY)
                return 2;
        return 0;
    }
    double tolerance = fmax(m->step->rtol * (square ? most * most : most), square ? 2 * most * rounding : rounding);
    *lacks = square ? error / (2 * most) : error;
    if (error <= tolerance)
        return 0;
    if (square || q->kind == KMP_TAKE_MEAN || q->kind == KMP_TAKE_INTEGRAL)
        part_of_step = (at->to - at->from) / (m->step->to - m->step->from);
    kmp_piece_extremes(&piece, &low, &high);
    return is_indifferent(q, low - MARGIN * error, high + MARGIN * error, m->account + (ptrdiff_t)NUMBERS * k)
               ? 0
               : error * part_of_step / tolerance;
}

/* -- arguments ---------------------------------------------------------------------------------------- */

/* An argument in a part: its samples and its least and largest values between each two. */
typedef struct course {
    double sample[KMP_PIECE_POINTS], low[KMP_PIECE_POINTS], high[KMP_PIECE_POINTS];
    double error, most; /* of the polynomial; its largest value */
} course;

static course course_of(const measuring *m, int channel, const part *at)
{
    course c;
    double turn[KMP_PIECE_POINTS];
    values_of(m, channel, at, c.sample);
    const kmp_smooth_piece piece = piece_through(c.sample, false, at);
    c.error = kmp_piece_error(&piece);
    c.most = -INFINITY;
    for (int k = 0; k + 1 < KMP_PIECE_POINTS; k++) {
        c.low[k] = fmin(c.sample[k], c.sample[k + 1]);
        c.high[k] = fmax(c.sample[k], c.sample[k + 1]);
    }
    int count = kmp_piece_turns(&piece, turn), k = 0;
    for (int i = 1; i + 1 < count; i++) {
        double value = kmp_piece_value(&piece, turn[i]);
        while (k + 2 < KMP_PIECE_POINTS && kmp_piece_point(k + 1) < turn[i])
            k++;
        c.low[k] = fmin(c.low[k], value);
        c.high[k] = fmax(c.high[k], value);
    }
    for (k = 0; k + 1 < KMP_PIECE_POINTS; k++)
        c.most = fmax(c.most, c.high[k]);
    return c;
}

/* Exponentials that are smaller than others by these factors, e^40 and e^20, do not count. */
static const double NOTHING = 40, LITTLE = 20;

/* The distance that an argument with a kink, whose polynomial is not accurate, may come toward zero between two
 * samples: as far as with the slopes there. */
static double reach_of(const course *c, int k)
{
    double slope = 0;
    for (int i = k - 1; i <= k + 1; i++)
        if (i >= 0 && i + 1 < KMP_PIECE_POINTS)
            slope = fmax(slope, fabs(c->sample[i + 1] - c->sample[i]) / (kmp_piece_point(i + 1) - kmp_piece_point(i)));
    return slope * (kmp_piece_point(k + 1) - kmp_piece_point(k)) - fabs(c->sample[k] + c->sample[k + 1]) / 2;
}

/* The change of an argument between two samples that these do not show, in units in which 1 is too much. */
static double hidden(kmp_argument_kind kind, const course *c, int k, double largest, double tolerance)
{
    double a = c->sample[k], b = c->sample[k + 1], least = fmin(a, b), most = fmax(a, b);
    double above = c->high[k] - most, below = least - c->low[k];
    switch (kind) {
    case KMP_ARGUMENT_PEAK:
        return fmax(c->high[k] > largest - NOTHING ? above : 0, least > largest - LITTLE ? below : 0);
    case KMP_ARGUMENT_WAVE:
        return fmax(fmax(above, below), fabs(b - a) / 3);
    case KMP_ARGUMENT_STEP:
        return fmax(above, below);
    case KMP_ARGUMENT_SIZE:
    case KMP_ARGUMENT_KINK:
        if ((a < 0) != (b < 0))
            return 0;
        return (MARGIN * c->error > tolerance ? reach_of(c, k) : a < 0 ? c->high[k] : -c->low[k]) / tolerance;
    default:
        return 0;
    }
}

/* True if a quantity that takes part depends on an argument. */
static bool matters(const measuring *m, const kmp_run_argument *a, const part *at)
{
    for (int k = 0; k < m->q->count; k++)
        if (m->q->of[k].channel == a->of && takes_part(&m->q->of[k], at))
            return true;
    return false;
}

/* As excess_of_quantity, of an argument between the samples of its function. Of an argument that is not finite
 * somewhere, as log 0, nothing is known. */
static double excess_of_argument(const measuring *m, int k, const part *at, double *lacks)
{
    const kmp_run_argument *a = &m->q->argument[k];
    int channel = channel_of(m->q, k);
    double size = sizes_of(m->q, m->account)[channel], rounding = rounding_of(m->q, m->account)[channel];
    bool kink = a->kind == KMP_ARGUMENT_SIZE || a->kind == KMP_ARGUMENT_KINK;
    if (!matters(m, a, at))
        return 0;
    const course c = course_of(m, channel, at);
    *lacks = c.error;
    bool nothing = a->kind == KMP_ARGUMENT_PEAK && c.most < size - 2 * NOTHING - MARGIN * c.error;
    bool random = !kink && c.error <= rounding && MARGIN * rounding > 1;
    if (!(fabs(c.error) < INFINITY) || nothing || random)
        return 0;
    double excess = kink ? 0 : MARGIN * c.error;
    for (int i = 0; i + 1 < KMP_PIECE_POINTS; i++)
        excess = fmax(excess, hidden(a->kind, &c, i, size, fmax(m->step->rtol * size, MARGIN * rounding)));
    return excess;
}

/* Quantities, then arguments. */
static double excess_of(const measuring *m, int item, const part *at, double *lacks)
{
    if (item >= m->q->count)
        return excess_of_argument(m, item - m->q->count, at, lacks);
    return takes_part(&m->q->of[item], at) ? excess_of_quantity(m, item, at, lacks) : 0;
}

/* -- parts -------------------------------------------------------------------------------------------- */

static bool is_resolved(const measuring *m, const part *at)
{
    double lacks;
    for (int k = 0; k < m->q->count + m->q->arguments; k++)
        if (excess_of(m, k, at, &lacks) > 1) {
            counts_of(m->q, m->account)[WHICH] =
                k < m->q->count ? m->q->of[k].channel : m->q->argument[k - m->q->count].of;
            return false;
        }
    return true;
}

/* The time of a kink, where an argument whose polynomial is accurate is zero between the samples; false: there is none.
 * Closer to an end of the part than this fraction it is that end. */
static const double APART = 1e-3;

static bool find_kink(const measuring *m, const part *at, double *t)
{
    for (int k = 0; k < m->q->arguments; k++) {
        const kmp_run_argument *a = &m->q->argument[k];
        if ((a->kind != KMP_ARGUMENT_SIZE && a->kind != KMP_ARGUMENT_KINK) || !matters(m, a, at))
            continue;
        int channel = channel_of(m->q, k);
        const kmp_smooth_piece piece = piece_of(m, channel, false, at);
        if (!(MARGIN * kmp_piece_error(&piece) <= m->step->rtol * sizes_of(m->q, m->account)[channel]))
            continue;
        for (int j = 0; j + 1 < KMP_PIECE_POINTS; j++) {
            double low = values_at(m, at, j)[channel], high = values_at(m, at, j + 1)[channel];
            if (!(low * high < 0))
                continue;
            double x = kmp_piece_zero(&piece, kmp_piece_point(j), kmp_piece_point(j + 1));
            if (fabs(x) < 1 - APART) {
                *t = kmp_piece_time(&piece, x);
                return true;
            }
        }
    }
    return false;
}

/* Halves of a part, or what is before and after a kink within it, each on its side. */
static bool sample_halves(const measuring *m, const part *whole, part half[2])
{
    double middle = whole->from + 0.5 * (whole->to - whole->from), side = 0;
    bool kink = find_kink(m, whole, &middle);
    if (kink)
        side = 4 * DBL_EPSILON * fmax(fabs(whole->from), fabs(whole->to));
    bool equal = whole->equal && !kink;
    half[0] = (part){whole->from, middle - side, whole->halvings + 1, 2 * whole->index, equal};
    half[1] = (part){middle + side, whole->to, whole->halvings + 1, 2 * whole->index + 1, equal};
    return sample_half(m, whole, &half[0]) && sample_half(m, whole, &half[1]);
}

/* Follows halves of a part. A part that is not resolved down to the rounding of the time is rounding, which its channel
 * has from then on: a kink or a jump is next to the place that halves in turn lead to. */
static bool find_rounding(const measuring *m, int item, const part *from)
{
    part at = *from, half[2];
    double lacks = 0, size = 0;
    while (excess_of(m, item, &at, &lacks) > 1) {
        size = fmax(size / 2, lacks);
        if (!is_divisible(&at)) {
            int channel = item < m->q->count ? m->q->of[item].channel : channel_of(m->q, item - m->q->count);
            double *rounding = &rounding_of(m->q, m->account)[channel];
            *rounding = fmax(*rounding, 4 * size);
            return true;
        }
        if (!sample_halves(m, &at, half))
            return false;
        at = half[at.halvings % 2];
    }
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
        const kmp_smooth_piece piece = piece_through(line, false, &between),
                               square = piece_through(line, true, &between);
        take_piece(q, &piece, &square, x);
    }
}

static void take(const measuring *m, const part *at, bool resolved)
{
    double lacks;
    for (int k = 0; k < m->q->count; k++) {
        const kmp_run_quantity *q = &m->q->of[k];
        double *x = m->account + (ptrdiff_t)NUMBERS * k;
        if (!takes_part(q, at))
            continue;
        if (!resolved && excess_of_quantity(m, k, at, &lacks) > 1) {
            take_lines(m, q, at, x);
            continue;
        }
        const kmp_smooth_piece piece = piece_of(m, q->channel, false, at),
                               square = q->kind == KMP_TAKE_RMS ? piece_of(m, q->channel, true, at) : piece;
        take_piece(q, &piece, &square, x);
    }
}

/* Parts in the order of time. `rough`: generations none of which was resolved. */
static bool measure(const measuring *m, const part *at, bool resolved, int rough)
{
    part half[2];
    double *halvings = &counts_of(m->q, m->account)[HALVINGS];
    if (resolved || !is_divisible(at)) {
        take(m, at, resolved);
        return true;
    }
    if (*halvings >= MOST_PARTS || !sample_halves(m, at, half))
        return false;
    ++*halvings;
    bool is[2] = {is_resolved(m, &half[0]), is_resolved(m, &half[1])};
    rough = is[0] || is[1] ? 0 : rough + 1;
    if (rough > 0 && rough % PATIENCE == 0) {
        for (int k = 0; k < m->q->count + m->q->arguments; k++)
            if (!find_rounding(m, k, &half[0]))
                return false;
        is[0] = is_resolved(m, &half[0]);
        is[1] = is_resolved(m, &half[1]);
    }
    return measure(m, &half[0], is[0], rough) && measure(m, &half[1], is[1], rough);
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

/* From one cut of the step to the next; known points belong only to the whole step. */
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
        const measuring m = {q, account, room, &between};
        const part whole = {.from = from, .to = to, .equal = true};
        bool needed = false;
        for (int k = 0; k < q->count; k++)
            needed = needed || takes_part(&q->of[k], &whole);
        if (needed && !(sample_whole(&m, &whole) && measure(&m, &whole, is_resolved(&m, &whole), 0)))
            return false;
        from = to;
    }
    return true;
}

bool kmp_account_step(const kmp_run_quantities *q, double *account, double *room, const kmp_measured_step *step)
{
    const measuring m = {q, account, room, step};
    return take_times(&m, step->from, step->to) && measure_between(q, account, room, step);
}

bool kmp_account_excess(const kmp_run_quantities *q, const double *account, double t, kmp_text *why)
{
    const double *counts = account + kmp_account_size(q) - COUNTS;
    if (counts[HALVINGS] < MOST_PARTS)
        return false;
    const char *name = "";
    for (int k = 0; k < q->count; k++)
        if (q->of[k].channel == (int)counts[WHICH])
            name = q->name[q->of[k].first_value];
    kmp_text_printf(why,
                    "quantity '%s' changes too fast: at t = %.9g s the limit of %.0f parts of steps is reached; %s",
                    name, t, MOST_PARTS, q->remedy ? q->remedy : "take it over a shorter time (from .. to ..)");
    return true;
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
    case KMP_TAKE_FIRST:
        return !isnan(x[VALUE]) || (known && never);
    case KMP_TAKE_COUNT:
    case KMP_TAKE_DURATION:
        return known && (x[OTHER] > 0 ? always : never);
    default:
        return is_indifferent(q, low, high, x);
    }
}

/* Radians between five points, four for each turn. */
static const double MOST_TURN = 6;

/* True if an argument cannot do more between the five points of a step than these show. */
static bool is_calm(const kmp_run_quantities *q, int k, const kmp_measured_step *step, double largest)
{
    kmp_argument_kind kind = q->argument[k].kind;
    double values[KMP_PIECE_POINTS], low, high, least = INFINITY, most = -INFINITY, gap = 0;
    if (kind == KMP_ARGUMENT_SIZE) /* as a kink, for which rough bounds have room */
        return true;
    for (int j = 0; j < KMP_PIECE_POINTS; j += 2) {
        values[j] = step->sampled[j * q->channels + channel_of(q, k)];
        least = fmin(least, values[j]);
        most = fmax(most, values[j]);
        gap = j > 0 ? fmax(gap, fabs(values[j] - values[j - 2])) : 0;
    }
    kmp_piece_rough_bounds(values, &low, &high);
    if (kind == KMP_ARGUMENT_KINK)
        return (least < 0 && most >= 0) || low > 0 || high < 0;
    if (kind == KMP_ARGUMENT_PEAK)
        return (high - most < 1 || high < largest - NOTHING) && (least - low < 1 || least < largest - LITTLE);
    return high - most < 1 && least - low < 1 && (kind != KMP_ARGUMENT_WAVE || gap < 1);
}

bool kmp_account_pass(const kmp_run_quantities *q, double *account, const kmp_measured_step *step)
{
    double *size = sizes_of(q, account);
    if (q->turns && step->turn > MOST_TURN)
        return false;
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
    for (int k = 0; k < q->arguments; k++)
        if (!is_calm(q, k, step, size[channel_of(q, k)]))
            return false;
    for (int k = 0; k < q->count; k++) {
        const kmp_run_quantity_kind kind = q->of[k].kind;
        double *x = account + (ptrdiff_t)NUMBERS * k;
        if (!covers(&q->of[k], step->from, step->to))
            continue;
        if (kind == KMP_TAKE_DURATION && x[OTHER] > 0)
            x[VALUE] += step->to - x[TIME];
        if (kind == KMP_TAKE_FIRST || kind == KMP_TAKE_COUNT || kind == KMP_TAKE_DURATION)
            x[TIME] = step->to;
    }
    for (int c = 0; c < q->channels - q->arguments; c++)
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
