/* SPDX-License-Identifier: BSD-3-Clause */
/* Averages over places as a block of the graph, and their numbers. The largest exponent is taken out of all, so that
 * nothing overflows. Sums run in eight lanes, which are added at the end: the bits are the same from vectors of any
 * width. */
#include "symbolic/average.h"
#include "base/clones.h"
#include "base/memory.h"
#include "symbolic/blocks.h"
#include "symbolic/derivative.h"
#include "symbolic/scan.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { LANES = 8, EXPONENT = 1, AVERAGED = 2 }; /* stages */

/* -- in the graph ------------------------------------------------------------------------------------ */

static bool begin(kmp_implicit *b, kmp_ref exponent, kmp_ref needed, int count, const kmp_ref *averaged, int places,
                  const double *place)
{
    b->row = KMP_NEW(kmp_ref, count + 2);
    b->derived = KMP_NEW(int, 1);
    if (!b->row || !b->derived || kmp_graph_failed(b->local) || kmp_graph_implicit(b->local, 0) ||
        !kmp_block_candidates(&b->block, places, place))
        return false;
    *b->derived = -1;
    b->row[0] = exponent;
    memcpy(b->row + 1, averaged, (size_t)count * sizeof *averaged);
    b->row[count + 1] = needed;
    const kmp_ref first[2] = {exponent, needed}, *rows[2] = {first, b->row + 1};
    const int counts[2] = {2, count};
    b->block.program = kmp_program_new(b->local, 2, counts, rows);
    return b->block.program;
}

kmp_implicit *kmp_average_new(kmp_graph *local, int arguments, kmp_ref exponent, kmp_ref needed, int count,
                              const kmp_ref *averaged, int places, const double *place)
{
    kmp_implicit *b = KMP_NEW(kmp_implicit, 1);
    if (!b) {
        kmp_graph_free(local);
        return NULL;
    }
    b->local = local;
    b->block = (kmp_block){.unknowns = count + 1, .arguments = arguments, .averages = true};
    if (begin(b, exponent, needed, count, averaged, places, place))
        return b;
    kmp_implicit_free(b);
    return NULL;
}

/* The rows of a block in another graph, places and arguments being its inputs again. */
static bool copy_rows(const kmp_implicit *b, kmp_graph *to, kmp_ref *argument, kmp_ref *row)
{
    kmp_ref place = kmp_input(to, KMP_IN_Q, 0);
    for (int l = 0; l < b->block.arguments; l++)
        argument[l] = kmp_input(to, KMP_IN_PARAMETER, (uint32_t)l);
    memcpy(row, b->row, (size_t)(b->block.unknowns + 1) * sizeof *row);
    const kmp_setting s = {to, &place, argument, NULL};
    return kmp_local_import(&s, b->local, b->block.unknowns + 1, row);
}

/* Of each argument in turn: dE, then df_k + f_k dE for each k. */
static bool derive_rows(kmp_graph *g, int rows, const kmp_ref *row, int arguments, const kmp_ref *argument,
                        kmp_ref *slope)
{
    for (int l = 0; l < arguments; l++) {
        kmp_ref one = KMP_ONE, *of = slope + l * rows;
        kmp_derivative *d = kmp_derivative_new(g, 1, &argument[l], &one);
        if (!d)
            return false;
        of[0] = kmp_derivative_of(d, row[0]);
        for (int k = 1; k < rows; k++)
            of[k] = kmp_add(g, kmp_derivative_of(d, row[k]), kmp_mul(g, row[k], of[0]));
        kmp_derivative_free(d);
    }
    return true;
}

/* The block with the averages of derivatives: component 1 + l rows + k belongs to argument l and row k. */
static kmp_implicit *derive(const kmp_implicit *b)
{
    int rows = b->block.unknowns, m = b->block.arguments;
    kmp_graph *local = kmp_graph_new();
    kmp_ref *argument = KMP_NEW(kmp_ref, m), *row = KMP_NEW(kmp_ref, rows + 1), *slope = KMP_NEW(kmp_ref, rows * m);
    kmp_implicit *made = NULL;
    if (local && argument && row && slope && copy_rows(b, local, argument, row) &&
        derive_rows(local, rows, row, m, argument, slope))
        made = kmp_average_new(local, m, row[0], row[rows], rows * m, slope, b->block.candidates, b->block.candidate);
    else
        kmp_graph_free(local);
    kmp_free(argument);
    kmp_free(row);
    kmp_free(slope);
    return made;
}

static int derived_block(kmp_graph *g, int block)
{
    const kmp_implicit *b = kmp_graph_implicit(g, block);
    if (*b->derived < 0) {
        kmp_implicit *made = derive(b);
        int number = made ? kmp_graph_add_implicit(g, made) : -1;
        *b->derived = number;
    }
    return *b->derived;
}

