/* SPDX-License-Identifier: BSD-3-Clause */
/* The stages of a step. Picard's iteration evaluates f at all stages and takes the result: it needs no matrix, and
 * contracts with the step size times the rate of the fastest forces. Newton's method solves for the change
 * (collocation_newton.c). */
#include "integrators/steppers/collocation_step.h"
#include "base/clones.h"
#include "integrators/steppers/collocation.h"
#include "integrators/steppers/collocation_newton.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* An iteration is given up above SLOW, or where it cannot reach the limit. */
static const double SLOW = 0.95;
/* Part of the step after an iteration that failed: by its contraction; a good one has CONTRACTS. */
static const double LESS = 0.6, LEAST = 0.3, CONTRACTS = 0.3;
/* An attempt ends as soon as its error is surely too large: above TOO_LARGE, and above MANY corrections. */
static const double TOO_LARGE = 2, MANY = 5;
static const double ERROR_FLOOR = 1e-10;
/* An iteration with mixed corrections may fail to contract up to sweep TURNS, while the correction is less than this
 * multiple of the first one: in the second sweep, and later. */
enum { TURNS = 3 };
static const double GROWS_AT_ONCE = 100, GROWS = 2;

/* -- sums over the stages, which are lanes ------------------------------------------------------------- */

/* Value k of lane l is at k width + l. The same bits on every machine. */

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));

/* Numbers times lanes: a[k] a_lanes + b[k] b_lanes. */
typedef struct lane_terms {
    const double *a, *a_lanes, *b, *b_lanes;
} lane_terms;

/* The functions for lanes in V registers, 1 or 2, of one type: compilers keep eight doubles in memory where registers
 * have four. The loop over the stages is unrolled for their usual number. */
#define KERNELS(lanes, type, number, usual)                                                                            \
    static KMP_INTO_CLONES void sum_of_##lanes(int count, int stages, const double *x, const double *column,           \
                                               const lane_terms *terms, double *restrict out)                          \
    {                                                                                                                  \
        enum { V = number, LAST = V - 1, W = V * (int)(sizeof(type) / sizeof(double)) };                               \
        const type *c = (const type *)column, *a = (const type *)terms->a_lanes, *b = (const type *)terms->b_lanes;    \
        for (int k = 0; k < count; k++) {                                                                              \
            type sum = terms->a[k] * a[0] + terms->b[k] * b[0], more = sum;                                            \
            if (V == 2)                                                                                                \
                more = terms->a[k] * a[LAST] + terms->b[k] * b[LAST];                                                  \
            for (int j = 0; j < stages; j++) {                                                                         \
                sum += x[k * W + j] * c[j * V];                                                                        \
                if (V == 2)                                                                                            \
                    more += x[k * W + j] * c[j * V + LAST];                                                            \
            }                                                                                                          \
            ((type *)out)[k * V] = sum;                                                                                \
            if (V == 2)                                                                                                \
                ((type *)out)[k * V + LAST] = more;                                                                    \
        }                                                                                                              \
    }                                                                                                                  \
    static KMP_CLONES void sum_##lanes(int count, int stages, const double *x, const double *column,                   \
                                       const lane_terms *terms, double *out)                                           \
    {                                                                                                                  \
        if (stages == (usual))                                                                                         \
            sum_of_##lanes(count, (usual), x, column, terms, out);                                                     \
        else                                                                                                           \
            sum_of_##lanes(count, stages, x, column, terms, out);                                                      \
    }                                                                                                                  \
    static KMP_INTO_CLONES void add_##lanes(double weight, const type *change, type *x, type *square)                  \
    {                                                                                                                  \
        type by = *change, e = weight * by;                                                                            \
        *x += by;                                                                                                      \
        *square += e * e;                                                                                              \
    }                                                                                                                  \
    static KMP_CLONES void advance_##lanes(int count, const double *weight, const double *change, double *x,           \
                                           double *square)                                                             \
    {                                                                                                                  \
        enum { V = number, LAST = V - 1 };                                                                             \
        const type *by = (const type *)change;                                                                         \
        type *to = (type *)x, sum = {0}, more = {0};                                                                   \
        for (int k = 0; k < count; k++) {                                                                              \
            add_##lanes(weight[k], &by[k * V], &to[k * V], &sum);                                                      \
            if (V == 2)                                                                                                \
                add_##lanes(weight[k], &by[k * V + LAST], &to[k * V + LAST], &more);                                   \
        }                                                                                                              \
        ((type *)square)[0] = sum;                                                                                     \
        if (V == 2)                                                                                                    \
            ((type *)square)[LAST] = more;                                                                             \
    }

