/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/tangent.h"
#include "base/memory.h"
#include <stdlib.h>
#include <string.h>

/* Blocks of each value by q and by qd; -1: zero, or not needed by anyone. */
static const int by_q[KMP_VALUES] = {KMP_R_Q, KMP_JTMU_Q, -1, KMP_RATE_Q, KMP_CURVE_Q, KMP_POWER_Q};
static const int by_qd[KMP_VALUES] = {KMP_R_QD, -1, -1, -1, KMP_CURVE_QD, KMP_POWER_QD};

/* Expressions of all values asked for, and the tangent outputs found so far. */
typedef struct gather {
    kmp_tangents *t;
    kmp_equations eq;
    kmp_ref *value;
    int value_count, size[KMP_VALUES];
    kmp_ref *output;
    int output_count, output_capacity, entry_count, entry_capacity;
    bool failed;
} gather;

static void *grown(void *list, int count, int *capacity, size_t size)
{
    if (count < *capacity)
        return list;
    void *larger = kmp_realloc(list, (size_t)(2 * count + 256), size);
    if (larger)
        *capacity = 2 * count + 256;
    return larger;
}

/* An expression as tangent output; its number, -1 when it is zero. */
static int output_of(gather *g, kmp_ref r)
{
    if (r == KMP_ZERO || g->failed)
        return -1;
    kmp_ref *output = grown(g->output, g->output_count, &g->output_capacity, sizeof *output);
    g->failed = !output;
    if (g->failed)
        return -1;
    g->output = output;
    g->output[g->output_count] = r;
    return g->output_count++;
}

static void add_entry(gather *g, int block, int row, int col, int source)
{
    if (source < 0 || g->failed)
        return;
    kmp_tangent *entry = grown(g->t->entry, g->entry_count, &g->entry_capacity, sizeof *entry);
    g->failed = !entry;
    if (g->failed)
        return;
    g->t->entry = entry;
    g->t->entry[g->entry_count++] = (kmp_tangent){block, row, col, source};
}

/* -- expressions ------------------------------------------------------------------------------------- */

/* J qdd + gamma */
static kmp_ref curve(kmp_equations *eq, int row)
{
    kmp_ref sum = eq->jdqd[row];
    for (int k = 0; k < eq->n; k++)
        sum = kmp_add(eq->graph, sum,
                      kmp_mul(eq->graph, eq->jacobian[row * eq->n + k], kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k)));
    return sum;
}

static kmp_ref value_of(kmp_equations *eq, kmp_value value, int i)
{
    switch (value) {
    case KMP_VALUE_R:
        return eq->residual[i];
    case KMP_VALUE_JTMU:
        return eq->jt_mu[i];
    case KMP_VALUE_H:
        return eq->h[i];
    case KMP_VALUE_RATE:
        return eq->hdot[i];
    case KMP_VALUE_CURVE:
        return curve(eq, i);
    default:
        return eq->power;
    }
}

static bool collect_values(gather *g, unsigned values)
{
    int n = g->eq.n, m = g->eq.m;
    const int size[KMP_VALUES] = {n, n, m, m, m, 1};
    g->value = KMP_NEW(kmp_ref, 2 * n + 3 * m + 1);
    for (int v = 0; g->value && v < KMP_VALUES; v++) {
        bool asked = values & 1u << v;
        g->t->at[v] = asked ? g->value_count : -1;
        g->size[v] = asked ? size[v] : 0;
        for (int i = 0; i < g->size[v]; i++)
            g->value[g->value_count++] = value_of(&g->eq, (kmp_value)v, i);
    }
    return g->value;
}

/* -- tangents ---------------------------------------------------------------------------------------- */

/* Derivatives of all values along one coordinate or rate, in one pass. */
static kempe_status add_column(gather *g, kmp_input_kind kind, int k, kmp_ref *column)
{
    const int *block = kind == KMP_IN_Q ? by_q : by_qd;
    kempe_status status = kmp_equations_partial(&g->eq, kind, k, g->value_count, g->value, column);
    for (int v = 0; status == KEMPE_OK && v < KMP_VALUES; v++)
        for (int i = 0; block[v] >= 0 && i < g->size[v]; i++)
            add_entry(g, block[v], i, k, output_of(g, column[g->t->at[v] + i]));
    return status;
}

static void add_mass_and_jacobian(gather *g)
{
    int n = g->eq.n;
    for (int i = 0; i < n; i++)
        for (int k = 0; k <= i; k++) {
            int source = output_of(g, g->eq.mass[i * n + k]);
            add_entry(g, KMP_M, i, k, source);
            if (i != k)
                add_entry(g, KMP_M, k, i, source);
        }
    for (int r = 0; r < g->eq.m; r++)
        for (int k = 0; k < n; k++)
            add_entry(g, KMP_J, r, k, output_of(g, g->eq.jacobian[r * n + k]));
}

