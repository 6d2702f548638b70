/* SPDX-License-Identifier: BSD-3-Clause */
/* Tangents of the residual by dual numbers along the system's own program. With qdd and lambda constant, the
 * derivatives of R = M qdd + C - J' lambda, rate = J qd + h_t and curve = J qdd + jdqd by q follow from the derivatives
 * of M, C, J, h_t and jdqd; the derivatives by qd from C and jdqd. */
#include "constraints/evaluation/few_tangents.h"
#include "constraints/evaluation/duals.h"
#include "dynamics/motion.h"
#include "model/data/parameter.h"
#include <string.h>

/* Larger mechanisms are only differentiated: a matrix of more motions takes more than 32 MB. */
enum { MOST_MOTIONS = 2048 };

enum { COMPUTED = 5 };

static const int computed[COMPUTED] = {KMP_R_Q, KMP_R_QD, KMP_RATE_Q, KMP_CURVE_Q, KMP_CURVE_QD};

typedef struct tangent_numbers {
    const kempe_system *system;
    kmp_duals *duals;
    int n, m;
    int at[KMP_TANGENT_BLOCKS]; /* start of each block: rows of n columns; of M and J the entries of their patterns */
    int size;
    double *value;
} tangent_numbers;

/* Positions of the outputs of the motion program. */
typedef struct output_places {
    int jacobian, h_t, mass, bias, jdqd; /* first of each; h_t -1: it is zero */
} output_places;

static output_places find_outputs(const kempe_system *s)
{
    output_places o = {.jacobian = s->m, .h_t = s->rheonomic ? s->m + s->jacobian.count : -1};
    o.mass = s->m + s->jacobian.count + (s->rheonomic ? s->m : 0);
    o.bias = o.mass + s->mass.count;
    o.jdqd = o.bias + s->n;
    return o;
}

/* -- assembly of blocks ---------------------------------------------------------------------------------- */

/* Columns from `first` on of all blocks at an instant; without an instant, possible nonzeros are marked. */
typedef struct pass {
    tangent_numbers *numbers;
    const kmp_instant *at;
    bool *mark;
    output_places out;
    int first, count;
    bool still; /* qdd = 0, so that derivatives of M do not count */
} pass;

/* Adds factor * derivatives of an output to a row of a block. */
static void add_entry(const pass *p, kmp_tangent_block block, int row, int output, double factor)
{
    tangent_numbers *x = p->numbers;
    ptrdiff_t place = x->at[block] + (ptrdiff_t)row * x->n + p->first;
    double slope[KMP_DUALS_WIDTH];
    if (p->mark) {
        uint64_t moves = kmp_duals_moves(x->duals, output);
        for (int j = 0; j < p->count; j++)
            p->mark[place + j] = p->mark[place + j] || (moves >> j & 1u);
        return;
    }
    if (kmp_duals_get(x->duals, output, slope))
        for (int j = 0; j < p->count; j++)
            x->value[place + j] += factor * slope[j];
}

/* Without an evaluation the values of factors do not matter. */
static double entry(const double *v, int k)
{
    return v ? v[k] : 1;
}

static void add_jacobian(const pass *p)
{
    const kmp_pattern *jacobian = &p->numbers->system->jacobian;
    const kmp_instant *at = p->at;
    for (int e = 0; e < jacobian->count; e++) {
        int row = jacobian->row[e], col = jacobian->col[e], output = p->out.jacobian + e;
        add_entry(p, KMP_R_Q, col, output, -entry(at ? at->lambda : NULL, row));
        add_entry(p, KMP_RATE_Q, row, output, entry(at ? at->qd : NULL, col));
        add_entry(p, KMP_CURVE_Q, row, output, entry(at ? at->qdd : NULL, col));
    }
}

static void add_rows(const pass *p, kmp_tangent_block block, int output, int rows)
{
    for (int k = 0; k < rows; k++)
        add_entry(p, block, k, output + k, 1);
}

static void along(const pass *p, kmp_input_kind kind)
{
    if (p->mark)
        kmp_duals_mark(p->numbers->duals, kind, (uint32_t)p->first);
    else
        kmp_duals_along(p->numbers->duals, kind, (uint32_t)p->first, p->still);
}