KERNELS(four, four, 1, 4)
KERNELS(two_fours, four, 2, 7)
KERNELS(eight, eight, 1, 7)

/* out = f - x, and out = by x, for count values, a multiple of the type's. */
#define MAPS(type)                                                                                                     \
    static KMP_CLONES void subtract_##type(int count, const double *f, const double *x, double *out)                   \
    {                                                                                                                  \
        for (int k = 0; k < count; k += (int)(sizeof(type) / sizeof(double)))                                          \
            *(type *)(out + k) = *(const type *)(f + k) - *(const type *)(x + k);                                      \
    }                                                                                                                  \
    static KMP_CLONES void scale_##type(int count, double by, const double *x, double *restrict out)                   \
    {                                                                                                                  \
        for (int k = 0; k < count; k += (int)(sizeof(type) / sizeof(double)))                                          \
            *(type *)(out + k) = by * *(const type *)(x + k);                                                          \
    }

MAPS(four)
MAPS(eight)

/* The store is as wide as the load of what is stored: a wider load would wait for both. */
static void subtract(int width, int count, const double *f, const double *x, double *out)
{
    (width == 8 && kmp_has_eight() ? subtract_eight : subtract_four)(width * count, f, x, out);
}

static void scale(int width, int count, double by, const double *x, double *out)
{
    (width == 8 && kmp_has_eight() ? scale_eight : scale_four)(width * count, by, x, out);
}

/* out[k] = a[k] a_lanes + b[k] b_lanes + sum over the stages j of x[k][j] column[j], for k < count; width 4 or 8. */
static void sum_lanes(int width, int count, int stages, const double *x, const double *column, const lane_terms *terms,
                      double *out)
{
    if (width == 4)
        sum_four(count, stages, x, column, terms, out);
    else if (!kmp_has_eight())
        sum_two_fours(count, stages, x, column, terms, out);
    else
        sum_eight(count, stages, x, column, terms, out);
}

/* x += change in all lanes; returns the sum over k < count and the stages of (weight[k] change[k])^2. */
static double advance(int width, int count, int stages, const double *weight, const double *change, double *x)
{
    double square[8], sum = 0;
    if (width == 4)
        advance_four(count, weight, change, x, square);
    else if (!kmp_has_eight())
        advance_two_fours(count, weight, change, x, square);
    else
        advance_eight(count, weight, change, x, square);
    for (int l = 0; l < stages; l++)
        sum += square[l];
    return sum;
}

/* -- evaluation ---------------------------------------------------------------------------------------- */

int kmp_collocation_evaluate(kmp_collocation *s, int count)
{
    const kmp_ode *ode = &s->base.ode;
    bool lanes = kmp_collocation_in_lanes(s);
    s->base.work.rhs += count;
    s->base.cycles += kmp_collocation_sweep_cost(s);
    int said = lanes ? ode->lanes(ode->self, s->lanes.at, s->stage, s->f) : KMP_APART;
    if (said != KMP_APART)
        return said;
    s->base.cycles += lanes ? (count - 1) * ode->cycles : 0;
    size_t w = (size_t)s->w, n = (size_t)s->n;
    for (size_t l = 0; l < (size_t)count; l++) {
        for (size_t k = 0; k < n; k++)
            s->trial[k] = s->stage[k * w + l];
        said = ode->rhs(ode->self, s->lanes.at[l], s->trial, s->slope);
        if (said != KMP_GO)
            return said;
        for (size_t k = 0; k < n; k++)
            s->f[k * w + l] = s->slope[k];
    }
    return KMP_GO;
}

