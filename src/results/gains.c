/* SPDX-License-Identifier: BSD-3-Clause */
/* The simplifications one after the other, each with those before it: rules at a node's birth are switched on in turn,
 * then the ways to write the equations are chosen, then the passes run. */
#include "results/gains.h"
#include "base/memory.h"
#include "results/sets.h"
#include "symbolic/cost.h"
#include "symbolic/live.h"
#include "symbolic/passes/shorten.h"

/* Without zero elimination everything depends on everything: small models only. */
enum { MOST_MOTIONS = 32 };

static const unsigned wanted = 1u << KMP_EQ_M | 1u << KMP_EQ_C | 1u << KMP_EQ_H | 1u << KMP_EQ_J | 1u << KMP_EQ_JDQD;

static void put(kmp_gains *gains, const char *name, long operations)
{
    gains->steps[gains->count++] = (kmp_gain){name, operations};
}

/* All outputs; NULL: no memory. */
static kmp_ref *outputs_of(const kmp_equations *eq, int *count)
{
    *count = kmp_sets_size(eq, wanted);
    kmp_assignment *entries = KMP_NEW(kmp_assignment, *count);
    kmp_ref *out = KMP_NEW(kmp_ref, *count);
    if (entries && out) {
        kmp_sets_put(eq, wanted, entries);
        for (int k = 0; k < *count; k++)
            out[k] = entries[k].value;
    } else {
        kmp_free(out);
        out = NULL;
    }
    kmp_free(entries);
    return out;
}

/* -1: no memory. */
static long operations(const kmp_graph *g, int count, const kmp_ref *outputs, int sum_price)
{
    kmp_cost cost;
    if (!kmp_cost_init(&cost, g, sum_price))
        return -1;
    kmp_cost_add(&cost, count, outputs);
    long n = cost.failed ? -1 : cost.operations;
    kmp_cost_free(&cost);
    return n;
}

static kempe_status try_rules(const kempe_model *model, const kmp_scene *scene, long *found)
{
    kmp_equations eq;
    int count;
    kempe_status status = kmp_equations_derive_once(&eq, model, scene);
    if (status != KEMPE_OK)
        return status;
    kmp_ref *out = outputs_of(&eq, &count);
    *found = out ? operations(eq.graph, count, out, KMP_COST_ADDITION) : -1;
    kmp_free(out);
    kmp_equations_free(&eq);
    return *found < 0 ? kmp_fail_memory(model->context) : KEMPE_OK;
}

static kempe_status rules(const kempe_model *model, kmp_scene scene, kmp_gains *gains)
{
    static const struct {
        const char *name;
        unsigned without;
    } steps[] = {{"as generated", KMP_RULE_ALL},
                 {"zero elimination", KMP_RULE_ALL & ~(unsigned)KMP_RULE_ZERO},
                 {"cancellation", KMP_RULE_SHARE | KMP_RULE_TRIG},
                 {"auxiliary variables", KMP_RULE_TRIG},
                 {"rotations about one axis", 0}};
    bool *no = KMP_NEW(bool, model->motion_count);
    uint8_t *derived = KMP_NEW(uint8_t, 4 * model->closure_count);
    const kmp_ways plain = {.stay = no, .about = no, .way = derived};
    kempe_status status = no && derived ? KEMPE_OK : kmp_fail_memory(model->context);
    scene.ways = &plain;
    for (size_t k = 0; k < sizeof steps / sizeof *steps && status == KEMPE_OK; k++) {
        long found = -1;
        scene.without = steps[k].without;
        if (!(steps[k].without & KMP_RULE_SHARE) || model->motion_count <= MOST_MOTIONS)
            status = try_rules(model, &scene, &found);
        put(gains, steps[k].name, found);
    }
    kmp_free(no);
    kmp_free(derived);
    return status;
}

static long count_made(const kmp_graph *g)
{
    long made = 0;
    for (uint32_t id = 0; id < kmp_graph_count(g); id++) {
        kmp_op op = (kmp_op)kmp_graph_node(g, id)->op;
        made += op == KMP_OP_ADD || op == KMP_OP_MUL || op == KMP_OP_DIV;
    }
    return made;
}

static kempe_status passes(kmp_equations *eq, kmp_gains *gains)
{
    const kmp_parallel parallel = {eq->run, eq->n};
    int count, pass_count;
    const kmp_pass *pass = kmp_passes(&pass_count);
    kmp_ref *out = outputs_of(eq, &count);
    bool ok = out;
    if (ok) {
        gains->made = count_made(eq->graph);
        gains->needed = operations(eq->graph, count, out, 0);
        put(gains, "axes, bodies, closures", operations(eq->graph, count, out, KMP_COST_ADDITION));
    }
    for (int k = 0; ok && k < pass_count; k++) {
        ok = pass[k].run(eq->graph, &parallel, count, out);
        put(gains, pass[k].name, operations(eq->graph, count, out, k == 0 ? KMP_COST_ADDITION : 0));
    }
    kmp_program *p = ok ? kmp_program_new(eq->graph, 1, &count, (const kmp_ref *const *)&out) : NULL;
    if (p)
        put(gains, "parameters in advance", kmp_program_count(p, 1, 1).paper);
    ok = p;
    kmp_program_free(p);
    kmp_free(out);
    return ok ? KEMPE_OK : kmp_fail_memory(eq->context);
}

kempe_status kmp_gains_find(const kempe_model *model, kmp_gains *gains)
{
    const kmp_scene scene = {.sets = kmp_sets_derive(wanted), .keep = KMP_KEEP_NUMBERS, .loops_alone = true};
    kmp_equations eq;
    *gains = (kmp_gains){0};
    kempe_status status = rules(model, scene, gains);
    if (status != KEMPE_OK)
        return status;
    status = kmp_equations_derive(&eq, model, &scene);
    if (status != KEMPE_OK)
        return status;
    status = passes(&eq, gains);
    kmp_equations_free(&eq);
    return status;
}
