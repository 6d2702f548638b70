/* SPDX-License-Identifier: BSD-3-Clause */
/* Each value has bounds of itself and of its rate. */
#include "backend/bound_code.h"
#include "symbolic/graph.h"
#include <math.h>

static const kmp_bound anything = {-INFINITY, INFINITY, -INFINITY, INFINITY};
static const double half_turn = 3.14159265358979323846;

/* -- intervals --------------------------------------------------------------------------------------- */

typedef struct span {
    double low, high;
} span;

static const span whole = {-INFINITY, INFINITY};

/* The compiler makes instructions of these comparisons, and calls of fmin and fmax. Like those they may lose a NaN. */
static double lower(double a, double b)
{
    return a < b ? a : b;
}

static double upper(double a, double b)
{
    return a > b ? a : b;
}

/* Bounds that are NaN become infinite. */
static span checked(double low, double high)
{
    return low <= high ? (span){low, high} : whole;
}

static double times(double a, double b)
{
    return a == 0 || b == 0 ? 0 : a * b;
}

/* Plain products decide nearly always; zero times infinity, which counts as zero, is not a number there. */
static span product(span a, span b)
{
    double ll = a.low * b.low, lh = a.low * b.high, hl = a.high * b.low, hh = a.high * b.high;
    const double all = (ll + lh) + (hl + hh);
    if (all == all)
        return (span){lower(lower(ll, lh), lower(hl, hh)), upper(upper(ll, lh), upper(hl, hh))};
    ll = times(a.low, b.low);
    lh = times(a.low, b.high);
    hl = times(a.high, b.low);
    hh = times(a.high, b.high);
    return checked(lower(lower(ll, lh), lower(hl, hh)), upper(upper(ll, lh), upper(hl, hh)));
}

static span sum(span a, span b)
{
    return checked(a.low + b.low, a.high + b.high);
}

static span scaled(span a, double by)
{
    return product(a, (span){by, by});
}

static span hull(span a, span b)
{
    return checked(lower(a.low, b.low), upper(a.high, b.high));
}

static bool holds(span a, double x)
{
    return a.low <= x && x <= a.high;
}

static span inverse(span a)
{
    return holds(a, 0) || !(a.low <= a.high) ? whole : checked(1 / a.high, 1 / a.low);
}

static span square(span a)
{
    double low = a.low * a.low, high = a.high * a.high;
    return checked(holds(a, 0) ? 0 : lower(low, high), upper(low, high));
}

static span value_of(kmp_bound a)
{
    return (span){a.low, a.high};
}

static span rate_of(kmp_bound a)
{
    return (span){a.down, a.up};
}

static kmp_bound joined(span value, span rate)
{
    return (kmp_bound){value.low, value.high, rate.low, rate.high};
}

/* -- functions of one variable ------------------------------------------------------------------------ */

/* True if a + 2 pi k lies in the span for some k. */
static bool meets(span x, double a)
{
    return a + 2 * half_turn * ceil((x.low - a) / (2 * half_turn)) <= x.high;
}

static span sine(span x)
{
    if (!(x.high - x.low < 2 * half_turn))
        return (span){-1, 1};
    double a = sin(x.low), b = sin(x.high);
    return checked(meets(x, -half_turn / 2) ? -1 : lower(a, b), meets(x, half_turn / 2) ? 1 : upper(a, b));
}

static span cosine(span x)
{
    return sine((span){x.low + half_turn / 2, x.high + half_turn / 2});
}

/* Bounds of a function that increases with x. */
static span growing(double (*f)(double x), span x)
{
    return checked(f(x.low), f(x.high));
}

/* Bounds of a function that grows with |x|. */
static span even(double (*f)(double x), span x)
{
    double a = f(x.low), b = f(x.high);
    return checked(holds(x, 0) ? f(0) : lower(a, b), upper(a, b));
}

