/* SPDX-License-Identifier: BSD-3-Clause */
/* Judgement of a run from its rows: residuals of closures, drift of the energy over its scale, and the largest errors
 * against a reference. A value that is not a number makes its measure the same, so that it cannot pass. */
#include "output/verdict.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "model/data/state.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Kinetic energy below this part of the potential's value counts as rounding, as in a mechanism at rest. */
#define AT_REST 1e-9

/* The sums over rows for the energy's drift. */
typedef struct balance {
    double first;           /* E - work of the first row */
    double drift;           /* max |E - work - first| */
    double kinetic;         /* max */
    double lowest, highest; /* potential energy */
    double least, most;     /* work since the start */
    double value;           /* max |potential energy|, independent of its zero */
} balance;

kmp_verdict kmp_verdict_none(void)
{
    return (kmp_verdict){
        .h_max = NAN, .hdot_max = NAN, .misfit_row = -1, .drift_rel = NAN, .error = {NAN, NAN, NAN, NAN}};
}

/* fmax that returns NaN if an operand is NaN. */
static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

static void add_energy(balance *b, double kinetic, double potential, double work, bool is_first)
{
    double left = kinetic + potential - work;
    if (is_first)
        *b = (balance){.first = left, .lowest = potential, .highest = potential, .least = work, .most = work};
    b->drift = larger(b->drift, fabs(left - b->first));
    b->kinetic = larger(b->kinetic, kinetic);
    b->lowest = fmin(b->lowest, potential);
    b->highest = fmax(b->highest, potential);
    b->least = fmin(b->least, work);
    b->most = fmax(b->most, work);
    b->value = fmax(b->value, fabs(potential));
}

/* Takes the misfit of the rows with the largest residuals, as many as are dropped as redundant. */
static void judge_misfit(kmp_verdict *verdict, double t, kmp_evaluator *eval)
{
    int row;
    kmp_eval_drop_widest(eval);
    double misfit = kmp_eval_misfit(eval, &row);
    if (row < 0 || misfit <= verdict->misfit)
        return;
    verdict->misfit = misfit;
    verdict->misfit_row = row;
    verdict->misfit_t = t;
}

/* The largest range of a coordinate or state over the rows, relative to its size. */
static double find_moved(const kmp_samples *table, const kempe_system *system)
{
    double most = 0;
    for (int k = 0; k < system->n; k++) {
        kmp_quantity quantity = k < kmp_model_coordinates(system->model) ? KMP_QUANTITY_Q : KMP_QUANTITY_QD;
        double low = INFINITY, high = -INFINITY;
        for (int row = 0; row < table->rows; row++) {
            double x = kmp_samples_get(table, quantity, row)[k];
            low = fmin(low, x);
            high = fmax(high, x);
        }
        most = fmax(most, (high - low) / system->scale[k]);
    }
    return most;
}

static void compare_entries(double *error, int count, const double *x, const double *ref, const double *size,
                            double rate)
{
    for (int k = 0; k < count; k++) {
        if (isnan(ref[k]))
            continue;
        double e = fabs(x[k] - ref[k]) / fmax(fabs(ref[k]), size[k] * rate);
        *error = isnan(*error) ? e : larger(*error, e);
    }
}

/* The generalized force of a multiplier: its value times the size of its row of J. */
static double effort(const kempe_system *system, const kmp_reference *reference, int row, double lambda)
{
    return reference->shared && reference->shared[row] ? NAN : fabs(lambda) * system->row_scale[row];
}

/* The largest value of a quantity of coordinates relative to their sizes; 1 where all are 0 or unknown. */
static double largest(const kempe_system *system, const kmp_reference *reference, kmp_quantity quantity)
{
    double most = 0;
    for (int row = 0; row < reference->rows; row++)
        for (int k = 0; k < kmp_model_coordinates(system->model); k++) {
            double x = reference->value[quantity][(size_t)row * (size_t)system->n + (size_t)k];
            most = isnan(x) ? most : fmax(most, fabs(x) / system->scale[k]);
        }
    return most > 0 ? most : 1;
}

kmp_scales kmp_verdict_scales(const kempe_system *system, const kmp_reference *reference)
{
    /* The largest multiplier force of the reference: smaller forces are compared relative to it. 0: there is none. */
    const double *lambda = reference->value[KMP_QUANTITY_LAMBDA];
    double load = 0;
    for (int row = 0; lambda && row < reference->rows; row++)
        for (int k = 0; k < system->m; k++)
            load = fmax(load, effort(system, reference, k, lambda[(size_t)row * (size_t)system->m + (size_t)k]));
    return (kmp_scales){system->length, largest(system, reference, KMP_QUANTITY_QD),
                        largest(system, reference, KMP_QUANTITY_QDD), load > 0 ? load : 1};
}

static void compare_loads(double *error, const kempe_system *system, const kmp_reference *reference, const double *x,
                          const double *ref, double load)
{
    for (int k = 0; k < system->m; k++) {
        double e = effort(system, reference, k, x[k] - ref[k]) / load;
        if (!isnan(ref[k]) && !(reference->shared && reference->shared[k]))
            *error = isnan(*error) ? e : larger(*error, e);
    }
}

