/* SPDX-License-Identifier: BSD-3-Clause */
/* Looking into a system: its equations, its program, its operation counts. */
#include "backend/machine.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/motion.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/model_context.h"
#include "output/print.h"
#include "studies/show/sets.h"
#include "symbolic/cost.h"
#include "symbolic/shorten.h"
#include "symbolic/trig.h"
#include <kempe/check.h>
#include <string.h>

/* The sets of equations for a mechanism's motion. */
static const unsigned shown = 1u << KMP_EQ_M | 1u << KMP_EQ_C | 1u << KMP_EQ_H | 1u << KMP_EQ_J | 1u << KMP_EQ_JDQD;

static const char *const stage_names[3][7] = {
    {"parameters", "closure: h, J, h_t", "mass: M", "bias: C, jdqd", "bias under loads: C", "power", ""},
    {"parameters", "closure: h, J, h_t", "bodies: inertias", "qdd, lambda", "qdd, open; jdqd", "power",
     "correction of h"},
    {"parameters", "closure: h, J, h_t", "links: for products", "bias: C, jdqd", "product: M x", "power", ""}};

/* The program of the formulations that can use articulated bodies, which is derived where it was not needed yet. */
static kempe_status find_program(const kempe_system *system, const kmp_program **p, const char *const **names)
{
    if (system->late && system->late->by_products) {
        *names = stage_names[2];
        *p = system->late->weighing;
        return KEMPE_OK;
    }
    KMP_TRY(kmp_motion_need_bodies(system));
    if (!system->bodies->program)
        KMP_TRY(kmp_motion_need(system));
    *names = stage_names[system->bodies->program != NULL];
    *p = system->bodies->program ? system->bodies->program : system->motion;
    return KEMPE_OK;
}

/* -- equations --------------------------------------------------------------------------------------- */

static bool put_equations(kmp_text *text, const kmp_equations *eq, int count, kmp_assignment *assignments,
                          const kmp_ref *value)
{
    for (int k = 0; value && k < count; k++)
        assignments[k].value = value[k];
    return kmp_assignments_print(eq, count, assignments, text);
}

/* Prints the equations after each pass that changed something, with the operation counts before and after. */
static bool put_passes(kmp_text *text, kmp_equations *eq, int count, kmp_assignment *assignments)
{
    const kmp_parallel parallel = {eq->run, eq->n};
    kmp_ref *now = KMP_NEW(kmp_ref, count), *before = KMP_NEW(kmp_ref, count);
    bool ok = now && before;
    for (int k = 0; ok && k < count; k++)
        now[k] = assignments[k].value;
    for (int p = 0; ok && p < KMP_PASSES; p++) {
        if (count)
            memcpy(before, now, (size_t)count * sizeof *now);
        ok = kmp_pass_run(&kmp_passes[p], eq->graph, &parallel, count, now);
        if (!ok || count == 0 || memcmp(before, now, (size_t)count * sizeof *now) == 0)
            continue;
        kmp_text_printf(text, "\n# after '%s'\n", kmp_passes[p].name);
        ok = put_equations(text, eq, count, assignments, now);
    }
    kmp_free(now);
    kmp_free(before);
    return ok;
}

static kempe_status show_equations(kmp_text *text, const kempe_system *system, bool passes)
{
    kmp_equations eq;
    KMP_TRY(kmp_equations_init(&eq, system->model, kmp_sets_derive(shown), KMP_SCHEME_COMPOSITE, false));
    int count = kmp_sets_size(&eq, shown);
    kmp_assignment *assignments = KMP_NEW(kmp_assignment, count);
    if (assignments)
        kmp_sets_put(&eq, shown, assignments);
    /* The legend of the indices. */
    kmp_text_printf(text, "# %s: M qdd + C = J' lambda, h = 0, J qdd + jdqd = 0; entries not shown are zero\n# q:",
                    kempe_model_name(system->model));
    for (int k = 0; k < system->n; k++)
        kmp_text_printf(text, " %d %s", k + 1, kmp_model_motion(system->model, k)->name);
    kmp_text_put(text, system->m ? "\n# h:" : "");
    for (int r = 0; r < system->m; r++)
        kmp_text_printf(text, " %d %s", r + 1, system->row_names[r]);
    kmp_text_put(text, "\n");
    bool ok = assignments && put_equations(text, &eq, count, assignments, NULL) &&
              (!passes || put_passes(text, &eq, count, assignments));
    kmp_free(assignments);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(system->context);
}

