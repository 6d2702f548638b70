/* SPDX-License-Identifier: BSD-3-Clause */
/* The simplifications one after the other, each with those before it. Rules applied when nodes are made are switched on
 * in turn, then the variants of the equations are chosen, then the passes run. The variants were chosen together; each
 * one's gain is measured by removing it alone. */
#include "generate/gains.h"
#include "base/memory.h"
#include "generate/sets.h"
#include "symbolic/passes/shorten.h"
#include "symbolic/program/cost.h"
#include <string.h>

/* Without zero elimination everything depends on everything: small models only. */
enum { MOST_MOTIONS = 32 };

static const unsigned wanted = 1u << KMP_EQ_M | 1u << KMP_EQ_C | 1u << KMP_EQ_H | 1u << KMP_EQ_J | 1u << KMP_EQ_JDQD;

typedef struct amount {
    long operations, runtime; /* -1: no memory, or not tried */
} amount;

static const amount unknown = {-1, -1};

static void put(kmp_gains *gains, const char *name, amount a)
{
    gains->steps[gains->count++] = (kmp_gain){name, a.operations, a.runtime};
}

/* All outputs; NULL: no memory. */
static kmp_ref *outputs_of(const kmp_equations *eq, int *count)
{
    *count = kmp_sets_size(eq, wanted);
    return kmp_sets_outputs(eq, wanted);
}

static amount amount_of(const kmp_graph *g, int count, const kmp_ref *outputs, int sum_price)
{
    kmp_cost cost;
    if (!kmp_cost_init(&cost, g, sum_price))
        return unknown;
    kmp_cost_add(&cost, count, outputs);
    amount a = cost.failed ? unknown : (amount){cost.operations, cost.operations - cost.once};
    kmp_cost_free(&cost);
    return a;
}

static kempe_status try_scene(const kempe_model *model, const kmp_scene *scene, amount *found)
{
    kmp_equations eq;
    int count;
    KMP_TRY(kmp_equations_derive_once(&eq, model, scene));
    kmp_ref *out = outputs_of(&eq, &count);
    *found = out ? amount_of(eq.graph, count, out, KMP_COST_ADDITION) : unknown;
    kmp_free(out);
    kmp_equations_free(&eq);
    return found->operations < 0 ? kmp_fail_memory(model->context) : KEMPE_OK;
}

/* -- rules ------------------------------------------------------------------------------------------- */

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
    kmp_savings plain;
    kempe_status status = kmp_savings_init(&plain, model) ? KEMPE_OK : kmp_fail_memory(model->context);
    scene.savings = &plain;
    for (size_t k = 0; k < sizeof steps / sizeof *steps && status == KEMPE_OK; k++) {
        amount found = unknown;
        scene.without = steps[k].without;
        if (!(steps[k].without & KMP_RULE_SHARE) || model->motion_count <= MOST_MOTIONS)
            status = try_scene(model, &scene, &found);
        put(gains, steps[k].name, found);
    }
    kmp_savings_free(&plain);
    return status;
}

/* -- variants ---------------------------------------------------------------------------------------- */

static const char *const kind_names[KMP_GAINS_KINDS] = {"closures point by point", "origins along axes",
                                                        "base parameters",         "axes that stay",
                                                        "moments about joints",    "rotations apart"};

static void take_away(kmp_savings *savings, const kempe_model *model, int kind)
{
    const size_t n = (size_t)model->motion_count, points = 4 * (size_t)model->closure_count;
    const struct {
        uint8_t *choice;
        size_t count;
    } list[KMP_GAINS_KINDS] = {{savings->point, points}, {savings->origin, n}, {savings->give, n},
                               {savings->stay, n},       {savings->about, n},  {savings->apart, 1}};
    memset(list[kind].choice, 0, list[kind].count);
    if (list[kind].choice == savings->give)
        memset(savings->lump, 0, n);
}

/* The operations of the equations as a program, after all passes, with the scene's variants. */
static kempe_status try_program(const kempe_model *model, const kmp_scene *scene, amount *found)
{
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive_once(&eq, model, scene));
    kmp_program *p = kmp_sets_program(&eq, wanted);
    bool ok = p;
    if (ok)
        *found = (amount){kmp_program_count(p, 0, 1).paper, kmp_program_count(p, 1, 1).paper};
    kmp_program_free(p);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(model->context);
}

/* Measures each chosen variant by removing it from the others. */
static kempe_status savings(const kempe_model *model, kmp_scene scene, const kmp_savings *best, kmp_gains *gains)
{
    kmp_savings some;
    amount all = unknown;
    kempe_status status = kmp_savings_init(&some, model) ? KEMPE_OK : kmp_fail_memory(model->context);
    scene.savings = best;
    if (status == KEMPE_OK)
        status = try_program(model, &scene, &all);
    scene.savings = &some;
    for (int kind = 0; kind < KMP_GAINS_KINDS && status == KEMPE_OK; kind++) {
        amount without = all;
        kmp_savings_copy(&some, best, model);
        take_away(&some, model, kind);
        if (!kmp_savings_same(&some, best, model))
            status = try_program(model, &scene, &without);
        gains->savings[kind] = (kmp_gain){kind_names[kind], without.operations, without.runtime};
    }
    gains->all = (kmp_gain){"all of them", all.operations, all.runtime};
    kmp_savings_free(&some);
    return status;
}

/* -- passes ------------------------------------------------------------------------------------------ */

static long count_made(const kmp_graph *g)
{
    long made = 0;
    for (uint32_t id = 0; id < kmp_graph_count(g); id++) {
        kmp_op op = (kmp_op)kmp_graph_node(g, id)->op;
        made += op == KMP_OP_ADD || op == KMP_OP_MUL || op == KMP_OP_DIV;
    }
    return made;
}

/* The count with sines and cosines of sums written out as in a program. */
static amount written_out(kmp_graph *g, int count, const kmp_ref *outputs)
{
    kmp_ref *out = KMP_NEW(kmp_ref, count);
    amount a = unknown;
    if (out && count)
        memcpy(out, outputs, (size_t)count * sizeof *out);
    if (out && kmp_trig_sums(g, count, out))
        a = amount_of(g, count, out, 0);
    kmp_free(out);
    return a;
}

static kempe_status passes(kmp_equations *eq, kmp_gains *gains)
{
    const kmp_parallel parallel = {eq->run, eq->n};
    int count;
    kmp_ref *out = outputs_of(eq, &count);
    bool ok = out;
    if (ok) {
        gains->made = count_made(eq->graph);
        gains->needed = amount_of(eq->graph, count, out, 0).operations;
        put(gains, "choice of variants", amount_of(eq->graph, count, out, KMP_COST_ADDITION));
    }
    for (int k = 0; ok && k < KMP_PASSES; k++) {
        ok = kmp_pass_run(&kmp_passes[k], eq->graph, &parallel, count, out);
        put(gains, kmp_passes[k].name, written_out(eq->graph, count, out));
    }
    kmp_program *p = ok ? kmp_program_new(eq->graph, 1, &count, (const kmp_ref *const *)&out) : NULL;
    long needed = p ? kmp_program_count(p, 1, 1).paper : -1;
    put(gains, "parameters in advance", (amount){needed, needed});
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
    KMP_TRY(rules(model, scene, gains));
    KMP_TRY(kmp_equations_derive(&eq, model, &scene));
    kempe_status status = savings(model, scene, &eq.savings, gains);
    if (status == KEMPE_OK)
        status = passes(&eq, gains);
    kmp_equations_free(&eq);
    return status;
}