/* Improves f for s->stage, at places near the places of the last kmp_collocation_evaluate, or evaluates it. */
static int improve(kmp_collocation *s)
{
    const kmp_ode *ode = &s->base.ode;
    int said = ode->improve(ode->self, s->lanes.at, s->stage, s->f);
    if (said == KMP_APART)
        return kmp_collocation_evaluate(s, s->s);
    s->base.work.rhs += s->s;
    s->base.cycles += *ode->cycles_of_improve + KMP_SWEEP_CYCLES_OF_UNKNOWN * (s->p + s->inner);
    return said;
}

/* -- places of the stages ------------------------------------------------------------------------------ */

/* Sets times and coefficients of a step h. */
static void set_columns(kmp_collocation *s, double h)
{
    for (int l = 0; l < s->w; l++) {
        s->lanes.hc[l] = h * s->lanes.c[l];
        s->lanes.at[l] = s->base.t + s->lanes.hc[l];
    }
    scale(s->w, s->s, h, s->lanes.a, s->lanes.once);
    scale(s->w, s->s, h * h, s->lanes.aa, s->lanes.twice);
}

/* Of unknowns with stage derivatives from `from` to before `to`, and of positions from `from` to before `to_p`. */
static void place_some(kmp_collocation *s, int from, int to_p, int to)
{
    const double *y = s->y + from, *v = s->y + s->all_p + from, *g = s->g + from * s->w;
    double *stage = s->stage + from * s->w;
    sum_lanes(s->w, to_p - from, s->s, g, s->lanes.twice, &(lane_terms){y, s->lanes.one, v, s->lanes.hc}, stage);
    sum_lanes(s->w, to - from, s->s, g, s->lanes.once, &(lane_terms){v, s->lanes.one, v, s->lanes.zero},
              stage + s->all_p * s->w);
}

static void place(kmp_collocation *s)
{
    place_some(s, 0, s->p, s->inner);
}

/* -- end ----------------------------------------------------------------------------------------------- */

static void find_lead(kmp_collocation *s, int inner)
{
    for (int k = 0; k < inner; k++) {
        s->lead[k] = 0;
        for (int j = 0; j < s->s; j++)
            s->lead[k] += s->table->lead[j] * s->g[k * s->w + j];
    }
}

/* Difference from a polynomial of one degree more, by the leading coefficients of two steps: the filter removes the
 * stiff part of the estimate, which dense output contains like the rest. */
static double misfit(kmp_collocation *s, double h, int inner)
{
    double ratio = h / s->taken, power = pow(ratio, s->s - 1), sum = 0;
    double by = h * s->table->gap / ((s->s + 1) * (s->table->centre + (1 - s->table->centre) / ratio));
    find_lead(s, inner);
    for (int k = 0; s->has_step && k < inner; k++) {
        double e = by * (s->lead[k] - power * s->lead_old[k]) * s->per_scale[s->all_p + k];
        sum += e * e;
    }
    return sqrt(sum / fmax(inner, 1));
}

/* The error at the end of a step, weighted as the tolerance, if the coefficients decay by a power of their degree, as
 * fast as the last two do after the two before them; a symmetric solution has every second one. The estimate is
 * 2 filter h times the last one, of degree s, unless that is zero by chance; the end is wrong by the terms from degree
 * 2 s - 1 on. */
static double of_slow_decay(kmp_collocation *s, double h, int p, int inner)
{
    double size[KMP_COLLOCATION_DECAYS];
    /* Weighted sizes of the derivatives' Legendre coefficients of degrees s, s - 1, s - 2, s - 3, by the start and the
     * stages. */
    const double *start = s->dy + s->all_p;
    double sum[KMP_COLLOCATION_DECAYS] = {0};
    sum_lanes(s->w, inner, s->s, s->g, s->lanes.decay, &(lane_terms){start, s->lanes.decay_start, start, s->lanes.zero},
              s->g_before);
    for (int k = 0; k < inner; k++)
        for (int d = 0; d < KMP_COLLOCATION_DECAYS; d++) {
            double c = s->g_before[k * s->w + d] * s->per_scale[s->all_p + k];
            sum[d] += c * c;
        }
    for (int d = 0; d < KMP_COLLOCATION_DECAYS; d++)
        size[d] = sqrt(sum[d]);
    double last = size[0], next = size[1], high = fmax(last, next), low = fmax(fmax(size[2], size[3]), high);
    if (!(high > 0))
        return 0;
    double decay = high / low, part = pow(decay, s->lanes.decay_power);
    return s->widen * 2 * s->table->filter * h * part * fmax(last, next * sqrt(decay)) / sqrt(p + inner);
}