kmp_ref kmp_average_derivative(kmp_graph *g, int block, int component, kmp_ref list, kmp_ref differentials)
{
    const kmp_block *b = &kmp_graph_implicit(g, block)->block;
    int rows = b->unknowns, m = b->arguments, derived = -1;
    kmp_ref sum = KMP_ZERO, *dp = KMP_NEW(kmp_ref, m);
    if (dp && differentials != KMP_ZERO)
        derived = derived_block(g, block);
    if (derived >= 0)
        kmp_list_items(g, differentials, m, dp);
    else if (!dp || differentials != KMP_ZERO)
        kmp_graph_fail(g);
    for (int l = 0; derived >= 0 && l < m; l++) {
        if (dp[l] == KMP_ZERO)
            continue;
        kmp_ref slope = kmp_implicit_component(g, derived, 1 + l * rows + component, list);
        if (component > 0) {
            kmp_ref average = kmp_implicit_component(g, block, component, list);
            kmp_ref weight = kmp_implicit_component(g, derived, 1 + l * rows, list);
            slope = kmp_sub(g, slope, kmp_mul(g, average, weight));
        }
        sum = kmp_add(g, sum, kmp_mul(g, slope, dp[l]));
    }
    kmp_free(dp);
    return sum;
}

/* -- numbers ----------------------------------------------------------------------------------------- */

/* Of exponents that are this much below the largest a sum keeps 1e-10; and what they may rise by within a group, over
 * the line to the next one's middle: with places 1.2 standard deviations of the weights from each other, as far as four
 * of them go. */
#define LOST   24.0
#define RISING 12.0

struct kmp_average {
    const kmp_block *block;
    kmp_scan *scan, *coarse; /* all places; one of each group of eight */
    size_t groups;
    double *middle;  /* those ones */
    double *spacing; /* by place, 0 where rows are filled up */
    double *weight;  /* exp(E) times it */
    double *value;
    size_t *first; /* groups that count, and how many */
    size_t count;
};

/* What a place stands for, and the places in the middle of groups. */
static void measure(kmp_average *a)
{
    const kmp_block *b = a->block;
    for (int k = 0, last = b->candidates - 1; k <= last; k++) {
        double before = b->candidate[k > 0 ? k - 1 : 0], after = b->candidate[k < last ? k + 1 : last];
        a->spacing[k] = (after - before) / 2;
    }
    for (size_t k = 0; k < a->groups; k++) {
        size_t first = k * LANES, last = first + LANES - 1;
        last = last < (size_t)b->candidates ? last : (size_t)b->candidates - 1;
        a->middle[k] = b->candidate[(first + last) / 2];
    }
}

kmp_average *kmp_average_room(const kmp_block *block)
{
    kmp_average *a = KMP_NEW(kmp_average, 1);
    if (!a)
        return NULL;
    a->block = block;
    a->groups = ((size_t)block->candidates + LANES - 1) / LANES;
    size_t width = a->groups * LANES;
    a->spacing = kmp_calloc(2 * width + a->groups, sizeof *a->spacing);
    a->value = KMP_NEW(double, block->unknowns);
    a->first = kmp_calloc(a->groups, sizeof *a->first);
    bool ok = a->spacing && a->value && a->first;
    if (ok) {
        a->weight = a->spacing + width;
        a->middle = a->weight + width;
        measure(a);
        a->scan = kmp_scan_new(block, block->candidates, block->candidate);
        a->coarse = kmp_scan_new(block, (int)a->groups, a->middle);
    }
    if (ok && a->scan && a->coarse)
        return a;
    kmp_average_room_free(a);
    return NULL;
}

void kmp_average_room_free(kmp_average *a)
{
    if (!a)
        return;
    kmp_scan_free(a->scan);
    kmp_scan_free(a->coarse);
    kmp_free(a->spacing);
    kmp_free(a->value);
    kmp_free(a->first);
    kmp_free(a);
}

const double *kmp_average_values(const kmp_average *a)
{
    return a->value;
}

/* exp(x) for x not above 0: x = n log 2 + r, |r| <= log(2)/2, and the series of exp(r), whose rest is below 1e-17. What
 * would not be a normal number is 0. */
