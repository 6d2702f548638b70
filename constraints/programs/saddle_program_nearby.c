/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations and multipliers near the place of known factors: one residual, one solution, no factors. The residual
 * is that of Newton and Euler's equations with J' lambda, shorter than M qdd + C - J' lambda. */
#include "constraints/programs/saddle_program_nearby.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/programs/program_records.h"
#include "constraints/programs/saddle_program_write.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "symbolic/contraction.h"
#include <limits.h>
#include <math.h>
#include <string.h>

typedef struct writer {
    const kmp_evaluator *eval;
    const kempe_system *s;
    const kmp_partition *part;
    int n, r, count; /* of `value` */
    kmp_arena arena;
    kmp_writer_ldl ldl;
    kmp_program *source; /* of the values */
    kmp_graph *g;
    kmp_ref *value;   /* residual (n), curves (r), h_t (r) where closures move, power where there is one */
    kmp_ref *x, *out; /* n + r, and n + r + 1 */
} writer;

/* False: no memory, or there are no such equations. */
static bool write_nearby(writer *w)
{
    kmp_equations eq;
    kmp_events events = w->s->events; /* the system has recorded all conditions: none is added */
    unsigned sets = KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_CLOSED;
    const kmp_derivation_request scene = {
        .sets = sets | (w->s->dissipative ? KMP_SET_POWER : 0), .events = &events, .charted = true, .plain = true};
    if (kmp_equations_derive(&eq, w->s->model, &scene) != KEMPE_OK)
        return false;
    bool made = eq.n == w->n && eq.m == w->s->m;
    kmp_ref *value = w->value = KMP_ARENA_NEW(&w->arena, kmp_ref, w->n + 2 * w->r + 1);
    for (int i = 0; made && value && i < w->n; i++)
        value[w->count++] = eq.closed[i];
    for (int i = 0; made && value && i < w->r; i++)
        value[w->count++] = kmp_equations_curve(&eq, w->part->rows[i]);
    for (int i = 0; made && value && w->s->rheonomic && i < w->r; i++)
        value[w->count++] = eq.h_t[w->part->rows[i]];
    if (made && value && w->s->dissipative)
        value[w->count++] = eq.power;
    const kmp_ref *group = value;
    w->source = made && value ? kmp_program_new(eq.graph, 1, &w->count, &group) : NULL;
    kmp_equations_free(&eq);
    return w->source;
}

/* Charts become numbers, as in the saddle program; multipliers are numbered by independent rows. */
static bool import(writer *w)
{
    int m = w->s->m, charts = KMP_CHART_SIZE * w->s->chart_count;
    kmp_ref *input, *by, *all = KMP_ARENA_NEW(&w->arena, kmp_ref, w->source->outputs[w->source->stages]);
    w->g = kmp_graph_new();
    if (!KMP_ARENA_EACH(&w->arena, kmp_ref, m + charts, &input, &by) || !w->g || !all)
        return false;
    for (int i = 0; i < m; i++) {
        input[i] = kmp_input(w->g, KMP_IN_LAMBDA, (uint32_t)i);
        by[i] = KMP_ZERO;
    }
    for (int i = 0; i < w->r; i++)
        by[w->part->rows[i]] = kmp_input(w->g, KMP_IN_LAMBDA, (uint32_t)i);
    int inputs = m + kmp_writer_plain_charts(w->eval, w->g, input + m, by + m);
    const kmp_importing how = {.count = inputs, .input = input, .by = by};
    if (!kmp_program_import(w->source, w->g, &how, all))
        return false;
    memcpy(w->value, all + w->source->outputs[1], (size_t)w->count * sizeof *w->value);
    return true;
}

static bool take_factors(writer *w)
{
    int entries = w->ldl.start[w->ldl.size];
    w->ldl.l = KMP_ARENA_NEW(&w->arena, kmp_ref, entries);
    w->ldl.inverse = KMP_ARENA_NEW(&w->arena, kmp_ref, w->ldl.size);
    if (!w->ldl.l || !w->ldl.inverse)
        return false;
    for (int e = 0; e < entries; e++)
        w->ldl.l[e] = kmp_input(w->g, KMP_IN_MU, (uint32_t)e);
    for (int i = 0; i < w->ldl.size; i++)
        w->ldl.inverse[i] = kmp_input(w->g, KMP_IN_MU, (uint32_t)(entries + i));
    return true;
}

/* NULL: no memory. */
static kmp_program *improve(writer *w)
{
    int n = w->n, r = w->r, count = n + r + w->s->dissipative;
    kmp_graph *g = w->g;
    w->x = KMP_ARENA_NEW(&w->arena, kmp_ref, n + r);
    w->out = KMP_ARENA_NEW(&w->arena, kmp_ref, count);
    if (!w->x || !w->out)
        return NULL;
    for (int i = 0; i < n + r; i++)
        w->x[i] = kmp_neg(w->value[i]);
    kmp_writer_ldl_solve(&w->ldl, g, w->ldl.size, w->x);
    for (int i = 0; i < n; i++)
        w->out[i] = kmp_add(g, kmp_input(g, KMP_IN_QDD, (uint32_t)i), w->x[i]);
    for (int i = 0; i < r; i++)
        w->out[n + i] = kmp_sub(g, kmp_input(g, KMP_IN_LAMBDA, (uint32_t)i), w->x[n + i]);
    kmp_ref power = w->s->dissipative ? w->value[w->count - 1] : KMP_ZERO;
    for (int i = 0; w->s->rheonomic && i < r; i++)
        kmp_writer_add_product(g, &power, kmp_neg(w->out[n + i]), w->value[n + r + i]);
    if (w->s->dissipative)
        w->out[n + r] = power;
    const kmp_ref *group = w->out;
    kmp_program *p = kmp_graph_failed(g) ? NULL : kmp_program_new(g, 1, &count, &group);
    if (!p || kmp_program_contract(p, 0, 0))
        return p;
    kmp_program_free(p);
    return NULL;
}

bool kmp_saddle_program_write_near(const kmp_evaluator *eval, const kmp_partition *part, double run,
                                   kmp_program **program)
{
    unsigned most = run < UINT_MAX ? (unsigned)run : UINT_MAX;
    const kmp_program_cache_name name = kmp_writer_name("nearby", eval, part, NULL, most);
    kmp_program_record record = {0};
    *program = NULL;
    if (kmp_writer_recall(eval->system, name, &record)) {
        kmp_free(record.row);
        *program = record.program;
        return true;
    }
    writer w = {.eval = eval, .s = eval->system, .part = part, .n = part->n, .r = part->r};
    unsigned long failures = kmp_memory_failures();
    bool ordered = kmp_saddle_program_order(eval, part, &w.arena, &w.ldl);
    /* Short enough, with a residual that has about the operations of M, C, J and gamma. */
    double solution = ordered ? 4.0 * w.ldl.start[w.ldl.size] + w.ldl.size : INFINITY;
    if (ordered && kmp_writer_operations(eval, false) + solution <= KMP_SADDLE_PROGRAM_NEARBY * run &&
        write_nearby(&w) && import(&w) && take_factors(&w))
        *program = improve(&w);
    kmp_program_free(w.source);
    kmp_graph_free(w.g);
    kmp_arena_free(&w.arena);
    if (kmp_memory_failures() != failures) {
        kmp_program_free(*program);
        *program = NULL;
        return false;
    }
    record.program = *program;
    kmp_writer_keep(eval->system, name, &record);
    return true;
}