/* The estimate h filter (f - p'(0)), p the stages' polynomial (Hairer, Wanner, II, IV.8.19): of only the motion, or
 * with the equations that follow it. */
static double estimate(kmp_collocation *s, double h, bool whole)
{
    double sum = 0;
    const double *v = s->dy + s->all_p;
    int p = whole ? s->all_p : s->p, inner = whole ? s->all : s->inner;
    sum_lanes(s->w, inner, s->s, s->g, s->lanes.end, &(lane_terms){v, s->lanes.filter, v, s->lanes.zero}, s->ends);
    for (int k = 0; k < p; k++)
        s->error[k] = h * h * s->ends[k * s->w + KMP_END_SLOPE_TWICE];
    for (int k = 0; k < inner; k++)
        s->error[s->all_p + k] = h * s->ends[k * s->w + KMP_END_SLOPE];
    if (s->iteration != KMP_ITERATION_PICARD)
        kmp_collocation_filter(s, whole ? s->columns : 0);
    for (int k = 0; k < p + inner; k++) {
        int at = k < p ? k : s->all_p - p + k;
        double e = s->error[at] * s->per_scale[at];
        sum += e * e;
    }
    double error = sqrt(sum / fmax(p + inner, 1));
    if (s->iteration != KMP_ITERATION_PICARD) {
        double gap = misfit(s, h, inner);
        error = isfinite(error + gap) ? fmax(error, gap) : INFINITY;
    } else if (!s->method->by_rates) {
        error = fmax(error, of_slow_decay(s, h, p, inner));
    }
    return isfinite(error) ? fmax(error, ERROR_FLOOR) : INFINITY;
}

/* Ends and errors of the quadratures, as of the other unknowns: from the slopes at the stages, which are complete. */
static void find_quadratures(kmp_collocation *s)
{
    const int first = s->all * s->w;
    const double *v = s->dy + s->all_p + s->all;
    memcpy(s->g + first, s->f + (s->all_p + s->all) * s->w, (size_t)(s->q * s->w) * sizeof *s->g);
    sum_lanes(s->w, s->q, s->s, s->g + first, s->lanes.end, &(lane_terms){v, s->lanes.filter, v, s->lanes.zero},
              s->ends + first);
}

/* The estimate of the quadratures, as of the other unknowns. */
static double estimate_of_quadratures(const kmp_collocation *s, double h)
{
    double squares = 0;
    for (int k = s->all; k < s->all + s->q; k++) {
        const double error = h * s->ends[k * s->w + KMP_END_SLOPE] * s->per_scale[s->all_p + k];
        squares += error * error;
    }
    return sqrt(squares / fmax(s->q, 1));
}

void kmp_collocation_end(kmp_collocation *s, double h)
{
    const double *v = s->y + s->all_p;
    for (int k = 0; k < s->all_p; k++)
        s->y_old[k] = s->y[k] + h * (v[k] + h * s->ends[k * s->w + KMP_END_TWICE]);
    for (int k = 0; k < s->all + s->q; k++)
        s->y_old[s->all_p + k] = v[k] + h * s->ends[k * s->w + KMP_END_ONCE];
}

/* -- iteration ----------------------------------------------------------------------------------------- */

/* Newton's correction. Picard's iteration would contract by about the part that it adds to the first residual. */
static void correct(kmp_collocation *s, bool first)
{
    double residual = first ? kmp_collocation_square(s, s->change) : 0;
    if (first)
        memcpy(s->g_before, s->change, (size_t)(s->inner * s->w) * sizeof *s->change);
    s->base.cycles += kmp_collocation_correction_cost(s, s->iteration);
    if (s->iteration == KMP_ITERATION_COUPLED)
        kmp_collocation_correct_coupled(s, s->change);
    else
        kmp_collocation_correct_newton(s, s->change);
    if (!first)
        return;
    subtract(s->w, s->inner, s->change, s->g_before, s->g_before);
    s->choice.picard = sqrt(kmp_collocation_square(s, s->g_before) / fmax(residual, DBL_MIN));
}

