/* SPDX-License-Identifier: BSD-3-Clause */
/* Averages over places as a block of the graph, and their evaluation. The largest exponent is subtracted from all, so
 * that nothing overflows. Sums run in four lanes, which are added at the end: the bits are the same with and without
 * vectors. */
#include "rail/places/average.h"
#include "base/arena.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "rail/places/scan.h"
#include "symbolic/blocks.h"
#include "symbolic/derivative.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/places.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { LANES = KMP_SCAN_GROUP, EXPONENT = 1, AVERAGED = 2 }; /* stages */

/* -- in the graph ------------------------------------------------------------------------------------ */

static bool make_average_block(kmp_implicit *b, kmp_ref exponent, kmp_ref needed, int count, const kmp_ref *averaged,
                               int places, const double *place)
{
    b->row = KMP_GRAPH_NEW(b->local, kmp_ref, count + 2);
    b->derived = KMP_GRAPH_NEW(b->local, int, 1);
    if (kmp_graph_failed(b->local) || kmp_graph_implicit(b->local, 0) || !kmp_block_candidates(b, places, place))
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
    b->block = (kmp_program_block){.unknowns = count + 1, .arguments = arguments, .averages = true};
    if (make_average_block(b, exponent, needed, count, averaged, places, place))
        return b;
    kmp_implicit_free(b);
    return NULL;
}

/* -- once -------------------------------------------------------------------------------------------- */

/* The expressions of a block to be made. */
typedef struct wanted {
    const kmp_graph *local;
    int arguments, count, places;
    kmp_ref exponent, needed;
    const kmp_ref *averaged;
    const double *place;
} wanted;

/* True to the bit. */
static bool is_same(double x, double y)
{
    return memcmp(&x, &y, sizeof x) == 0;
}

/* True if the first nodes of a graph, and its first tables, equal another graph's. */
static bool begins_as(const kmp_graph *g, const kmp_graph *other)
{
    uint32_t count = kmp_graph_count(other);
    if (count > kmp_graph_count(g))
        return false;
    for (int k = 0; kmp_graph_table(other, k); k++)
        if (kmp_graph_table(g, k) != kmp_graph_table(other, k))
            return false;
    for (uint32_t id = 0; id < count; id++) {
        const kmp_node *n = kmp_graph_node(g, id), *m = kmp_graph_node(other, id);
        if (n->op != m->op || n->a != m->a || n->b != m->b || n->c != m->c ||
            (n->op == KMP_OP_CONST && !is_same(kmp_graph_value(g, id), kmp_graph_value(other, id))))
            return false;
    }
    return true;
}

static bool is_of(const kmp_implicit *b, const void *user)
{
    const wanted *w = user;
    size_t rows = (size_t)w->count * sizeof *b->row, places = (size_t)w->places * sizeof *w->place;
    return b->block.averages && b->block.unknowns == w->count + 1 && b->block.arguments == w->arguments &&
           b->block.candidates == w->places && b->row[0] == w->exponent && b->row[w->count + 1] == w->needed &&
           memcmp(b->row + 1, w->averaged, rows) == 0 && memcmp(b->block.candidate, w->place, places) == 0 &&
           begins_as(b->local, w->local);
}