/* Angles of spherical joints that differ by more are other words for some orientation. */
#define OTHER_WORDS 1.0

/* q, qd, qdd of a row (3 n, copied into `row`), with the angles of spherical joints in the reference's range. Two runs
 * may thus pass a singular position on different sides without an error. */
static void use_words_of(const kempe_system *system, const double *ref, double *own, double *row)
{
    int n = system->n;
    kmp_charts_reset(system, own);
    for (int c = 0; c < system->chart_count; c++) {
        int first = system->chart_first[c];
        double off = 0; /* stays 0 where the reference has not all three */
        for (int k = first; k < first + 3; k++)
            off = isnan(ref[k]) || isnan(off) ? NAN : fmax(off, fabs(row[k] - ref[k]));
        if (off > OTHER_WORDS)
            (void)kmp_chart_show(system, c, own, ref + first, row, row + n, row + 2 * n);
    }
}

/* Both tables ascend: one walk along the two. `room`: for a row and the charts, NULL where there are none. */
static void compare_rows(double *error, const kmp_samples *table, const kmp_reference *reference, double until,
                         const kempe_system *system, double *room)
{
    size_t n = (size_t)table->n, m = (size_t)table->m;
    kmp_scales scales = kmp_verdict_scales(system, reference);
    for (int row = 0, r = 0; row < table->rows; row++) {
        double t = kmp_samples_time(table, row);
        while (r < reference->rows && reference->t[r] < t)
            r++;
        if (r == reference->rows || t > until || !(reference->t[r] <= t))
            continue;
        if (room) {
            for (size_t k = 0; k < KMP_QUANTITY_LAMBDA; k++)
                memcpy(room + k * n, kmp_samples_get(table, (kmp_quantity)k, row), n * sizeof *room);
            use_words_of(system, reference->value[KMP_QUANTITY_Q] + (size_t)r * n, room + 3 * n, room);
        }
        /* The integrals of states are not results. */
        const double rates[KMP_QUANTITY_LAMBDA] = {1, scales.rate, scales.acceleration};
        for (int k = 0; k < KMP_QUANTITY_LAMBDA; k++) {
            const double *x = room ? room + (ptrdiff_t)k * table->n : kmp_samples_get(table, (kmp_quantity)k, row);
            int count = k == KMP_QUANTITY_Q ? kmp_model_coordinates(system->model) : table->n;
            compare_entries(&error[k], count, x, reference->value[k] + (size_t)r * (size_t)table->n, system->scale,
                            rates[k]);
        }
        if (m > 0)
            compare_loads(&error[KMP_QUANTITY_LAMBDA], system, reference,
                          kmp_samples_get(table, KMP_QUANTITY_LAMBDA, row),
                          reference->value[KMP_QUANTITY_LAMBDA] + (size_t)r * m, scales.load);
    }
}

void kmp_verdict_errors(const kmp_samples *table, const kempe_system *system, const kmp_reference *reference,
                        double until, double error[KMP_QUANTITIES])
{
    int charts = kmp_charts_count(system);
    double *room = charts > 0 ? KMP_NEW(double, 3 * system->n + KMP_CHART_SIZE * charts) : NULL;
    for (int k = 0; k < KMP_QUANTITIES; k++)
        error[k] = NAN;
    compare_rows(error, table, reference, until, system, room);
    kmp_free(room);
}

double kmp_verdict_drift(double drift, double exchanged, double potential)
{
    double size = fmax(exchanged, AT_REST * fabs(potential));
    return size > 0 ? drift / size : 0;
}

kmp_verdict kmp_verdict_of(const kmp_samples *table, kmp_evaluator *eval, const kmp_reference *reference)
{
    kmp_verdict verdict = kmp_verdict_none();
    balance b = {0};
    if (table->rows == 0)
        return verdict;
    verdict.h_max = verdict.hdot_max = 0;
    for (int row = 0; row < table->rows; row++) {
        double t = kmp_samples_time(table, row);
        const double *q = kmp_samples_get(table, KMP_QUANTITY_Q, row),
                     *qd = kmp_samples_get(table, KMP_QUANTITY_QD, row);
        kmp_eval_closure(eval, t, q);
        kmp_eval_mass(eval);
        judge_misfit(&verdict, t, eval);
        verdict.h_max = larger(verdict.h_max, kmp_eval_residual(eval));
        verdict.hdot_max = larger(verdict.hdot_max, kmp_eval_rate_residual(eval, qd));
        double kinetic, potential;
        kmp_eval_energies(eval, qd, &kinetic, &potential);
        add_energy(&b, kinetic, potential, kmp_samples_work(table, row), row == 0);
    }
    verdict.moved = find_moved(table, eval->system);
    const double exchanged = fmax(b.kinetic, b.highest - b.lowest);
    verdict.drift_rel = kmp_verdict_drift(b.drift, exchanged, b.value);
    verdict.drift = b.drift;
    verdict.left = kmp_verdict_drift(b.drift, fmax(exchanged, b.most - b.least), b.value);
    if (reference)
        kmp_verdict_errors(table, eval->system, reference, INFINITY, verdict.error);
    return verdict;
}