/* Makes one sweep; returns the weighted size of its correction, or a negative result of f. */
static kmp_collocation_outcome sweep(kmp_collocation *s, bool first, double *size)
{
    int said = KMP_GO;
    if (!s->evaluated) {
        place(s);
        said = s->near ? improve(s) : kmp_collocation_evaluate(s, s->s);
    }
    s->evaluated = false;
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_COLLOCATION_BAD_STAGE : KMP_COLLOCATION_HALTED;
    subtract(s->w, s->inner, s->f + s->all_p * s->w, s->g, s->change);
    double mixed = 0;
    if (s->iteration != KMP_ITERATION_PICARD)
        correct(s, first);
    if (s->iteration != KMP_ITERATION_PICARD && !s->near)
        mixed = kmp_collocation_mix(s, first);
    double sum = advance(s->w, s->inner, s->s, s->weight, s->change, s->g);
    sum = s->mixing.on ? fmax(sum, mixed) : sum;
    *size = sqrt(sum / fmax(s->inner * s->s, 1));
    s->near = first ? kmp_collocation_is_near(s, *size) : s->near;
    s->base.work.newton++;
    return *size <= DBL_MAX ? KMP_COLLOCATION_TAKEN : KMP_COLLOCATION_BAD_STAGE;
}

/* True if the iteration converges after sweep k, by the ratio of the last two corrections. */
static bool is_hopeful(kmp_collocation *s, int k, double size, double *shorter)
{
    *shorter = fmin(LESS, fmax(LEAST, sqrt(CONTRACTS / s->past.contraction)));
    if (!(s->past.contraction < SLOW))
        return false;
    s->ready = s->past.contraction / (1 - s->past.contraction);
    double last = s->ready * size;
    for (int more = k; more < s->most_sweeps - 1 && last >= s->limit; more++)
        last *= s->past.contraction;
    return k < 4 || last < s->limit;
}

static kmp_collocation_outcome iterate(kmp_collocation *s, double h, double *error, double *shorter)
{
    *shorter = 0.5;
    double before = 0, size = 0, rate_before = 0, began = 0;
    for (int k = 1; k <= s->most_sweeps; k++) {
        kmp_collocation_outcome what = sweep(s, k == 1, &size);
        s->sweeps = k;
        if (what != KMP_COLLOCATION_TAKEN)
            return what;
        if (k > 1) {
            double rate = size / before;
            s->past.contraction = k == 2 ? rate : sqrt(rate * rate_before);
            rate_before = rate;
            s->past.unmixed = k == 2 ? rate : s->past.unmixed;
            /* Mixing may still make an iteration converge that does not by itself. */
            bool turns = s->mixing.on && !(s->past.contraction < SLOW) && k <= TURNS &&
                         size / began < (k == 2 ? GROWS_AT_ONCE : GROWS);
            if (!turns && !is_hopeful(s, k, size, shorter))
                return KMP_COLLOCATION_BAD_ITERATION;
        }
        before = fmax(size, DBL_MIN);
        began = k == 1 ? before : began;
        if (s->past.contraction < SLOW && s->ready * size <= s->limit)
            return KMP_COLLOCATION_TAKEN;
        if (k == 2 || k == 4) {
            *error = estimate(s, h, false);
            if (*error > fmax(TOO_LARGE, MANY * size))
                return KMP_COLLOCATION_BAD_ERROR;
        }
    }
    *shorter = 0.5;
    return KMP_COLLOCATION_BAD_ITERATION;
}

static void begin(kmp_collocation *s, double h)
{
    s->past.expected = s->past.tried > 0 ? s->past.contraction * h * h / (s->past.tried * s->past.tried) : 0;
    s->past.tried = h;
    s->ready = 1;
    s->past.contraction = 0;
    s->evaluated = s->near = false;
    s->mixing.count = 0;
    s->mixing.on = false;
    set_columns(s, h);
    /* Predicts the derivatives of the stages by the last step's polynomial, or as constant. */
    int stages = s->has_step ? s->s : 0;
    if (s->has_step) {
        double x[KMP_COLLOCATION_LANES];
        for (int l = 0; l < s->w; l++)
            x[l] = 1 + s->lanes.c[l] * h / s->taken;
        kmp_collocation_weights(s->table, s->w, x, s->lanes.ahead);
    }
    const double *base = s->has_step ? s->g_start_old : s->dy + s->all_p,
                 *lanes = s->has_step ? s->lanes.ahead : s->lanes.one;
    sum_lanes(s->w, s->all, stages, s->g_old, s->lanes.ahead + s->w, &(lane_terms){base, lanes, base, s->lanes.zero},
              s->g);
}

