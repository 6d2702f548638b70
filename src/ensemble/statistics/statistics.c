/* SPDX-License-Identifier: BSD-3-Clause */
/* Statistics of the table "instances": they need no more than its columns, so that tables of parts can be gathered
 * first. */
#include "ensemble/statistics/statistics.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/quantile.h"
#include "base/text.h"
#include "constraints/tolerances.h"
#include "ensemble/sampling/sampling.h"
#include "ensemble/sampling/values.h"
#include "linalg/dense/dot.h"
#include "output/print.h"
#include "output/result_table.h"
#include <float.h>
#include <kempe/ensemble.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum { MOST_TERMS = 20000, MOST_HALVINGS = 200 };

/* The continued fraction of the incomplete beta function by Lentz's method (DLMF 8.17.22). */
static double fraction(double x, double a, double b)
{
    double c = 1, d = 1 - (a + b) * x / (a + 1);
    d = 1 / (fabs(d) < DBL_MIN ? DBL_MIN : d);
    double h = d;
    for (int m = 1; m < MOST_TERMS; m++) {
        const double terms[2] = {m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
                                 -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))};
        double change = 1;
        for (int i = 0; i < 2; i++) {
            d = 1 + terms[i] * d;
            c = 1 + terms[i] / c;
            d = 1 / (fabs(d) < DBL_MIN ? DBL_MIN : d);
            c = fabs(c) < DBL_MIN ? DBL_MIN : c;
            change = c * d;
            h *= change;
        }
        if (fabs(change - 1) < 2 * DBL_EPSILON)
            break;
    }
    return h;
}

double kmp_beta_share(double x, double a, double b)
{
    if (!(x > 0))
        return 0;
    if (x >= 1)
        return 1;
    double front = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(x) + b * log1p(-x));
    return x < (a + 1) / (a + b + 2) ? front * fraction(x, a, b) / a : 1 - front * fraction(1 - x, b, a) / b;
}