/* -- operations of blocks, which depend on the state -------------------------------------------------- */

static kempe_status count_at(const kempe_system *system, const kempe_assembly *start, kmp_block_counts *counts)
{
    kmp_evaluator *eval = kmp_eval_new(system, "tape");
    kempe_status status = kmp_made(system->context, eval);
    if (status == KEMPE_OK && system->bodies->program)
        status = kmp_eval_add_articulated(eval);
    if (status == KEMPE_OK) {
        kmp_eval_set_by_bodies(eval, eval->bodies.machine != NULL);
        kmp_eval_closure(eval, 0, kempe_assembly_q(start));
        kmp_eval_mass(eval);
        kmp_eval_bias(eval, kempe_assembly_qd(start));
        *counts = kmp_machine_count(eval->motion);
    }
    kmp_eval_free(eval);
    return status;
}

/* Counts of the blocks at the start; all zero without blocks. */
static kempe_status count_blocks(const kempe_system *system, kmp_block_counts *counts)
{
    const kmp_program *program = kmp_motion_known(system);
    kempe_assembly *start = NULL;
    *counts = (kmp_block_counts){0};
    if (!program || program->block_count == 0)
        return KEMPE_OK;
    kempe_status status = kmp_assembly_at_start(system, &start);
    if (status == KEMPE_OK)
        status = count_at(system, start, counts);
    kempe_assembly_free(start);
    return status;
}

/* -- gains of simplifications ------------------------------------------------------------------------- */

/* The simplifications one after the other, each with those before it: M, C, h, J and jdqd as one program, numbers kept
 * as symbols. Rules applied when nodes are made are switched on in turn, then the variants of the equations are chosen,
 * then the passes run. The variants were chosen together; each one's gain is measured by removing only it. */
enum { MOST_STEPS = 16, VARIANTS = 5 };

typedef struct step_gain {
    const char *name;
    long operations; /* + - * / after it, with those before it; -1: not tried, the model is too large */
    long runtime;    /* operations that depend on more than parameters */
} step_gain;

typedef struct gain_table {
    step_gain steps[MOST_STEPS];
    int count;
    step_gain savings[VARIANTS]; /* as a program after all passes without each, and with all */
    step_gain all;
    long made, needed; /* operations of the graph, of the program */
} gain_table;

/* Without zero elimination everything depends on everything: small models only. */
enum { MOST_MOTIONS = 32 };

typedef struct amount {
    long operations, runtime; /* -1: no memory, or not tried */
} amount;

static const amount unknown = {-1, -1};

static void put_step(gain_table *gains, const char *name, amount a)
{
    gains->steps[gains->count++] = (step_gain){name, a.operations, a.runtime};
}

/* All outputs; NULL: no memory. */
static kmp_ref *outputs_of(const kmp_equations *eq, int *count)
{
    *count = kmp_sets_size(eq, shown);
    return kmp_sets_outputs(eq, shown);
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

static kempe_status try_scene(const kempe_model *model, const kmp_derivation_request *scene, amount *found)
{
    kmp_equations eq;
    int count;
    KMP_TRY(kmp_equations_derive_once(&eq, model, scene));
    kmp_ref *out = outputs_of(&eq, &count);
    *found = out ? amount_of(eq.graph, count, out, KMP_COST_ADDITION) : unknown;
    kmp_free(out);
    kmp_equations_free(&eq);
    return found->operations < 0 ? kmp_fail_memory(kmp_model_context(model)) : KEMPE_OK;
}

static kempe_status try_rules(const kempe_model *model, kmp_derivation_request scene, gain_table *gains)
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
    kempe_status status = kmp_savings_init(&plain, model) ? KEMPE_OK : kmp_fail_memory(kmp_model_context(model));
    scene.savings = &plain;
    for (size_t k = 0; k < sizeof steps / sizeof *steps && status == KEMPE_OK; k++) {
        amount found = unknown;
        scene.without = steps[k].without;
        if (!(steps[k].without & KMP_RULE_SHARE) || kmp_model_motion_count(model) <= MOST_MOTIONS)
            status = try_scene(model, &scene, &found);
        put_step(gains, steps[k].name, found);
    }
    kmp_savings_free(&plain);
    return status;
}