/* -- equations that follow ------------------------------------------------------------------------------- */

/* Equations of this number of columns are evaluated together: an entry of A is loaded once for them. */
enum { TOGETHER = 4 };

/* Columns side by side: place of the first one, and the distance to the next. */
typedef struct columns_at {
    const double *x, *rates, *b, *g;
    double *change;
    ptrdiff_t next;
} columns_at;

/* change = A (x, x') + b - g in the eight lanes, for `rows` rows from i on, of p, of `count` columns. */
static KMP_INTO_CLONES void linear_rows(int rows, int count, int p, int i, const double *a, const columns_at *c)
{
    eight sum[2][TOGETHER];
    for (int r = 0; r < rows; r++)
        for (int k = 0; k < count; k++)
            sum[r][k] =
                *(const eight *)(c->b + k * c->next + (i + r) * 8) - *(const eight *)(c->g + k * c->next + (i + r) * 8);
    for (int j = 0; j < 2 * p; j++) {
        const double *x = j < p ? c->x + j * 8 : c->rates + (j - p) * 8, *of = a + (ptrdiff_t)(j * p + i) * 8;
        for (int k = 0; k < count; k++)
            for (int r = 0; r < rows; r++)
                sum[r][k] += *(const eight *)(of + r * 8) * *(const eight *)(x + k * c->next);
    }
    for (int r = 0; r < rows; r++)
        for (int k = 0; k < count; k++)
            *(eight *)(c->change + k * c->next + (i + r) * 8) = sum[r][k];
}

static KMP_CLONES void linear_residuals(int count, int p, const double *a, const columns_at *first)
{
    columns_at c = *first;
    for (; count >= TOGETHER; count -= TOGETHER) {
        int i = 0;
        for (; i + 2 <= p; i += 2)
            linear_rows(2, TOGETHER, p, i, a, &c);
        if (i < p)
            linear_rows(1, TOGETHER, p, i, a, &c);
        c.x += TOGETHER * c.next;
        c.rates += TOGETHER * c.next;
        c.b += TOGETHER * c.next;
        c.g += TOGETHER * c.next;
        c.change += TOGETHER * c.next;
    }
    for (int i = 0; count > 0 && i < p; i++)
        linear_rows(1, count, p, i, a, &c);
}

/* One sweep of the stages of all columns, by an iteration. Returns the weighted size of the corrections. */
static double sweep_columns(kmp_collocation *s, kmp_iteration iteration)
{
    const ptrdiff_t next = s->p * s->w;
    double sum = 0;
    place_some(s, s->p, s->all_p, s->all);
    linear_residuals(s->columns, s->p, s->of_motion,
                     &(columns_at){s->stage + next, s->stage + s->all_p * s->w + next, s->of_parameters, s->g + next,
                                   s->change + next, next});
    for (int c = 1; c <= s->columns; c++) {
        double *change = s->change + c * next;
        if (iteration == KMP_ITERATION_COUPLED)
            kmp_collocation_correct_coupled(s, change);
        else if (iteration == KMP_ITERATION_NEWTON)
            kmp_collocation_correct_newton(s, change);
        sum += advance(s->w, s->p, s->s, s->weight + c * s->p, change, s->g + c * next);
    }
    return sqrt(sum / fmax(s->columns * s->p * s->s, 1));
}

/* Cycles of a column's sweep, of n unknowns, about: its places and residuals; its correction by Newton's factors. */
static double column_cycles(double n, kmp_iteration iteration)
{
    return 60 + 40 * n + 2 * n * n + (iteration == KMP_ITERATION_NEWTON ? 60 + 25 * n + 3.3 * n * n : 0);
}