/* Bisection: shares are monotone, and steps of Newton's method may leave the interval. */
double kmp_beta_quantile(double part, double a, double b)
{
    double low = 0, high = 1;
    if (!(a > 0) || !(b > 0))
        return a > 0 ? 1 : 0;
    for (int k = 0; k < MOST_HALVINGS && high - low > DBL_EPSILON * high; k++) {
        double middle = 0.5 * (low + high);
        if (kmp_beta_share(middle, a, b) < part)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

/* The share of both tails beyond t is I_x(f/2, 1/2) at x = f/(f + t^2); near t = 0 its complement has the digits. */
double kmp_student_quantile(double part, double freedoms)
{
    double tail = part < 0.5 ? part : 1 - part, square;
    if (tail < 0.25) {
        double x = kmp_beta_quantile(2 * tail, freedoms / 2, 0.5);
        square = freedoms * (1 - x) / x;
    } else {
        double y = kmp_beta_quantile(1 - 2 * tail, 0.5, freedoms / 2);
        square = freedoms * y / (1 - y);
    }
    return part < 0.5 ? -sqrt(square) : sqrt(square);
}

double kmp_binomial_share(int k, int n, double p)
{
    return k < 0 ? 0 : k >= n ? 1 : kmp_beta_share(1 - p, n - k, k + 1.0);
}

void kmp_chance_interval(int k, int n, double confidence, double *low, double *high)
{
    double tail = 0.5 * (1 - confidence);
    *low = kmp_beta_quantile(tail, k, n - k + 1.0);
    *high = kmp_beta_quantile(1 - tail, k + 1.0, n - k);
}

/* The largest place whose samples above it hold the quantile; `above`: the least place above it. */
static int place_beside(int n, double part, double tail, bool above)
{
    int from = 0, to = n + 1;
    while (to - from > 1) {
        int middle = from + (to - from) / 2;
        double share = kmp_binomial_share(middle - 1, n, part);
        if (above ? 1 - share <= tail : share > tail)
            to = middle;
        else
            from = middle;
    }
    return above ? to : from;
}

void kmp_quantile_places(int n, double part, double confidence, int *low, int *high)
{
    double tail = 0.5 * (1 - confidence);
    *low = place_beside(n, part, tail, false);
    *high = place_beside(n, part, tail, true);
}

/* -- contributions ------------------------------------------------------------------------------------------ */

/* Saltelli, Annoni, Azzini, Campolongo, Ratto, Tarantola, Computer Physics Communications 181 (2010) 259, table 2; the
 * standard errors belong to ratios of means. */

/* -- regression --------------------------------------------------------------------------------------- */

/* Correlations of the inputs, and of each with the value, from deviations in units of standard deviations. */
static bool correlate(int count, int columns, const double *rows, const double *value, double *scaled, double *matrix,
                      double *with)
{
    int all = columns + 1;
    for (int c = 0; c < all; c++) {
        const double *x = c < columns ? rows + c : value;
        ptrdiff_t stride = c < columns ? columns : 1;
        double sum = 0;
        for (int k = 0; k < count; k++)
            sum += x[k * stride];
        double mean = sum / count, square = 0;
        for (int k = 0; k < count; k++) {
            double d = scaled[(ptrdiff_t)k * all + c] = x[k * stride] - mean;
            square += d * d;
        }
        if (!(square > 0))
            return false;
        for (int k = 0; k < count; k++)
            scaled[(ptrdiff_t)k * all + c] /= sqrt(square);
    }
    for (int i = 0; i < columns; i++)
        for (int j = 0; j < all; j++) {
            double sum = 0;
            for (int k = 0; k < count; k++)
                sum += scaled[(ptrdiff_t)k * all + i] * scaled[(ptrdiff_t)k * all + j];
            if (j < columns)
                matrix[i + j * columns] = sum;
            else
                with[i] = sum;
        }
    return true;
}

static bool solve(int columns, double *matrix, const double *with, double *coefficients, double *explained)
{
    if (kmp_cholesky_factor(columns, matrix))
        return false;
    for (int c = 0; c < columns; c++)
        if (!(matrix[c + c * columns] * matrix[c + c * columns] > KMP_CORRELATION_LEAST))
            return false;
    for (int c = 0; c < columns; c++)
        coefficients[c] = with[c];
    kmp_cholesky_solve(columns, matrix, coefficients);
    *explained = 0;
    for (int c = 0; c < columns; c++)
        *explained += coefficients[c] * with[c];
    return true;
}

bool kmp_regression(int count, int columns, const double *rows, const double *value, double *coefficients,
                    double *explained)
{
    kmp_arena arena = {0};
    double *scaled = KMP_ARENA_NEW(&arena, double, (size_t)count *(size_t)(columns + 1)),
           *matrix = KMP_ARENA_NEW(&arena, double, columns *columns), *with = KMP_ARENA_NEW(&arena, double, columns);
    bool good = !arena.failed && columns > 0 && count > columns + 1 &&
                correlate(count, columns, rows, value, scaled, matrix, with) &&
                solve(columns, matrix, with, coefficients, explained);
    kmp_arena_free(&arena);
    return good;
}

/* -- Sobol's indices ----------------------------------------------------------------------------------- */

bool kmp_is_saltelli(int count, int columns, const double *rows)
{
    int size = kmp_saltelli_group(columns);
    if (columns < 1 || count < size || count % size != 0)
        return false;
    for (int k = 0; k < count; k += size) {
        const double *a = rows + (ptrdiff_t)k * columns, *b = a + columns;
        for (int i = 0; i < columns; i++)
            for (int c = 0; c < columns; c++)
                if (a[(ptrdiff_t)(2 + i) * columns + c] != (c == i ? b[c] : a[c]))
                    return false;
    }
    return true;
}

/* True if a column has `levels` evenly spaced values, each for `stride` rows, again and again. */
static bool is_ruled(int count, int columns, const double *column, int stride, int levels)
{
    const double first = column[0], last = column[(ptrdiff_t)(levels - 1) * stride * columns];
    const double slack = 1e-9 * fmax(fabs(first), fabs(last));
    for (int k = 0; k < count; k++) {
        const double part = levels > 1 ? (double)(k / stride % levels) / (levels - 1) : 0;
        if (!(fabs(column[(ptrdiff_t)k * columns] - (first + part * (last - first))) <= slack))
            return false;
    }
    return levels == 1 || fabs(last - first) > slack;
}

bool kmp_is_grid(int count, int columns, const double *rows)
{
    for (int order = 0; order < 2 && count > 2; order++) { /* the last column changes in each row, or the first one */
        bool ruled = true;
        int stride = 1;
        for (int i = 0; i < columns && ruled; i++) {
            const double *column = rows + (order == 0 ? columns - 1 - i : i);
            int levels = 1;
            while ((ptrdiff_t)levels * stride < count && column[(ptrdiff_t)levels * stride * columns] != column[0])
                levels++;
            ruled = is_ruled(count, columns, column, stride, levels);
            stride *= levels;
        }
        if (ruled && stride == count)
            return true;
    }
    return false;
}

/* Sums of pairs (x, v) of groups, of which mean(x)/mean(v) is wanted. */
typedef struct ratio {
    int count;
    double x, v, xx, xv, vv;
} ratio;

static void add(ratio *r, double x, double v)
{
    r->count++;
    r->x += x;
    r->v += v;
    r->xx += x * x;
    r->xv += x * v;
    r->vv += v * v;
}

/* The ratio, and its standard error: the error of the mean of x - ratio v, over the mean of v. */
static double ratio_of(const ratio *r, double *error)
{
    double s = r->x / r->v, square = r->xx - 2 * s * r->xv + s * s * r->vv; /* sum of (x - s v)^2, whose mean is 0 */
    *error = sqrt(fmax(square, 0)) / fabs(r->v);
    return s;
}

static double centre_of(int count, int size, const double *value, int *groups)
{
    double sum = 0;
    *groups = 0;
    for (int k = 0; k < count; k += size)
        if (kmp_all_finite(size, value + k)) {
            sum += 0.5 * (value[k] + value[k + 1]);
            ++*groups;
        }
    return *groups > 0 ? sum / *groups : 0;
}

int kmp_sobol_indices(int count, int columns, const double *value, kmp_sobol_index *indices)
{
    int size = kmp_saltelli_group(columns), groups;
    double centre = centre_of(count, size, value, &groups);
    for (int i = 0; i < columns; i++) {
        ratio first = {0}, total = {0};
        for (int k = 0; k < count; k += size) {
            const double *f = value + k;
            if (!kmp_all_finite(size, f))
                continue;
            double a = f[0] - centre, b = f[1] - centre, ab = f[2 + i] - centre, v = 0.5 * (a * a + b * b);
            add(&first, b * (ab - a), v);
            add(&total, 0.5 * (a - ab) * (a - ab), v);
        }
        if (!(first.v > 0))
            return 0;
        indices[i].first = ratio_of(&first, &indices[i].first_error);
        indices[i].total = ratio_of(&total, &indices[i].total_error);
    }
    return groups;
}

/* -- statistics --------------------------------------------------------------------------------------------- */

static const double parts[] = {0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999};
enum { PARTS = sizeof parts / sizeof *parts, MOST_SHOWN = 12 };

/* A value with an interval, NaN where it is open. */
typedef struct estimate {
    double value, low, high;
} estimate;

typedef struct contribution {
    double regression;
    kmp_sobol_index sobol;
} contribution;

typedef struct quantity {
    const char *name, *unit;
    int count;
    estimate mean, deviation, quantile[PARTS];
    double least, largest;
    int least_at, largest_at; /* instances from 0, -1: none */
    double explained;         /* by regression; NaN: there is none */
    int groups;               /* of Saltelli's design; 0: none */
    contribution *of;         /* inputs */
} quantity;

struct kempe_statistics {
    kempe_context *context;
    kmp_arena arena;
    const char *folder; /* that has the instances; NULL: none */
    double confidence;
    int rows, done, inputs, quantities; /* done: instances that reached their end */
    const char **input;
    double *values; /* rows x inputs */
    bool *ok;       /* rows: an independent sample that reached its end */
    int samples;    /* their number */
    bool grid;      /* the rows are a grid and no sample: intervals are unknown */
    bool groups;    /* the rows are groups of Saltelli's design, whose first two rows are independent samples */
    quantity *quantity;
    bool limited;
    int judged, passed;
    estimate yield;
};

/* -- columns of the table ------------------------------------------------------------------------------ */

static bool begins(const char *name, const char *with)
{
    return strncmp(name, with, strlen(with)) == 0;
}

static bool is_state(const char *name)
{
    return begins(name, "q.") || begins(name, "qd.") || begins(name, "state.");
}

/* True for a column of a quantity, or of the final state if `states`. */
static bool is_taken(const kempe_table *t, int c, bool states)
{
    int from = kempe_table_find(t, "t"), to = kempe_table_find(t, "steps");
    return c > from && c < to && !kmp_table_has_words(t, c) && is_state(kempe_table_column_name(t, c)) == states;
}

static int count_taken(const kempe_table *t, bool states)
{
    int count = 0;
    for (int c = 0; c < kempe_table_column_count(t); c++)
        count += is_taken(t, c, states);
    return count;
}

bool kmp_statistics_is_quantity(const kempe_table *t, int c)
{
    return is_taken(t, c, false);
}

bool kmp_statistics_has_quantities(const kempe_table *t)
{
    return count_taken(t, false) > 0;
}

bool kmp_statistics_choose(const kempe_table *t, bool *chosen)
{
    int last = kempe_table_find(t, "t"), limits = kempe_table_find(t, "limits"), steps = kempe_table_find(t, "steps");
    for (int c = 0; c < kempe_table_column_count(t); c++)
        chosen[c] = c <= last || c == limits || c == steps || is_taken(t, c, false);
    return kmp_statistics_has_quantities(t);
}

/* -- one quantity -------------------------------------------------------------------------------------- */

/* Moments: of the deviation the error by the fourth moment, for any distribution. */
static void take_moments(quantity *q, const double *x, double confidence)
{
    double sum = 0, square = 0, fourth = 0, n = q->count;
    for (int k = 0; k < q->count; k++)
        sum += x[k];
    double mean = q->count > 0 ? sum / n : NAN;
    for (int k = 0; k < q->count; k++) {
        double d = (x[k] - mean) * (x[k] - mean);
        square += d;
        fourth += d * d;
    }
    q->mean = q->deviation = (estimate){NAN, NAN, NAN};
    q->mean.value = mean;
    if (q->count < 2)
        return;
    double variance = square / (n - 1), s = sqrt(variance), part = 0.5 * (1 + confidence);
    double t = kmp_student_quantile(part, n - 1) * s / sqrt(n);
    double error = sqrt(fmax(fourth / n - variance * variance * (n - 3) / (n - 1), 0) / n);
    double z = s > 0 ? kmp_normal_quantile(part) * error / (2 * s) : 0;
    q->mean = (estimate){mean, mean - t, mean + t};
    q->deviation = (estimate){s, fmax(s - z, 0), s + z};
}

/* Of ascending values; between two samples by a straight line. */
static estimate quantile_of(int n, const double *x, double part, double confidence)
{
    estimate found = {NAN, NAN, NAN};
    int low, high;
    if (n == 0)
        return found;
    double place = part * (n - 1), below = floor(place);
    int k = (int)below < n - 1 ? (int)below : n - 1, next = k < n - 1 ? k + 1 : k;
    found.value = x[k] + (place - below) * (x[next] - x[k]);
    kmp_quantile_places(n, part, confidence, &low, &high);
    found.low = low >= 1 ? x[low - 1] : NAN;
    found.high = high <= n ? x[high - 1] : NAN;
    return found;
}

/* Values of the rows that have one, with these rows of the inputs; *count of them. */
static void gather(const kempe_statistics *s, const double *x, double *kept, double *rows, quantity *q)
{
    q->least_at = q->largest_at = -1;
    q->least = q->largest = NAN;
    for (int k = 0; k < s->rows; k++) {
        if (!s->ok[k] || !isfinite(x[k]))
            continue;
        if (q->least_at < 0 || x[k] < q->least) {
            q->least = x[k];
            q->least_at = k;
        }
        if (q->largest_at < 0 || x[k] > q->largest) {
            q->largest = x[k];
            q->largest_at = k;
        }
        memcpy(rows + (size_t)q->count * (size_t)s->inputs, s->values + (size_t)k * (size_t)s->inputs,
               (size_t)s->inputs * sizeof *rows);
        kept[q->count++] = x[k];
    }
}

/* Regression and indices; *groups stays 0 where the rows are not groups. */
static void take_contributions(const kempe_statistics *s, const double *x, const double *kept, const double *rows,
                               double *work, quantity *q)
{
    int d = s->inputs;
    double *coefficients = work, explained = NAN;
    kmp_sobol_index *index = KMP_NEW(kmp_sobol_index, d);
    bool regressed = kmp_regression(q->count, d, rows, kept, coefficients, &explained);
    q->groups = s->groups && index ? kmp_sobol_indices(s->rows, d, x, index) : 0;
    q->explained = regressed ? explained : NAN;
    for (int i = 0; i < d; i++)
        q->of[i] = (contribution){.regression = regressed ? coefficients[i] : NAN,
                                  .sobol = q->groups > 0 ? index[i] : (kmp_sobol_index){NAN, NAN, NAN, NAN}};
    kmp_free(index);
}

static bool take_quantity(kempe_statistics *s, const kempe_table *t, int column, quantity *q)
{
    kmp_arena arena = {0};
    size_t rows = (size_t)s->rows, d = (size_t)s->inputs;
    const double *x = kempe_table_values(t, column);
    double *kept = KMP_ARENA_NEW(&arena, double, rows), *inputs = KMP_ARENA_NEW(&arena, double, rows *d),
           *work = KMP_ARENA_NEW(&arena, double, d);
    q->name = kmp_arena_strdup(&s->arena, kempe_table_column_name(t, column));
    q->unit = kmp_arena_strdup(&s->arena, kempe_table_unit(t, column));
    q->of = KMP_ARENA_NEW(&s->arena, contribution, d);
    bool good = !arena.failed && !s->arena.failed;
    if (good) {
        gather(s, x, kept, inputs, q);
        take_contributions(s, x, kept, inputs, work, q);
        take_moments(q, kept, s->confidence);
        kmp_order(q->count, kept);
        for (int k = 0; k < PARTS; k++)
            q->quantile[k] = quantile_of(q->count, kept, parts[k], s->confidence);
        if (s->grid) {
            q->mean.low = q->mean.high = q->deviation.low = q->deviation.high = NAN;
            for (int k = 0; k < PARTS; k++)
                q->quantile[k].low = q->quantile[k].high = NAN;
        }
    }
    kmp_arena_free(&arena);
    return good;
}

/* -- making them --------------------------------------------------------------------------------------- */

static void take_rows(kempe_statistics *s, const kempe_table *t, int status)
{
    int limits = kempe_table_find(t, "limits"), size = kmp_saltelli_group(s->inputs);
    s->limited = limits >= 0;
    for (int k = 0; k < s->rows; k++)
        for (int i = 0; i < s->inputs; i++)
            s->values[(ptrdiff_t)k * s->inputs + i] = kmp_table_in_si(t, k, i);
    s->groups = kmp_is_saltelli(s->rows, s->inputs, s->values);
    s->grid = !s->groups && kmp_is_grid(s->rows, s->inputs, s->values);
    for (int k = 0; k < s->rows; k++) {
        bool done = kmp_outcome_is_complete(kmp_outcome_read(kempe_table_word(t, k, status)));
        bool sample = !s->groups || k % size < 2;
        s->ok[k] = done && sample;
        s->samples += s->ok[k];
        s->done += done;
        const char *verdict = s->limited && sample ? kempe_table_word(t, k, limits) : "";
        s->judged += *verdict != '\0';
        s->passed += strcmp(verdict, "pass") == 0;
    }
    s->yield = (estimate){NAN, NAN, NAN};
    if (s->judged == 0)
        return;
    s->yield.value = (double)s->passed / s->judged;
    if (!s->grid)
        kmp_chance_interval(s->passed, s->judged, s->confidence, &s->yield.low, &s->yield.high);
}

static kempe_status make(kempe_statistics *s, const kempe_table *t)
{
    int status = kempe_table_find(t, "status"), at = 0;
    if (status < 0 || kempe_table_find(t, "t") != status + 1 || kempe_table_find(t, "steps") < 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT, "statistics need a table of instances, not '%s'",
                        kempe_table_name(t));
    bool states = count_taken(t, false) == 0;
    s->rows = kempe_table_row_count(t);
    s->inputs = status;
    s->quantities = count_taken(t, states);
    bool ok = KMP_ARENA_MAKE(&s->arena, KMP_ROOM(const char *, s->inputs, &s->input),
                             KMP_ROOM(double, (size_t)s->rows *(size_t)s->inputs, &s->values),
                             KMP_ROOM(bool, s->rows, &s->ok), KMP_ROOM(quantity, s->quantities, &s->quantity));
    KMP_TRY(kmp_made(s->context, ok));
    for (int i = 0; i < s->inputs; i++)
        s->input[i] = kmp_arena_strdup(&s->arena, kmp_value_name(kempe_table_column_name(t, i)));
    take_rows(s, t, status);
    for (int c = 0; ok && c < kempe_table_column_count(t); c++)
        if (is_taken(t, c, states))
            ok = take_quantity(s, t, c, &s->quantity[at++]);
    return kmp_made(s->context, ok && !s->arena.failed);
}

kempe_status kempe_statistics_new(const kempe_table *instances, double confidence, kempe_statistics **statistics)
{
    KMP_WANTED(NULL, instances, "instances");
    kempe_context *context = kmp_table_context(instances);
    KMP_WANTED(context, statistics, "statistics");
    kmp_context_clear(context);
    confidence = confidence == 0 ? 0.95 : confidence;
    if (!(confidence > 0 && confidence < 1))
        return kmp_fail(context, KEMPE_E_ARGUMENT, "the confidence is %.6g: it must be between 0 and 1", confidence);
    KMP_MAKE(context, kempe_statistics, s);
    s->context = context;
    s->confidence = confidence;
    kempe_status status = make(s, instances);
    return KMP_GIVE_OR_FREE(status, statistics, s, kempe_statistics_free);
}

kempe_status kmp_statistics_of_folder(const kempe_table *instances, const char *folder, kempe_statistics **statistics)
{
    KMP_TRY(kempe_statistics_new(instances, 0, statistics));
    kempe_statistics *s = *statistics;
    s->folder = kmp_arena_strdup(&s->arena, folder);
    return kmp_made(s->context, !s->arena.failed);
}

KMP_FREES(kempe_statistics, s, kmp_arena_free(&s->arena))

/* -- tables -------------------------------------------------------------------------------------------- */

static kmp_shown shown_of(const kempe_statistics *s, const quantity *q)
{
    return kmp_shown_as(s->context, kmp_print_unknown(s->context, q->unit));
}

static void fill_moments(kempe_table *t, const void *result)
{
    const kempe_statistics *s = result;
    kmp_tabulate_columns(t, "quantity[words] unit[words] count mean mean_low mean_high deviation deviation_low "
                            "deviation_high");
    for (const quantity *q = s->quantity; q < s->quantity + s->quantities; q++) {
        const kmp_shown as = shown_of(s, q);
        KMP_TABULATE(t, "%s %s %d %g %g %g %g %g %g", q->name, as.unit, q->count, as.factor * q->mean.value,
                     as.factor * q->mean.low, as.factor * q->mean.high, as.factor * q->deviation.value,
                     as.factor * q->deviation.low, as.factor * q->deviation.high);
    }
}

static void fill_quantiles(kempe_table *t, const void *result)
{
    const kempe_statistics *s = result;
    kmp_tabulate_columns(t, "quantity[words] unit[words] part value low high");
    for (const quantity *q = s->quantity; q < s->quantity + s->quantities; q++)
        for (int k = 0; k < PARTS; k++)
            KMP_TABULATE(t, "%s %s %g %g %g %g", q->name, shown_of(s, q).unit, parts[k],
                         shown_of(s, q).factor * q->quantile[k].value, shown_of(s, q).factor * q->quantile[k].low,
                         shown_of(s, q).factor * q->quantile[k].high);
}

static void fill_within(kempe_table *t, const void *result)
{
    const kempe_statistics *s = result;
    kmp_tabulate_columns(t, "judged passed yield low high");
    if (!s->limited)
        return;
    KMP_TABULATE(t, "%d %d %g %g %g", s->judged, s->passed, s->yield.value, s->yield.low, s->yield.high);
}

static void fill_contributions(kempe_table *t, const void *result)
{
    const kempe_statistics *s = result;
    kmp_tabulate_columns(t, "quantity[words] input[words] regression explained first first_error total total_error");
    for (const quantity *q = s->quantity; q < s->quantity + s->quantities; q++)
        for (int i = 0; i < s->inputs; i++) {
            const contribution *of = &q->of[i];
            KMP_TABULATE(t, "%s %s %g %g %g %g %g %g", q->name, s->input[i], of->regression, q->explained,
                         of->sobol.first, of->sobol.first_error, of->sobol.total, of->sobol.total_error);
        }
}

/* "--set a=1 --set b=2" of an instance; "" if a start value varies. Of a folder "--from FOLDER --instance 1". */
static char *settings_of(const kempe_statistics *s, int k)
{
    kmp_text text = {0};
    if (s->folder && k >= 0) {
        kmp_text_put(&text, "--from ");
        kmp_text_shell(&text, s->folder);
        kmp_text_printf(&text, " --instance %d", k + 1);
    }
    for (int i = 0; !s->folder && k >= 0 && i < s->inputs; i++) {
        if (is_state(s->input[i])) {
            kmp_text_free(&text);
            return kmp_strdup("");
        }
        kmp_text_printf(&text, "%s--set %s=", i > 0 ? " " : "", s->input[i]);
        kmp_text_number(&text, s->values[(ptrdiff_t)k * s->inputs + i]);
    }
    return text.length > 0 ? kmp_text_take(&text) : kmp_strdup("");
}

static void put_extreme(kempe_table *t, const kempe_statistics *s, const quantity *q, bool largest)
{
    int at = largest ? q->largest_at : q->least_at;
    char *settings = settings_of(s, at);
    const kmp_shown as = shown_of(s, q);
    KMP_TABULATE(t, "%s %s %s %g %g %s", q->name, as.unit, largest ? "largest" : "least",
                 as.factor * (largest ? q->largest : q->least), at >= 0 ? at + 1.0 : NAN, settings ? settings : "");
    if (!settings)
        kmp_tabulate_fail(t);
    kmp_free(settings);
}

static void fill_extremes(kempe_table *t, const void *result)
{
    const kempe_statistics *s = result;
    kmp_tabulate_columns(t, "quantity[words] unit[words] extreme[words] value instance settings[words]");
    for (const quantity *q = s->quantity; q < s->quantity + s->quantities; q++) {
        put_extreme(t, s, q, false);
        put_extreme(t, s, q, true);
    }
}

KMP_TABLES(kempe_statistics, statistics, statistics->context, {"moments", fill_moments}, {"quantiles", fill_quantiles},
           {"within", fill_within}, {"contributions", fill_contributions}, {"extremes", fill_extremes})

/* -- text ---------------------------------------------------------------------------------------------- */

/* The command that repeats an instance of a folder. */
static void put_replay(kmp_text *text, const kempe_statistics *s, int at, const char *which)
{
    char *settings = settings_of(s, at);
    text->failed = text->failed || !settings;
    kmp_text_printf(text, "  %-9s kempe simulate %s\n", which, settings ? settings : "");
    kmp_free(settings);
}

enum { FEWEST_DIGITS = 6, MOST_DIGITS = 15 };

/* The digits with which values of a size show differences of a step, of which two digits are seen. */
static int digits_of(double size, double step)
{
    const double digits = size > 0 && step > 0 ? ceil(log10(size / step)) + 2 : FEWEST_DIGITS;
    return digits > MOST_DIGITS ? MOST_DIGITS : digits > FEWEST_DIGITS ? (int)digits : FEWEST_DIGITS;
}

static void put_quantity(kmp_text *text, const kempe_statistics *s, const quantity *q)
{
    const int d = digits_of(fabs(q->mean.value), q->deviation.value),
              m = s->grid ? d : digits_of(fabs(q->mean.value), q->mean.high - q->mean.low);
    const estimate *low = &q->quantile[2], *middle = &q->quantile[4], *high = &q->quantile[6];
    const kmp_shown as = shown_of(s, q);
    kmp_text_printf(text, "%s%s%s%s", q->name, *as.unit ? " [" : "", as.unit, *as.unit ? "]" : "");
    if (q->count < s->samples)
        kmp_text_printf(text, ", known in %d of %d %s", q->count, s->samples,
                        s->grid ? "instances" : "independent samples");
    kmp_text_put(text, "\n");
    if (q->count == 1) /* no statistics */
        kmp_text_printf(text, "  value     %.*g\n", d, as.factor * q->least);
    if (q->count <= 1)
        return;
    kmp_text words = {0};
    if (s->grid)
        kmp_text_printf(&words, "%.*g, standard deviation %.3g", m, as.factor * q->mean.value,
                        as.factor * q->deviation.value);
    else
        kmp_text_printf(&words, "%.*g (%.*g to %.*g), standard deviation %.3g (%.3g to %.3g)", m,
                        as.factor * q->mean.value, m, as.factor * q->mean.low, m, as.factor * q->mean.high,
                        as.factor * q->deviation.value, as.factor * q->deviation.low, as.factor * q->deviation.high);
    kmp_print_wrapped(text, "  mean      ", 12, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
    kmp_text_printf(text, "  quantiles 5 %% %.*g, 50 %% %.*g, 95 %% %.*g\n", d, as.factor * low->value, d,
                    as.factor * middle->value, d, as.factor * high->value);
    if (q->least_at >= 0)
        kmp_text_printf(text, "  extremes  %.*g in instance %d, %.*g in instance %d\n", d, as.factor * q->least,
                        q->least_at + 1, d, as.factor * q->largest, q->largest_at + 1);
    if (q->least_at >= 0 && s->folder) {
        put_replay(text, s, q->least_at, "least");
        put_replay(text, s, q->largest_at, "largest");
    }
}

/* Sobol's indices, or else regression. */
static void put_contributions(kmp_text *text, const kempe_statistics *s, const quantity *q)
{
    bool indices = q->groups > 0;
    if (!indices && isnan(q->explained))
        return;
    if (indices)
        kmp_text_put(text, "  indices   of Sobol, first order (standard error) and total:");
    else
        kmp_text_printf(text, "  inputs    standardised regression (%.4g of the variance):", q->explained);
    for (int i = 0; i < s->inputs && i < MOST_SHOWN; i++) {
        const kmp_sobol_index *x = &q->of[i].sobol;
        if (indices)
            kmp_text_printf(text, "%s %s %.3f (%.1g) %.3f (%.1g)", i > 0 ? "," : "", s->input[i], x->first,
                            x->first_error, x->total, x->total_error);
        else
            kmp_text_printf(text, "%s %s %.3f", i > 0 ? "," : "", s->input[i], q->of[i].regression);
    }
    kmp_text_put(text, s->inputs > MOST_SHOWN ? ", ..\n" : "\n");
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_statistics *s = result;
    if (s->rows == 1)
        kmp_text_put(text, "quantities of the instance\n");
    else if (s->grid)
        kmp_text_printf(text,
                        "statistics of %d of %d instances of a grid, without intervals, which belong to samples\n",
                        s->done, s->rows);
    else
        kmp_text_printf(text, "statistics of %d of %d instances, intervals of %.4g %% confidence\n", s->done, s->rows,
                        100 * s->confidence);
    if (s->limited && s->rows == 1)
        kmp_text_printf(text, "limits    %s\n", s->passed ? "pass" : s->judged ? "fail" : "not known");
    else if (s->limited && s->grid)
        kmp_text_printf(text, "yield     %.6g %%: %d of %d instances whose quantities are known\n",
                        100 * s->yield.value, s->passed, s->judged);
    else if (s->limited)
        kmp_text_printf(text, "yield     %.6g %% (%.6g to %.6g): %d of %d instances whose quantities are known\n",
                        100 * s->yield.value, 100 * s->yield.low, 100 * s->yield.high, s->passed, s->judged);
    for (int k = 0; k < s->quantities && k < MOST_SHOWN; k++) {
        put_quantity(text, s, &s->quantity[k]);
        put_contributions(text, s, &s->quantity[k]);
    }
    if (s->quantities > MOST_SHOWN)
        kmp_text_printf(text, "and %d more\n", s->quantities - MOST_SHOWN);
}

static void put_estimate(kmp_json *json, const char *key, const estimate *e)
{
    kmp_json_put(json, "%s { value %g low %g high %g }", key, e->value, e->low, e->high);
}

static void put_quantity_json(kmp_json *json, const kempe_statistics *s, const quantity *q)
{
    kmp_json_put(json, "{ name %s unit %s count %d", q->name, q->unit, q->count);
    put_estimate(json, "mean", &q->mean);
    put_estimate(json, "deviation", &q->deviation);
    kmp_json_put(json, "least { value %g instance %d } largest { value %g instance %d } quantiles [", q->least,
                 q->least_at + 1, q->largest, q->largest_at + 1);
    for (int k = 0; k < PARTS; k++)
        kmp_json_put(json, "{ part %g value %g low %g high %g }", parts[k], q->quantile[k].value, q->quantile[k].low,
                     q->quantile[k].high);
    kmp_json_put(json, "] explained %g groups %d contributions [", q->explained, q->groups);
    for (int i = 0; i < s->inputs; i++)
        kmp_json_put(json, "{ input %s regression %g first %g first_error %g total %g total_error %g }", s->input[i],
                     q->of[i].regression, q->of[i].sobol.first, q->of[i].sobol.first_error, q->of[i].sobol.total,
                     q->of[i].sobol.total_error);
    kmp_json_put(json, "] }");
}

static void put_all(kmp_json *json, const char *key, const kempe_statistics *s)
{
    kmp_json_object(json, key);
    kmp_json_put(json, "instances %d used %d confidence %g judged %d passed %d", s->rows, s->done, s->confidence,
                 s->judged, s->passed);
    put_estimate(json, "yield", &s->yield);
    kmp_json_put(json, "quantities [");
    for (int k = 0; k < s->quantities; k++)
        put_quantity_json(json, s, &s->quantity[k]);
    kmp_json_put(json, "] }");
}

static void put_json(kmp_text *text, const void *result)
{
    kmp_json json = kmp_json_begin(text);
    put_all(&json, NULL, result);
}

void kmp_statistics_put(kmp_json *json, const char *key, const kempe_statistics *statistics)
{
    if (statistics)
        put_all(json, key, statistics);
    else
        kmp_json_string(json, key, NULL);
}

bool kmp_statistics_yield(const kempe_statistics *s, double *part, double *low, double *high)
{
    *part = s->yield.value;
    *low = s->yield.low;
    *high = s->yield.high;
    return s->judged > 0;
}

KMP_PRINT(kempe_statistics, statistics, statistics->context, put_json, put_text)