static const char *const kind_names[VARIANTS] = {"closures point by point", "origins along axes", "base parameters",
                                                 "axes that stay", "moments about joints"};

static void take_away(kmp_savings *savings, const kempe_model *model, int kind)
{
    const size_t n = (size_t)kmp_model_motion_count(model), points = 4 * (size_t)kmp_model_closure_count(model);
    const struct {
        uint8_t *choice;
        size_t count;
    } list[VARIANTS] = {
        {savings->point, points}, {savings->origin, n}, {savings->give, n}, {savings->stay, n}, {savings->about, n}};
    memset(list[kind].choice, 0, list[kind].count);
    if (list[kind].choice == savings->give)
        memset(savings->lump, 0, n);
}

/* The operations of the equations as a program, after all passes, with the scene's variants. */
static kempe_status try_program(const kempe_model *model, const kmp_derivation_request *scene, amount *found)
{
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive_once(&eq, model, scene));
    kmp_program *p = kmp_sets_program(&eq, shown);
    bool ok = p;
    if (ok)
        *found = (amount){kmp_program_count(p, 0, 1).paper, kmp_program_count(p, 1, 1).paper};
    kmp_program_free(p);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(kmp_model_context(model));
}

/* Measures each chosen variant by removing it from the others. */
static kempe_status try_variants(const kempe_model *model, kmp_derivation_request scene, const kmp_savings *best,
                                 gain_table *gains)
{
    kmp_savings some;
    amount all = unknown;
    kempe_status status = kmp_savings_init(&some, model) ? KEMPE_OK : kmp_fail_memory(kmp_model_context(model));
    scene.savings = best;
    if (status == KEMPE_OK)
        status = try_program(model, &scene, &all);
    scene.savings = &some;
    for (int kind = 0; kind < VARIANTS && status == KEMPE_OK; kind++) {
        amount without = all;
        kmp_savings_copy(&some, best, model);
        take_away(&some, model, kind);
        if (!kmp_savings_same(&some, best, model))
            status = try_program(model, &scene, &without);
        gains->savings[kind] = (step_gain){kind_names[kind], without.operations, without.runtime};
    }
    gains->all = (step_gain){"all of them", all.operations, all.runtime};
    kmp_savings_free(&some);
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

static kempe_status try_passes(kmp_equations *eq, gain_table *gains)
{
    const kmp_parallel parallel = {eq->run, eq->n};
    int count;
    kmp_ref *out = outputs_of(eq, &count);
    bool ok = out;
    if (ok) {
        gains->made = count_made(eq->graph);
        gains->needed = amount_of(eq->graph, count, out, 0).operations;
        put_step(gains, "choice of variants", amount_of(eq->graph, count, out, KMP_COST_ADDITION));
    }
    for (int k = 0; ok && k < KMP_PASSES; k++) {
        ok = kmp_pass_run(&kmp_passes[k], eq->graph, &parallel, count, out);
        put_step(gains, kmp_passes[k].name, written_out(eq->graph, count, out));
    }
    kmp_program *p = ok ? kmp_program_new(eq->graph, 1, &count, (const kmp_ref *const *)&out) : NULL;
    long needed = p ? kmp_program_count(p, 1, 1).paper : -1;
    put_step(gains, "terms of parameters", (amount){needed, needed});
    ok = p;
    kmp_program_free(p);
    kmp_free(out);
    return ok ? KEMPE_OK : kmp_fail_memory(eq->context);
}

static kempe_status find_gains(const kempe_model *model, gain_table *gains)
{
    const kmp_derivation_request scene = {
        .sets = kmp_sets_derive(shown), .keep = KMP_KEEP_NUMBERS, .loops_alone = true};
    kmp_equations eq;
    *gains = (gain_table){0};
    KMP_TRY(try_rules(model, scene, gains));
    KMP_TRY(kmp_equations_derive(&eq, model, &scene));
    kempe_status status = try_variants(model, scene, &eq.savings, gains);
    if (status == KEMPE_OK)
        status = try_passes(&eq, gains);
    kmp_equations_free(&eq);
    return status;
}

/* -- counts ------------------------------------------------------------------------------------------ */

static void show_counts(kmp_text *text, const char *name, const kmp_counts *c)
{
    kmp_text_printf(text, "  %-20s %7ld %7ld %5ld %7ld %5ld | %8ld %8ld", name, c->add, c->mul, c->div, c->trig,
                    c->other, c->paper, c->robotran);
}

static void show_header(kmp_text *text, const char *what, bool nodes)
{
    kmp_text_printf(text, "%-22s %7s %7s %5s %7s %5s | %8s %8s", what, "+ -", "*", "/", "sin cos", "other", "+ - * /",
                    "with fns");
    kmp_text_printf(text, nodes ? " | %9s %8s\n" : "\n", "generated", "needed");
}

/* The operations of a right-hand side: of its stages and of the blocks that it evaluates. */
static kmp_counts count_right_side(const kmp_program *p, const kmp_block_counts *blocks)
{
    kmp_counts all = kmp_program_count(p, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS);
    kmp_counts_add(&all, &blocks->averages, 1);
    kmp_counts_add(&all, &blocks->equations, 1);
    return all;
}

static void show_blocks(kmp_text *text, const kmp_program *p, const kmp_block_counts *blocks)
{
    const kmp_counts all = count_right_side(p, blocks);
    const struct {
        const char *name;
        const kmp_counts *counts;
        int lists;
    } rows[] = {{"averages over places", &blocks->averages, blocks->average_lists},
                {"solved by iteration", &blocks->equations, blocks->equation_lists}};
    if (p->block_count == 0)
        return;
    kmp_text_put(text, "\n");
    show_header(text, "at the start", false);
    for (int k = 0; k < 2; k++)
        if (rows[k].lists > 0) {
            show_counts(text, rows[k].name, rows[k].counts);
            kmp_text_printf(text, " | %d evaluations\n", rows[k].lists);
        }
    show_counts(text, "right-hand side", &all);
    kmp_text_put(text, "\n");
}

static void show_stats(kmp_text *text, const kempe_system *system, const kmp_program *p, const char *const *names,
                       const kmp_tally t[KMP_EQ_SETS], const kmp_block_counts *blocks)
{
    int last = p->stages > KMP_STAGE_WORKING ? KMP_STAGE_LOAD : p->stages - 1; /* of variable stages */
    kmp_tally whole = kmp_tally_program(p, 0, last);
    kmp_print_title(text, system->model, KEMPE_OUTCOME_COMPLETE);
    kmp_text_printf(text, "%ld operations (+ - * /), %ld with functions (fns), for M, C, h, J and jdqd\n",
                    whole.counts.paper, whole.counts.robotran);
    show_header(text, "stage of the program", false);
    for (int s = 0; s < p->stages; s++) {
        if (s == KMP_STAGE_LOAD && p->outputs[s] == p->outputs[s + 1])
            continue;
        kmp_counts c = kmp_program_count(p, s, s);
        show_counts(text, names[s], &c);
        kmp_text_put(text, "\n");
    }
    show_blocks(text, p, blocks);
    kmp_text_put(text, "\n");
    show_header(text, "set", true);
    for (int k = 0; k < KMP_EQ_SETS; k++)
        if (shown & 1u << k) {
            show_counts(text, kmp_set_of(NULL, k).name, &t[k].counts);
            kmp_text_printf(text, " | %9ld %8ld\n", t[k].created, t[k].kept);
        }
    show_counts(text, "all in one program", &whole.counts);
    kmp_text_printf(text, " | %9ld %8ld\n", whole.created, whole.kept);
    if (names == stage_names[1])
        kmp_text_put(text,
                     "by articulated bodies: qdd = a + X' lambda, J X lambda = -d, X = M^-1 J', d = J a + jdqd\n");
    if (p->block_count > 0)
        kmp_text_put(text, "right-hand side: all stages but parameters and power, with what is solved or averaged in "
                           "them;\nwithout the solution of linear equations\n");
}

/* The saving in percent of the original count. */
static double gain_of(long before, long after)
{
    return before ? 100.0 * (double)(before - after) / (double)before : 0;
}

static void show_amount(kmp_text *text, long before, long after)
{
    if (after < 0)
        kmp_text_printf(text, " %10s %10s", "-", "");
    else if (before < 0)
        kmp_text_printf(text, " %10ld %10s", after, "");
    else
        kmp_text_printf(text, " %10ld %8.1f %%", after, gain_of(before, after));
}

static void show_gains(kmp_text *text, const gain_table *gains)
{
    kmp_text_printf(text, "\n%-26s %12s %10s %10s %10s\n", "simplification", "+ - * /", "gain", "run time", "gain");
    for (int k = 0; k < gains->count; k++) {
        const step_gain *gain = &gains->steps[k], *before = k ? gain - 1 : NULL;
        kmp_text_printf(text, "  %-25s", gain->name);
        show_amount(text, before ? before->operations : -1, gain->operations);
        show_amount(text, before ? before->runtime : -1, gain->runtime);
        kmp_text_put(text, "\n");
    }
    kmp_text_printf(text, "\n%-26s %12s %10s %10s %10s\n", "without one variant", "+ - * /", "gain", "run time",
                    "gain");
    for (int k = 0; k < VARIANTS; k++) {
        const step_gain *without = &gains->savings[k];
        kmp_text_printf(text, "  %-25s %10ld %8.1f %% %10ld %8.1f %%\n", without->name, without->operations,
                        gain_of(without->operations, gains->all.operations), without->runtime,
                        gain_of(without->runtime, gains->all.runtime));
    }
    kmp_text_printf(text, "  %-25s %10ld %10s %10ld\n\n", gains->all.name, gains->all.operations, "",
                    gains->all.runtime);
    kmp_text_printf(text, "unused operations: %ld of the %ld generated operations are not needed, %.0f %%\n",
                    gains->made - gains->needed, gains->made,
                    gains->made ? 100.0 * (double)(gains->made - gains->needed) / (double)gains->made : 0);
    kmp_text_put(text, "M, C, h, J, jdqd together, numbers kept as symbols; each row includes the rows before it.\n"
                       "run time: without terms of parameters only, which are computed once\n");
}

static void json_gain(kmp_json *json, const step_gain *gain)
{
    kmp_json_put(json, "{ name %s operations %ld runtime %ld }", gain->name, gain->operations, gain->runtime);
}

static void json_counts(kmp_json *json, const char *key, const kmp_counts *c)
{
    kmp_json_put(json, "%s { paper %ld robotran %ld add %ld mul %ld div %ld trig %ld other %ld", key, c->paper,
                 c->robotran, c->add, c->mul, c->div, c->trig, c->other);
}

static void json_tally(kmp_json *json, const char *key, const kmp_tally *t)
{
    json_counts(json, key, &t->counts);
    kmp_json_put(json, "created %ld kept %ld }", t->created, t->kept);
}

static void json_stats(kmp_json *json, const kmp_program *p, const char *const *names, const kmp_tally t[KMP_EQ_SETS],
                       const kmp_block_counts *blocks)
{
    kmp_tally whole = kmp_tally_program(p, 0, p->stages - 1);
    kmp_json_object(json, "stages");
    for (int s = 0; s < p->stages; s++) {
        kmp_counts c = kmp_program_count(p, s, s);
        json_counts(json, names[s], &c);
        kmp_json_end(json);
    }
    kmp_json_put(json, "}");
    const kmp_counts all = count_right_side(p, blocks);
    kmp_json_object(json, "at_start");
    json_counts(json, "averages", &blocks->averages);
    kmp_json_put(json, "evaluations %d }", blocks->average_lists);
    json_counts(json, "equations", &blocks->equations);
    kmp_json_put(json, "evaluations %d }", blocks->equation_lists);
    json_counts(json, "right_hand_side", &all);
    kmp_json_put(json, "} }");
    kmp_json_put(json, "sets {");
    for (int k = 0; k < KMP_EQ_SETS; k++)
        if (shown & 1u << k)
            json_tally(json, kmp_set_of(NULL, k).name, &t[k]);
    json_tally(json, "all", &whole);
    kmp_json_end(json);
}

/* -- views ------------------------------------------------------------------------------------------- */

static kempe_status write_stats(kmp_text *out, const kempe_system *system, kempe_format format)
{
    kmp_tally t[KMP_EQ_SETS];
    gain_table gains;
    kmp_block_counts blocks;
    const kmp_derivation_request scene = {.scheme = KMP_SCHEME_COMPOSITE};
    const kmp_program *p;
    const char *const *names;
    for (int k = 0; k < KMP_EQ_SETS; k++)
        if (shown & 1u << k)
            KMP_TRY(kmp_tally_sets(system->model, &scene, 1u << k, &t[k]));
    KMP_TRY(find_program(system, &p, &names));
    KMP_TRY(find_gains(system->model, &gains));
    KMP_TRY(count_blocks(system, &blocks));
    if (format == KEMPE_TEXT) {
        show_stats(out, system, p, names, t, &blocks);
        show_gains(out, &gains);
        return KEMPE_OK;
    }
    kmp_json json = kmp_print_head(out, system, KEMPE_OUTCOME_COMPLETE, "", system->build_s, NULL);
    kmp_json_string(&json, "view", "stats");
    json_stats(&json, p, names, t, &blocks);
    kmp_json_array(&json, "simplifications");
    for (int k = 0; k < gains.count; k++)
        json_gain(&json, &gains.steps[k]);
    kmp_json_put(&json, "] without_ways [");
    for (int k = 0; k < VARIANTS; k++)
        json_gain(&json, &gains.savings[k]);
    json_gain(&json, &gains.all);
    kmp_json_put(&json, "} made %ld needed %ld", gains.made, gains.needed);
    kmp_json_end(&json);
    return KEMPE_OK;
}

static const char *const view_names[] = {[KEMPE_VIEW_EQUATIONS] = "equations",
                                         [KEMPE_VIEW_PROGRAM] = "program",
                                         [KEMPE_VIEW_STATS] = "stats",
                                         [KEMPE_VIEW_PASSES] = "passes"};

/* Each line of a view as one string. */
static void json_lines(kmp_json *json, kmp_text *view)
{
    kmp_json_array(json, "lines");
    for (char *s = view->s; s && *s;) {
        char *end = strchr(s, '\n');
        if (end)
            *end = '\0';
        kmp_json_string(json, NULL, s);
        s = end ? end + 1 : s + strlen(s);
    }
    kmp_json_end(json);
}

static kempe_status write_lines(kmp_text *out, const kempe_system *system, kempe_view view, kempe_format format)
{
    kmp_text lines = {0};
    const kmp_program *p;
    const char *const *names;
    kempe_status status = view == KEMPE_VIEW_PROGRAM ? find_program(system, &p, &names)
                                                     : show_equations(&lines, system, view == KEMPE_VIEW_PASSES);
    if (status == KEMPE_OK && view == KEMPE_VIEW_PROGRAM)
        kmp_program_print(p, names, &lines);
    if (status == KEMPE_OK && format == KEMPE_TEXT) {
        kmp_text_put(out, lines.s ? lines.s : "");
    } else if (status == KEMPE_OK) {
        kmp_json json = kmp_print_head(out, system, KEMPE_OUTCOME_COMPLETE, "", system->build_s, NULL);
        kmp_json_string(&json, "view", view_names[view]);
        json_lines(&json, &lines);
        kmp_json_end(&json);
    }
    kmp_text_free_part(out, &lines);
    if (status == KEMPE_OK && view == KEMPE_VIEW_PASSES && format == KEMPE_TEXT) {
        kmp_text_put(out, "\n");
        status = write_stats(out, system, format);
    }
    return status;
}

kempe_status kempe_system_print(const kempe_system *system, kempe_view view, kempe_format format, char **text)
{
    KMP_WANTED_BOTH(system, text);
    kmp_text out = {0};
    kmp_context_clear(system->context);
    kempe_status status =
        view == KEMPE_VIEW_STATS ? write_stats(&out, system, format) : write_lines(&out, system, view, format);
    if (status == KEMPE_OK)
        return kmp_print_finish(system->context, &out, text);
    kmp_text_free(&out);
    return status;
}