static void add_mass(const pass *p)
{
    const kmp_pattern *mass = &p->numbers->system->mass;
    const double *qdd = p->at ? p->at->qdd : NULL;
    for (int e = 0; e < mass->count; e++) {
        int row = mass->row[e], col = mass->col[e];
        add_entry(p, KMP_R_Q, row, p->out.mass + e, entry(qdd, col));
        if (row != col)
            add_entry(p, KMP_R_Q, col, p->out.mass + e, entry(qdd, row));
    }
}

static bool is_zero(const double *x, int count)
{
    int k = 0;
    while (k < count && x[k] == 0)
        k++;
    return k == count;
}

/* All blocks but M and J. */
static void add_all(tangent_numbers *x, const kmp_instant *at, bool *mark)
{
    pass p = {.numbers = x, .at = at, .mark = mark, .out = find_outputs(x->system)};
    int width = mark ? KMP_DUALS_MARKED : KMP_DUALS_WIDTH;
    p.still = at && is_zero(at->qdd, x->n);
    for (p.first = 0; p.first < x->n; p.first += width) {
        p.count = x->n - p.first < width ? x->n - p.first : width;
        along(&p, KMP_IN_Q);
        if (!p.still)
            add_mass(&p);
        add_jacobian(&p);
        add_rows(&p, KMP_R_Q, p.out.bias, x->n);
        add_rows(&p, KMP_CURVE_Q, p.out.jdqd, x->m);
        if (p.out.h_t >= 0)
            add_rows(&p, KMP_RATE_Q, p.out.h_t, x->m);
        along(&p, KMP_IN_QD);
        add_rows(&p, KMP_R_QD, p.out.bias, x->n);
        add_rows(&p, KMP_CURVE_QD, p.out.jdqd, x->m);
    }
}

/* -- entries ------------------------------------------------------------------------------------------- */

static int rows_of_numbers(const tangent_numbers *x, int block)
{
    return block == KMP_R_Q || block == KMP_R_QD ? x->n : x->m;
}

/* Lists the entries of M with both triangles. */
static void list_pattern(const tangent_numbers *x, int block, const kmp_pattern *pattern, kmp_listing *list)
{
    for (int e = 0; e < pattern->count; e++) {
        kmp_listing_place(list, block, pattern->row[e], pattern->col[e], x->at[block] + e);
        if (block == KMP_M && pattern->row[e] != pattern->col[e])
            kmp_listing_place(list, block, pattern->col[e], pattern->row[e], x->at[block] + e);
    }
}

/* Makes the tangents in the arena, and adds all entries to the list with positions in the outputs as sources. NULL:
 * no memory. */
static tangent_numbers *tangent_numbers_new(const kempe_system *system, kmp_listing *list, kmp_arena *arena)
{
    tangent_numbers *x = KMP_ARENA_NEW(arena, tangent_numbers, 1);
    if (!x)
        return NULL;
    *x = (tangent_numbers){.system = system, .n = system->n, .m = system->m};
    /* Places of the blocks' numbers. */
    for (int k = 0; k < COMPUTED; k++) {
        x->at[computed[k]] = x->size;
        x->size += rows_of_numbers(x, computed[k]) * x->n;
    }
    x->at[KMP_M] = x->size;
    x->at[KMP_J] = x->at[KMP_M] + x->system->mass.count;
    x->size = x->at[KMP_J] + x->system->jacobian.count;
    bool *mark = KMP_ARENA_NEW(arena, bool, x->size);
    x->duals = kmp_duals_new(system->motion, find_outputs(system).mass, system->mass.count, arena);
    x->value = KMP_ARENA_NEW(arena, double, x->size);
    if (arena->failed)
        return NULL;
    add_all(x, NULL, mark);
    for (int b = 0; b < COMPUTED; b++)
        for (int place = x->at[computed[b]], k = 0; k < rows_of_numbers(x, computed[b]) * x->n; k++)
            if (mark[place + k])
                kmp_listing_place(list, computed[b], k / x->n, k % x->n, place + k);
    list_pattern(x, KMP_M, &system->mass, list);
    list_pattern(x, KMP_J, &system->jacobian, list);
    return list->failed ? NULL : x;
}