static inline double power_of_e(double x)
{
    static const double shift = 0x1.8p52, high = 0x1.62e42fefa3800p-1, low = 0x1.ef35793c76730p-45;
    double least = x < -700 ? -700 : x, n = least * 0x1.71547652b82fep0 + shift, whole = n - shift;
    double r = (least - whole * high) - whole * low;
    double sum = 1.0 / 6227020800;
    sum = sum * r + 1.0 / 479001600;
    sum = sum * r + 1.0 / 39916800;
    sum = sum * r + 1.0 / 3628800;
    sum = sum * r + 1.0 / 362880;
    sum = sum * r + 1.0 / 40320;
    sum = sum * r + 1.0 / 5040;
    sum = sum * r + 1.0 / 720;
    sum = sum * r + 1.0 / 120;
    sum = sum * r + 1.0 / 24;
    sum = sum * r + 1.0 / 6;
    sum = sum * r + 0.5;
    sum = sum * r + 1;
    sum = sum * r + 1;
    int64_t bits, exponent;
    memcpy(&bits, &sum, sizeof bits);
    memcpy(&exponent, &n, sizeof exponent);
    bits += (int64_t)((uint64_t)exponent << 52);
    memcpy(&sum, &bits, sizeof sum);
    return x < -700 ? 0 : sum;
}

static double sum_of(const double *lane)
{
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}

/* Weights, and their sum. */
KMP_CLONES static double weigh(const kmp_average *a, double sign, const double *x, double most)
{
    double lane[LANES] = {0};
    for (size_t j = 0; j < a->count; j++)
        for (size_t l = 0, k = a->first[j]; l < LANES; l++) {
            double w = power_of_e(sign * x[k + l] - most) * a->spacing[k + l];
            a->weight[k + l] = w;
            lane[l] += w;
        }
    return sum_of(lane);
}

KMP_CLONES static double weighed(const kmp_average *a, const double *x)
{
    double lane[LANES] = {0};
    for (size_t j = 0; j < a->count; j++)
        for (size_t l = 0, k = a->first[j]; l < LANES; l++)
            lane[l] += a->weight[k + l] * x[k + l];
    return sum_of(lane);
}

static double larger(double x, double y)
{
    return y <= x || isnan(x) ? x : y; /* NaN stays */
}

/* Chooses the groups that may count; where exponents are no numbers, all. Where less is needed, the one in whose middle
 * the exponent is largest, and whether that is so. */
static bool choose(kmp_average *a, const double *arguments)
{
    double sign, most;
    kmp_scan_set(a->coarse, arguments);
    kmp_scan_every(a->coarse, EXPONENT);
    const double *x = kmp_scan_output(a->coarse, EXPONENT, 0, &sign);
    most = sign * x[0];
    size_t best = 0;
    for (size_t k = 1; k < a->groups; k++) {
        best = sign * x[k] > most ? k : best;
        most = larger(most, sign * x[k]);
    }
    a->count = 0;
    double needed_sign, needed = *kmp_scan_output(a->coarse, EXPONENT, 1, &needed_sign) * needed_sign;
    if (most + 2 * RISING < needed) {
        a->first[a->count++] = best * LANES;
        return true;
    }
    for (size_t k = 0; k < a->groups; k++) {
        double before = k > 0 ? sign * (x[k - 1] - x[k]) : 0, after = k + 1 < a->groups ? sign * (x[k + 1] - x[k]) : 0;
        double rising = larger(larger(before, after), 0) / 2 + RISING;
        if (!(sign * x[k] + rising < most - LOST))
            a->first[a->count++] = k * LANES;
    }
    return false;
}

/* The values in the middle of the only group. */
static void take_one(kmp_average *a)
{
    double sign;
    size_t at = a->first[0], last = (size_t)a->block->candidates - 1;
    at = (at + (at + LANES - 1 < last ? at + LANES - 1 : last)) / 2;
    a->value[0] = kmp_scan_output(a->scan, EXPONENT, 0, &sign)[at];
    a->value[0] = sign * a->value[0] + log(a->spacing[at]);
    for (int k = 1; k < a->block->unknowns; k++) {
        const double *x = kmp_scan_output(a->scan, AVERAGED, k - 1, &sign);
        a->value[k] = sign * x[at];
    }
}

void kmp_average_run(kmp_average *a, const double *arguments)
{
    double sign;
    bool far = choose(a, arguments);
    kmp_scan_set(a->scan, arguments);
    kmp_scan_groups(a->scan, EXPONENT, a->count, a->first);
    kmp_scan_groups(a->scan, AVERAGED, a->count, a->first);
    if (far) {
        take_one(a);
        return;
    }
    const double *exponent = kmp_scan_output(a->scan, EXPONENT, 0, &sign);
    double most = sign * exponent[a->first[0]];
    for (size_t j = 0; j < a->count; j++)
        for (size_t l = 0; l < LANES; l++)
            most = larger(most, sign * exponent[a->first[j] + l]);
    double all = weigh(a, sign, exponent, most);
    a->value[0] = most + log(all);
    for (int k = 1; k < a->block->unknowns; k++) {
        const double *x = kmp_scan_output(a->scan, AVERAGED, k - 1, &sign);
        a->value[k] = sign * weighed(a, x) / all;
    }
}