/* sqrt(1 - x^2) */
static span circle(span x)
{
    span rest = sum((span){1, 1}, scaled(square(x), -1));
    return rest.low >= 0 ? growing(sqrt, rest) : (span){0, 1};
}

static span sign_of(span x)
{
    return (span){x.low > 0 ? 1 : x.low == 0 ? 0 : -1, x.high < 0 ? -1 : x.high == 0 ? 0 : 1};
}

/* A function of x: its value and its derivative; `inside`: it has bounds there. */
typedef struct mapping {
    span f, slope;
    bool inside;
} mapping;

static mapping mapped(kmp_op op, span x)
{
    const span one = {1, 1};
    bool within = x.low >= -1 && x.high <= 1;
    span f;
    switch (op) {
    case KMP_OP_SIN:
        return (mapping){sine(x), cosine(x), true};
    case KMP_OP_COS:
        return (mapping){cosine(x), scaled(sine(x), -1), true};
    case KMP_OP_SQRT:
        f = x.low >= 0 ? growing(sqrt, x) : whole;
        return (mapping){f, x.low > 0 ? scaled(inverse(f), 0.5) : (span){0, INFINITY}, x.low >= 0};
    case KMP_OP_EXP:
        f = growing(exp, x);
        return (mapping){f, f, true};
    case KMP_OP_LOG:
        return (mapping){x.low > 0 ? growing(log, x) : whole, inverse(x), x.low > 0};
    case KMP_OP_SINH:
        return (mapping){growing(sinh, x), even(cosh, x), true};
    case KMP_OP_COSH:
        return (mapping){even(cosh, x), growing(sinh, x), true};
    case KMP_OP_TANH:
        f = growing(tanh, x);
        return (mapping){f, sum(one, scaled(square(f), -1)), true};
    case KMP_OP_ASIN:
        return (mapping){growing(asin, x), inverse(circle(x)), within};
    case KMP_OP_ACOS:
        return (mapping){checked(acos(x.high), acos(x.low)), scaled(inverse(circle(x)), -1), within};
    case KMP_OP_ATAN:
        return (mapping){growing(atan, x), inverse(sum(one, square(x))), true};
    case KMP_OP_ABS:
        return (mapping){even(fabs, x), sign_of(x), true};
    case KMP_OP_SIGN:
        f = sign_of(x);
        return (mapping){f, f.low == f.high ? (span){0, 0} : whole, true};
    case KMP_OP_FLOOR:
        f = growing(floor, x);
        return (mapping){f, floor(x.low) == floor(x.high) ? (span){0, 0} : whole, true};
    default:
        return (mapping){.inside = false};
    }
}

static kmp_bound one_variable(kmp_op op, kmp_bound x)
{
    mapping m = mapped(op, value_of(x));
    return m.inside ? joined(m.f, product(m.slope, rate_of(x))) : anything;
}

/* -- functions of several ----------------------------------------------------------------------------- */

static kmp_bound divided(kmp_bound x, kmp_bound y)
{
    span by = inverse(value_of(y)), f = product(value_of(x), by);
    return joined(f, product(sum(rate_of(x), scaled(product(f, rate_of(y)), -1)), by));
}

static kmp_bound added(kmp_bound x, kmp_bound y)
{
    return joined(sum(value_of(x), value_of(y)), sum(rate_of(x), rate_of(y)));
}

static bool is_constant(kmp_bound x)
{
    return x.low == x.high && x.down == 0 && x.up == 0;
}

/* x times a number, with plain products where zero and infinity do not meet. */
static kmp_bound times_number(kmp_bound x, double by)
{
    const double a = x.low * by, b = x.high * by, c = x.down * by, d = x.up * by, all = (a + b) + (c + d);
    if (all == all)
        return by < 0 ? (kmp_bound){b, a, d, c} : (kmp_bound){a, b, c, d};
    return joined(scaled(value_of(x), by), scaled(rate_of(x), by));
}