static kempe_status collect_tangents(gather *g)
{
    kempe_status status = KEMPE_OK;
    kmp_ref *column = KMP_NEW(kmp_ref, g->value_count);
    if (!column)
        return kmp_fail_memory(g->eq.context);
    for (int k = 0; k < g->eq.n && status == KEMPE_OK; k++) {
        status = add_column(g, KMP_IN_Q, k, column);
        if (status == KEMPE_OK)
            status = add_column(g, KMP_IN_QD, k, column);
    }
    kmp_free(column);
    add_mass_and_jacobian(g);
    return g->failed ? kmp_fail_memory(g->eq.context) : status;
}

static int by_place(const void *a, const void *b)
{
    const kmp_tangent *x = a, *y = b;
    if (x->block != y->block)
        return x->block - y->block;
    return x->col != y->col ? x->col - y->col : x->row - y->row;
}

static void sort_entries(gather *g)
{
    kmp_tangents *t = g->t;
    if (g->entry_count)
        qsort(t->entry, (size_t)g->entry_count, sizeof *t->entry, by_place);
    for (int e = 0; e < g->entry_count; e++)
        t->start[t->entry[e].block + 1] = e + 1;
    for (int b = 0; b < KMP_TANGENT_BLOCKS; b++)
        if (t->start[b + 1] < t->start[b])
            t->start[b + 1] = t->start[b];
}

/* -- programs ---------------------------------------------------------------------------------------- */

static bool make_machines(gather *g, const double *parameters)
{
    kmp_tangents *t = g->t;
    const kmp_backend *backend = kmp_backend_find("tape");
    const kmp_ref *value = g->value, *output = g->output;
    t->value_program = kmp_program_new(g->eq.graph, 1, &g->value_count, &value);
    t->tangent_program = kmp_program_new(g->eq.graph, 1, &g->output_count, &output);
    t->value = t->value_program ? kmp_machine_new(t->value_program, backend) : NULL;
    t->tangent = t->tangent_program ? kmp_machine_new(t->tangent_program, backend) : NULL;
    if (!t->value || !t->tangent)
        return false;
    kmp_machine_set(t->value, KMP_IN_PARAMETER, parameters);
    kmp_machine_set(t->tangent, KMP_IN_PARAMETER, parameters);
    (void)kmp_machine_run(t->value, 0);
    (void)kmp_machine_run(t->tangent, 0);
    return true;
}

kempe_status kmp_tangents_init(kmp_tangents *tangents, const kempe_system *system, unsigned values)
{
    unsigned sets = KMP_SET_MASS | KMP_SET_CLOSURE | KMP_SET_RESIDUAL;
    sets |= values & 1u << KMP_VALUE_CURVE ? KMP_SET_JDQD : 0;
    sets |= values & 1u << KMP_VALUE_POWER ? KMP_SET_ENERGY : 0;
    *tangents = (kmp_tangents){.n = system->n, .m = system->m};
    gather g = {.t = tangents};
    kempe_status status = kmp_equations_init(&g.eq, system->model, sets, KMP_SCHEME_COMPOSITE, false);
    if (status != KEMPE_OK)
        return status;
    bool ok = collect_values(&g, values);
    if (ok && (status = collect_tangents(&g)) == KEMPE_OK) {
        sort_entries(&g);
        ok = make_machines(&g, system->parameters);
    }
    kmp_free(g.value);
    kmp_free(g.output);
    kmp_equations_free(&g.eq);
    if (ok && status == KEMPE_OK)
        return KEMPE_OK;
    kmp_tangents_free(tangents);
    return ok ? status : kmp_fail_memory(system->context);
}

void kmp_tangents_free(kmp_tangents *tangents)
{
    kmp_machine_free(tangents->value);
    kmp_machine_free(tangents->tangent);
    kmp_program_free(tangents->value_program);
    kmp_program_free(tangents->tangent_program);
    kmp_free(tangents->entry);
    *tangents = (kmp_tangents){0};
}

/* -- numbers ----------------------------------------------------------------------------------------- */

static const double *run(kmp_machine *machine, const kmp_instant *at)
{
    kmp_machine_set(machine, KMP_IN_TIME, &at->t);
    kmp_machine_set(machine, KMP_IN_Q, at->q);
    kmp_machine_set(machine, KMP_IN_QD, at->qd);
    kmp_machine_set(machine, KMP_IN_QDD, at->qdd);
    kmp_machine_set(machine, KMP_IN_LAMBDA, at->lambda);
    if (at->mu)
        kmp_machine_set(machine, KMP_IN_MU, at->mu);
    return kmp_machine_run(machine, 1);
}

const double *kmp_tangents_values(kmp_tangents *tangents, const kmp_instant *at)
{
    return run(tangents->value, at);
}

const double *kmp_tangents_derivatives(kmp_tangents *tangents, const kmp_instant *at)
{
    return run(tangents->tangent, at);
}

void kmp_tangents_add(const kmp_tangents *tangents, kmp_tangent_block block, const double *d, double factor,
                      const double *x, double *out)
{
    for (int k = tangents->start[block]; k < tangents->start[block + 1]; k++) {
        const kmp_tangent *e = &tangents->entry[k];
        out[e->row] += factor * d[e->source] * x[e->col];
    }
}