int kmp_average_in(kmp_graph *g, kmp_graph *local, int arguments, kmp_ref exponent, kmp_ref needed, int count,
                   const kmp_ref *averaged, int places, const double *place)
{
    const wanted w = {local, arguments, count, places, exponent, needed, averaged, place};
    int found = kmp_graph_failed(local) ? -1 : kmp_graph_find_implicit(g, is_of, &w);
    if (found < 0)
        return kmp_graph_add_implicit(
            g, kmp_average_new(local, arguments, exponent, needed, count, averaged, places, place));
    kmp_graph_free(local);
    return found;
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

/* The block with the averages of derivatives: component 1 + l rows + k belongs to argument l and row k. */
static kmp_implicit *derive(const kmp_implicit *b)
{
    int rows = b->block.unknowns, m = b->block.arguments;
    kmp_graph *local = kmp_graph_new();
    if (!local)
        return NULL;
    kmp_ref *argument = KMP_GRAPH_NEW(local, kmp_ref, m), *row = KMP_GRAPH_NEW(local, kmp_ref, rows + 1);
    kmp_ref *slope = KMP_GRAPH_NEW(local, kmp_ref, rows * m);
    if (!argument || !row || !slope || !copy_rows(b, local, argument, row)) {
        kmp_graph_free(local);
        return NULL;
    }
    /* Rows of derivatives for each argument in turn: dE, then df_k + f_k dE for each k. */
    static const kmp_ref one = KMP_ONE;
    for (int l = 0; l < m; l++) {
        kmp_ref *of = slope + l * rows;
        kmp_derivative *d = kmp_derivative_new(local, 1, &argument[l], &one);
        of[0] = kmp_derivative_of(d, row[0]);
        for (int k = 1; k < rows; k++)
            of[k] = kmp_add(local, kmp_derivative_of(d, row[k]), kmp_mul(local, row[k], of[0]));
        kmp_derivative_free(d);
    }
    return kmp_average_new(local, m, row[0], row[rows], rows * m, slope, b->block.candidates, b->block.candidate);
}

kmp_ref kmp_average_derivative(kmp_graph *g, int block, int component, kmp_ref list, kmp_ref differentials)
{
    const kmp_program_block *b = &kmp_graph_implicit(g, block)->block;
    int rows = b->unknowns, m = b->arguments;
    kmp_ref sum = KMP_ZERO, *dp = KMP_GRAPH_NEW(g, kmp_ref, m);
    if (!dp || differentials == KMP_ZERO)
        return sum;
    int *kept = kmp_graph_implicit(g, block)->derived; /* adding a block moves the others */
    if (*kept < 0)
        *kept = kmp_graph_add_implicit(g, derive(kmp_graph_implicit(g, block)));
    const int derived = *kept;
    if (derived < 0)
        return sum;
    kmp_list_items(g, differentials, m, dp);
    for (int l = 0; l < m; l++) {
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
    return sum;
}

/* -- numbers ----------------------------------------------------------------------------------------- */

typedef struct kmp_average {
    const kmp_program_block *block;
    kmp_arena arena; /* of all arrays */
    kmp_scan *scan;  /* at all places, filled up to groups of eight, then one of each group */
    size_t groups;   /* of all places */
    double *place;   /* the places */
    double *spacing; /* by place, 0 in the padding of rows */
    double *weight;  /* by slot: exp(E) times it */
    double *middle;  /* E at the one of each group */
    double *value;
    size_t *first; /* groups that count, and their number; then the values of the middle places */
    size_t count;
    kmp_scan_row exponent, needed, *averaged; /* where the scan has them */
} kmp_average;

/* The weights of places, and the places in the middle of groups. */
static void set_places(kmp_average *a)
{
    const kmp_program_block *b = a->block;
    size_t width = a->groups * LANES, places = (size_t)b->candidates;
    for (size_t k = 0; k < width; k++)
        a->place[k] = b->candidate[k < places ? k : 0];
    for (size_t k = 0; k < places; k++)
        a->spacing[k] = kmp_places_spacing(places, b->candidate, k);
    for (size_t k = 0; k < a->groups; k++)
        a->place[width + k] = b->candidate[kmp_places_middle(places, k)];
    for (size_t k = 0; k * LANES < a->groups; k++)
        a->first[a->groups + k] = width + k * LANES;
}

void *kmp_average_room(const kmp_program_block *block, bool native)
{
    kmp_average *a = KMP_NEW(kmp_average, 1);
    if (!a)
        return NULL;
    a->block = block;
    a->groups = ((size_t)block->candidates + LANES - 1) / LANES;
    size_t width = a->groups * LANES;
    KMP_ARENA_MAKE(&a->arena, KMP_ROOM(double, width + a->groups, &a->place),
                   KMP_ROOM(double, a->groups + LANES, &a->middle), KMP_ROOM(double, block->unknowns, &a->value),
                   KMP_ROOM(size_t, 2 * a->groups, &a->first), KMP_ROOM(kmp_scan_row, block->unknowns, &a->averaged));
    a->spacing = kmp_arena_aligned(&a->arena, width);
    a->weight = kmp_arena_aligned(&a->arena, width);
    if (!a->arena.failed) {
        set_places(a);
        a->scan = kmp_scan_new(block, (int)(width + a->groups), a->place, native);
    }
    if (!a->scan) {
        kmp_average_room_free(a);
        return NULL;
    }
    a->exponent = kmp_scan_output(a->scan, EXPONENT, 0);
    a->needed = kmp_scan_output(a->scan, EXPONENT, 1);
    for (int k = 1; k < a->block->unknowns; k++)
        a->averaged[k] = kmp_scan_output(a->scan, AVERAGED, k - 1);
    return a;
}

void kmp_average_room_free(void *average)
{
    kmp_average *a = average;
    if (!a)
        return;
    kmp_scan_free(a->scan);
    kmp_arena_free(&a->arena);
    kmp_free(a);
}

kmp_counts kmp_average_count(const void *average)
{
    return kmp_scan_count(((const kmp_average *)average)->scan);
}

/* exp(x) for x <= 0: x = n log 2 + r, |r| <= log(2)/2, and the series of exp(r), whose remainder is below 1e-17. A
 * result below the normal range is 0: there x + 700 has a sign. Eights are not compared, which compilers do one by one.
 */
static KMP_INTO_CLONES void power_of_e(const kmp_eight *x, kmp_eight *power)
{
    static const double shift = 0x1.8p52, high = 0x1.62e42fefa3800p-1, low = 0x1.ef35793c76730p-45;
    static const double series[] = {
        1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320, 1.0 / 5040,
        1.0 / 720,        1.0 / 120,       1.0 / 24,       1.0 / 6,       0.5,          1,           1};
    const kmp_eight_mask gone = (kmp_eight_mask)(*x + 700) >> 63;
    const kmp_eight n = *x * 0x1.71547652b82fep0 + shift, whole = n - shift;
    const kmp_eight r = (*x - whole * high) - whole * low;
    kmp_eight sum = r * series[0] + series[1];
#pragma GCC unroll 12
    for (size_t k = 2; k < sizeof series / sizeof *series; k++)
        sum = sum * r + series[k];
    *power = (kmp_eight)(((kmp_eight_mask)sum + ((kmp_eight_mask)n << 52)) & ~gone);
}

static KMP_INTO_CLONES double sum_of(const kmp_four *x)
{
    return ((*x)[0] + (*x)[1]) + ((*x)[2] + (*x)[3]);
}

/* Loops over the groups that count: the first place of each, and its slot. */
#define EACH(a, at, slot)                                                                                              \
    for (size_t group = 0, at, slot; group < (a)->count && (at = (a)->first[group], slot = group * LANES, true);       \
         group++)

/* Weights, and their sum. */
KMP_CLONES static double weigh(const kmp_average *a, const kmp_scan_row *exponent, double most)
{
    kmp_four sum = {0};
    kmp_eight power;
    EACH(a, at, slot)
    {
        const kmp_eight x = exponent->sign * KMP_EIGHT_CONST(kmp_scan_at(exponent, at, slot)) - most;
        power_of_e(&x, &power);
        KMP_EIGHT_AT(a->weight + slot) = power * KMP_EIGHT_CONST(a->spacing + at);
    }
    for (size_t slot = 0; slot < a->count * LANES; slot += KMP_FOUR)
        sum += KMP_FOUR_CONST(a->weight + slot);
    return sum_of(&sum);
}

KMP_CLONES static double weighed(const kmp_average *a, const kmp_scan_row *row)
{
    kmp_four sum = {0};
    EACH(a, at, slot)
    for (size_t half = 0; half < LANES; half += KMP_FOUR)
        sum += KMP_FOUR_CONST(a->weight + slot + half) * KMP_FOUR_CONST(kmp_scan_at(row, at, slot) + half);
    return row->sign * sum_of(&sum);
}

/* The larger one; NaN stays. */
static KMP_INTO_CLONES void take_larger(kmp_four *most, const kmp_four *x)
{
    *most = KMP_FOUR_SELECT((*x <= *most) | (*most != *most), *most, *x);
}

/* The largest exponent of the groups that count; NaN, if a value is NaN. */
KMP_CLONES static double largest(const kmp_average *a, const kmp_scan_row *exponent)
{
    kmp_four most = KMP_FOUR_ALL(-INFINITY), other = most;
    EACH(a, at, slot)
    {
        const double *e = kmp_scan_at(exponent, at, slot);
        const kmp_four x = exponent->sign * KMP_FOUR_CONST(e), y = exponent->sign * KMP_FOUR_CONST(e + KMP_FOUR);
        take_larger(&most, &x);
        take_larger(&other, &y);
    }
    take_larger(&most, &other);
    return kmp_places_larger(kmp_places_larger(most[0], most[1]), kmp_places_larger(most[2], most[3]));
}

const double *kmp_average_run(void *average, const double *arguments)
{
    kmp_average *a = average;
    size_t best;
    kmp_scan_set(a->scan, arguments);
    /* Finds the groups that may count by the exponents in their middle; `best` as kmp_places_choose has it. */
    kmp_scan_groups(a->scan, EXPONENT, (a->groups + LANES - 1) / LANES, a->first + a->groups, 0);
    const kmp_scan_row e = a->exponent, needed = a->needed;
    const size_t from = a->groups * LANES;
    for (size_t k = 0; k < a->groups; k++)
        a->middle[k] = e.sign * *kmp_scan_at(&e, from + k, k);
    a->count = kmp_places_choose(a->groups, a->middle, needed.sign * *kmp_scan_at(&needed, from, 0), a->first, &best);
    if (a->count == 0) {
        /* The values in the middle of a group. */
        size_t at = a->groups * LANES + best;
        kmp_scan_groups(a->scan, AVERAGED, 1, &a->first[a->groups + best / LANES], best / LANES * LANES);
        a->value[0] = a->middle[best] + log(a->spacing[kmp_places_middle((size_t)a->block->candidates, best)]);
        for (int k = 1; k < a->block->unknowns; k++) {
            const kmp_scan_row *x = &a->averaged[k];
            a->value[k] = x->sign * *kmp_scan_at(x, at, best);
        }
        return a->value;
    }
    kmp_scan_groups(a->scan, EXPONENT, a->count, a->first, 0);
    kmp_scan_groups(a->scan, AVERAGED, a->count, a->first, 0);
    double most = largest(a, &a->exponent), all = weigh(a, &a->exponent, most);
    a->value[0] = most + log(all);
    for (int k = 1; k < a->block->unknowns; k++)
        a->value[k] = weighed(a, &a->averaged[k]) / all;
    return a->value;
}