static kmp_bound multiplied(kmp_bound x, kmp_bound y, bool same, double sign)
{
    if (is_constant(y))
        return times_number(x, y.low);
    if (is_constant(x))
        return times_number(y, x.low);
    if (same)
        return joined(scaled(square(value_of(x)), sign), scaled(product(value_of(x), rate_of(x)), 2 * sign));
    return joined(product(value_of(x), value_of(y)),
                  sum(product(rate_of(x), value_of(y)), product(value_of(x), rate_of(y))));
}

/* x^y of x > 0, or at 0 with a fixed y > 0. */
static kmp_bound power(kmp_bound x, kmp_bound y)
{
    span at = value_of(x), by = value_of(y);
    bool fixed = y.low == y.high && y.low > 0;
    if (!(x.low > 0 || (x.low >= 0 && fixed)))
        return anything;
    if (fixed) {
        span slope = y.low >= 1 || x.low > 0 ? hull((span){pow(x.low, y.low - 1), pow(x.low, y.low - 1)},
                                                    (span){pow(x.high, y.low - 1), pow(x.high, y.low - 1)})
                                             : whole;
        return joined(checked(pow(x.low, y.low), pow(x.high, y.low)), product(scaled(slope, y.low), rate_of(x)));
    }
    span logarithm = growing(log, at), f = growing(exp, product(by, logarithm));
    span rate = sum(product(rate_of(y), logarithm), product(product(by, inverse(at)), rate_of(x)));
    return joined(f, product(f, rate));
}

/* The angle of (y, x), y first: extreme at corners of the rectangle, unless it meets the branch cut. */
static kmp_bound angle(kmp_bound y, kmp_bound x)
{
    span by_y = square(value_of(y)), by_x = square(value_of(x)), f = {-half_turn, half_turn};
    if (holds(value_of(y), 0) && x.low <= 0)
        return joined(f, whole);
    double a = atan2(y.low, x.low), b = atan2(y.low, x.high), c = atan2(y.high, x.low), d = atan2(y.high, x.high);
    f = checked(lower(lower(a, b), lower(c, d)), upper(upper(a, b), upper(c, d)));
    span along = sum(product(value_of(x), rate_of(y)), scaled(product(value_of(y), rate_of(x)), -1));
    return joined(f, product(along, inverse(sum(by_y, by_x))));
}

static kmp_bound negative(kmp_bound a)
{
    return (kmp_bound){-a.high, -a.low, -a.up, -a.down};
}

static kmp_bound least(kmp_bound x, kmp_bound y)
{
    if (x.high < y.low)
        return x;
    if (y.high < x.low)
        return y;
    return joined(checked(lower(x.low, y.low), lower(x.high, y.high)), hull(rate_of(x), rate_of(y)));
}

static kmp_bound less(kmp_bound x, kmp_bound y)
{
    if (x.high < y.low)
        return (kmp_bound){1, 1, 0, 0};
    if (x.low >= y.high)
        return (kmp_bound){0, 0, 0, 0};
    return (kmp_bound){0, 1, -INFINITY, INFINITY};
}

/* y where x is not zero, z where it is: a jump has no rate. */
static kmp_bound selected(kmp_bound x, kmp_bound y, kmp_bound z)
{
    if (!holds(value_of(x), 0))
        return y;
    if (x.low == 0 && x.high == 0)
        return z;
    return joined(hull(value_of(y), value_of(z)), whole);
}

/* -- operations -------------------------------------------------------------------------------------- */

KMP_LOCAL kmp_bound kmp_bound_of(const kmp_bound *value, unsigned operand)
{
    return operand & 1 ? negative(value[operand >> 1]) : value[operand >> 1];
}

KMP_LOCAL void kmp_bound_give(kmp_bound *value, unsigned operand, kmp_bound bound)
{
    value[operand >> 1] = operand & 1 ? negative(bound) : bound;
}