/* True if one system of all stages, which all columns share, costs less than as many sweeps as the motion's. */
static bool is_direct(const kmp_collocation *s)
{
    const double n = s->inner, columns = s->columns, once = kmp_collocation_correction_cost(s, KMP_ITERATION_COUPLED);
    const double matrix = kmp_collocation_matrix_cost(s, KMP_ITERATION_COUPLED);
    const double direct = matrix + columns * (column_cycles(n, KMP_ITERATION_PICARD) + once);
    return s->coupled.system &&
           (s->iteration == KMP_ITERATION_COUPLED || direct < columns * s->sweeps * column_cycles(n, s->iteration));
}

/* The derivatives of the stages of all columns, along the derivatives of the motion. Their equations are linear. They
 * are solved at once by the matrices of all stages, or by the motion's iteration, which converges as fast as it did
 * there. */
static kmp_collocation_outcome follow(kmp_collocation *s, double *shorter)
{
    double before = 0, contraction = 0, ready = 1;
    int said = s->base.ode.follow(s->base.ode.self, s->of_motion, s->of_parameters);
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_COLLOCATION_BAD_STAGE : KMP_COLLOCATION_HALTED;
    *shorter = 0.5;
    if (is_direct(s) && kmp_collocation_couple(s, s->of_motion))
        return sweep_columns(s, KMP_ITERATION_COUPLED) <= DBL_MAX ? KMP_COLLOCATION_TAKEN : KMP_COLLOCATION_BAD_STAGE;
    for (int k = 1; k <= 2 * s->most_sweeps; k++) {
        double size = sweep_columns(s, s->iteration);
        if (!(size <= DBL_MAX))
            return KMP_COLLOCATION_BAD_STAGE;
        if (k > 1)
            contraction = k == 2 ? size / before : sqrt(contraction * size / before);
        ready = k > 1 ? contraction / (1 - contraction) : 1;
        if (contraction < SLOW && ready * size <= s->limit_of_columns)
            return KMP_COLLOCATION_TAKEN;
        before = fmax(size, DBL_MIN);
    }
    return KMP_COLLOCATION_BAD_ITERATION;
}

kmp_collocation_outcome kmp_collocation_find_stages(kmp_collocation *s, double h, double *error, double *shorter)
{
    for (int k = 0; k < s->all; k++)
        s->weight[k] = h * s->per_scale[s->all_p + k];
    begin(s, h);
    kmp_collocation_outcome what = KMP_COLLOCATION_TAKEN;
    if (s->iteration != KMP_ITERATION_PICARD) {
        /* Newton's matrices, where the stages are predicted. */
        place(s);
        what = s->iteration == KMP_ITERATION_COUPLED ? kmp_collocation_prepare_coupled(s, h)
                                                     : kmp_collocation_prepare_newton(s, h);
        set_columns(s, h); /* times */
    }
    if (what == KMP_COLLOCATION_TAKEN)
        what = iterate(s, h, error, shorter);
    bool failed = what == KMP_COLLOCATION_BAD_ITERATION || what == KMP_COLLOCATION_BAD_STAGE;
    if (failed && s->near && s->past.expected < CONTRACTS) {
        /* Sweeps at places nearby have not converged, and the length of the step does not explain that: from
         * the prediction on only by f. */
        begin(s, h);
        s->far++;
        what = iterate(s, h, error, shorter);
        s->far--;
        if (what == KMP_COLLOCATION_TAKEN)
            kmp_collocation_go_far(s);
    }
    if (what == KMP_COLLOCATION_TAKEN && s->columns > 0)
        what = follow(s, shorter);
    const kmp_ode *ode = &s->base.ode;
    if (what == KMP_COLLOCATION_TAKEN && ode->integrands && kmp_collocation_in_lanes(s) &&
        ode->integrands(ode->self, s->lanes.at, s->stage, s->f) != KMP_GO)
        what = KMP_COLLOCATION_BAD_STAGE;
    if (what != KMP_COLLOCATION_TAKEN)
        return what;
    if (s->iteration == KMP_ITERATION_PICARD)
        find_lead(s, s->all);
    find_quadratures(s);
    *error = estimate(s, h, true);
    if (ode->results)
        *error = fmax(*error, estimate_of_quadratures(s, h));
    return *error < 1 ? KMP_COLLOCATION_TAKEN : KMP_COLLOCATION_BAD_ERROR;
}