/* -- numbers ------------------------------------------------------------------------------------------- */

/* Evaluates all entries; valid until the next call; no allocation. */
static const double *evaluate(void *numbers, const kmp_instant *at)
{
    tangent_numbers *x = numbers;
    const output_places out = find_outputs(x->system);
    kmp_duals_set(x->duals, KMP_IN_TIME, kmp_instant_times(at));
    kmp_duals_set(x->duals, KMP_IN_Q, at->q);
    kmp_duals_set(x->duals, KMP_IN_QD, at->qd);
    kmp_duals_set(x->duals, KMP_IN_CHART, at->chart);
    if (at->mode)
        kmp_duals_set(x->duals, KMP_IN_MODE, at->mode);
    kmp_duals_run(x->duals);
    memset(x->value, 0, (size_t)x->size * sizeof *x->value);
    add_all(x, at, NULL);
    for (int e = 0; e < x->system->mass.count; e++)
        x->value[x->at[KMP_M] + e] = kmp_duals_value(x->duals, out.mass + e);
    for (int e = 0; e < x->system->jacobian.count; e++)
        x->value[x->at[KMP_J] + e] = kmp_duals_value(x->duals, out.jacobian + e);
    return x->value;
}

kempe_status kmp_tangents_init_few(kmp_tangents *tangents, const kempe_system *system, const kmp_backend *backend)
{
    /* Not for user-defined forces, implicit blocks or many coordinates. */
    if (system->force || system->load_row_count > 0 || system->n > MOST_MOTIONS ||
        kmp_motion_need(system) != KEMPE_OK || !kmp_duals_know(system->motion))
        return kmp_tangents_init(tangents, system, backend, kmp_tangents_of_runs(system));
    *tangents = (kmp_tangents){.n = system->n, .m = system->m};
    for (int v = 0; v < KMP_VALUES; v++)
        tangents->at[v] = -1;
    kmp_listing list = {0};
    tangent_numbers *numbers = tangent_numbers_new(system, &list, &tangents->arena);
    tangents->numbers = numbers;
    tangents->by_numbers = evaluate;
    kmp_tangents_sort(tangents, &list);
    if (!numbers || !kmp_tangents_list_columns(tangents)) {
        kmp_tangents_free(tangents);
        return kmp_fail_memory(system->context);
    }
    kmp_duals_set(numbers->duals, KMP_IN_PARAMETER, system->parameters);
    return KEMPE_OK;
}

void kmp_tangents_renew_parameters(kmp_tangents *tangents, const double *parameters)
{
    tangent_numbers *numbers = tangents->numbers;
    if (numbers) {
        kmp_duals_set(numbers->duals, KMP_IN_PARAMETER, parameters);
        return;
    }
    if (tangents->value.machine)
        kmp_formulas_renew(&tangents->value, parameters);
    kmp_formulas_renew(&tangents->tangent, parameters);
}

bool kmp_equations_move_in_time(const kempe_system *system)
{
    const output_places out = find_outputs(system);
    kmp_arena arena = {0};
    kmp_duals *duals = kmp_duals_know(system->motion) ? kmp_duals_new(system->motion, 0, 0, &arena) : NULL;
    const int times = 1 + KMP_TIME_NUMBERS * kmp_model_all_inputs(system->model);
    bool moves = !duals;
    for (int first = 0; !moves && first < times; first += KMP_DUALS_MARKED) {
        kmp_duals_mark(duals, KMP_IN_TIME, (uint32_t)first);
        for (int e = 0; e < system->jacobian.count; e++)
            moves = moves || kmp_duals_moves(duals, out.jacobian + e) != 0;
        for (int k = 0; k < system->n; k++)
            moves = moves || kmp_duals_moves(duals, out.bias + k) != 0;
    }
    kmp_arena_free(&arena);
    return moves;
}