static kmp_bound looked_up(const kmp_bound_code *code, unsigned number, int derivative, kmp_bound x)
{
    span f, slope;
    if (!(x.high - x.low < INFINITY))
        return anything;
    int smooth = code->table(code->tables, number, derivative, x.low, x.high, &f.low, &f.high);
    (void)code->table(code->tables, number, derivative + 1, x.low, x.high, &slope.low, &slope.high);
    bool jumps = derivative >= smooth && f.low < f.high; /* at knots, or at the ends */
    return joined(f, jumps ? whole : product(slope, rate_of(x)));
}

static kmp_bound evaluated(const kmp_bound_code *code, const kmp_bound_step *in, const kmp_bound *v)
{
    const kmp_bound x = kmp_bound_of(v, in->a);
    switch ((kmp_op)in->op) {
    case KMP_OP_MUL:
        return multiplied(x, kmp_bound_of(v, in->b), in->a >> 1 == in->b >> 1, in->a == in->b ? 1 : -1);
    case KMP_OP_DIV:
        return divided(x, kmp_bound_of(v, in->b));
    case KMP_OP_POW:
        return power(x, kmp_bound_of(v, in->b));
    case KMP_OP_ATAN2:
        return angle(x, kmp_bound_of(v, in->b));
    case KMP_OP_MIN:
        return least(x, kmp_bound_of(v, in->b));
    case KMP_OP_MAX:
        return negative(least(negative(x), negative(kmp_bound_of(v, in->b))));
    case KMP_OP_LESS:
        return less(x, kmp_bound_of(v, in->b));
    case KMP_OP_SELECT:
        return selected(x, kmp_bound_of(v, in->b), kmp_bound_of(v, in->c));
    case KMP_OP_TABLE:
        return looked_up(code, in->b, (int)in->c, x);
    default:
        return one_variable((kmp_op)in->op, x);
    }
}

KMP_LOCAL int kmp_bound_values(const kmp_bound_code *code)
{
    return code->constants + code->inputs + code->steps;
}

KMP_LOCAL void kmp_bound_mark(const kmp_bound_code *code, const kmp_bound *value, bool *needed)
{
    const int first = code->constants + code->inputs;
    for (int i = code->listed ? code->count : code->steps; i-- > 0;) {
        const int k = code->listed ? code->listed[i] : i;
        const kmp_bound_step *in = &code->step[k];
        if (!needed[first + k] || in->op == KMP_OP_IMPLICIT)
            continue;
        const kmp_bound x = value[in->a >> 1];
        const bool chosen = in->op == KMP_OP_SELECT && (int)(in->a >> 1) < first + code->fixed && is_constant(x);
        needed[in->a >> 1] = true;
        if (in->op != KMP_OP_TABLE && !(chosen && x.low == 0))
            needed[in->b >> 1] = true;
        if (in->op == KMP_OP_SELECT && !(chosen && x.low != 0))
            needed[in->c >> 1] = true;
    }
}

KMP_LOCAL void kmp_bound_run(const kmp_bound_code *code, int from, kmp_bound *value)
{
    kmp_bound *result = value + code->constants + code->inputs;
    for (int k = 0; from == 0 && k < code->constants; k++)
        value[k] = (kmp_bound){code->constant[k], code->constant[k], 0, 0};
    const bool *needed = code->needed ? code->needed + code->constants + code->inputs : NULL;
    const int *listed = code->listed;
    const int count = listed ? code->count : code->steps;
    for (int i = listed ? 0 : from; i < count; i++) {
        const int k = listed ? listed[i] : i;
        if (needed && !needed[k])
            continue;
        if (code->step[k].op == KMP_OP_ADD)
            result[k] = added(kmp_bound_of(value, code->step[k].a), kmp_bound_of(value, code->step[k].b));
        else if (code->step[k].op != KMP_OP_IMPLICIT)
            result[k] = evaluated(code, &code->step[k], value);
    }
}
