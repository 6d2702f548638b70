/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/watch.h"
#include "backend/bounds.h"
#include "base/context.h"
#include "exchange/code/simulated.h"
#include "exchange/code/write.h"
#include "exchange/simulator/kempe_simulator.h"
#include "symbolic/table_function.h"

/* Marks values that depend on accelerations or multipliers. */
static void mark_late(const kmp_bound_code *code, const int *input, bool *late)
{
    const int first = code->constants + code->inputs;
    for (int k = 0; k < code->inputs; k++)
        late[code->constants + k] = input[2 * k] == KEMPE_WATCH_QDD || input[2 * k] == KEMPE_WATCH_LAMBDA;
    for (int k = 0; k < code->steps; k++) {
        const kmp_bound_step *in = &code->step[k];
        const int count = in->op == KMP_OP_IMPLICIT ? 0 : in->op == KMP_OP_TABLE ? 1 : kmp_op_arity((kmp_op)in->op);
        const unsigned operand[] = {in->a, in->b, in->c};
        for (int i = 0; i < count; i++)
            late[first + k] = late[first + k] || late[operand[i] >> 1];
    }
}

kempe_status kmp_watch_find(kmp_code_source *source)
{
    /* The arguments of a simulator that inputs are. */
    static const int kinds[KMP_IN_COUNT] = {
        [KMP_IN_TIME] = KEMPE_WATCH_TIME,     [KMP_IN_Q] = KEMPE_WATCH_Q,
        [KMP_IN_QD] = KEMPE_WATCH_QD,         [KMP_IN_QDD] = KEMPE_WATCH_QDD,
        [KMP_IN_LAMBDA] = KEMPE_WATCH_LAMBDA, [KMP_IN_MODE] = KEMPE_WATCH_STILL,
        [KMP_IN_CHART] = KEMPE_WATCH_CHART,   [KMP_IN_PARAMETER] = KEMPE_WATCH_PARAMETER};
    struct kmp_simulated *x = source->simulated;
    const kmp_code_routine *changes = kmp_simulated_routine(source, "changes");
    if (!changes || x->condition_count == 0)
        return KEMPE_OK;
    const kmp_program *p = changes->program;
    kmp_bounds *bounds = kmp_bounds_new(p, &source->arena);
    bool *late = KMP_ARENA_NEW(&source->arena, bool, p->constant_count + p->input_count + p->code[p->stages]);
    if (!bounds || !late || !KMP_ARENA_MAKE(&source->arena, KMP_ROOM(int, 2 * p->input_count, &x->watch_input)))
        return kmp_fail_memory(source->context);
    x->watch = bounds;
    x->watch_first = p->outputs[1];
    x->watch_solved = p->outputs[p->stages] - p->outputs[1] - x->condition_count;
    for (int k = 0; k < p->input_count; k++) {
        const kmp_program_input *in = &p->input[k];
        x->watch_input[2 * k] = in->kind == KMP_IN_TIME && in->index > 0 ? KEMPE_WATCH_INPUT : kinds[in->kind];
        x->watch_input[2 * k + 1] = in->kind == KMP_IN_TIME && in->index == 0 ? 0
                                    : in->kind == KMP_IN_PARAMETER            ? source->place[in->index]
                                                                              : kmp_place_in_argument(source, in);
    }
    mark_late(&bounds->code, x->watch_input, late);
    for (int k = 0; k < x->condition_count; k++) {
        const int output = x->watch_first + k;
        if (!bounds->known[output])
            return kmp_fail(source->context, KEMPE_E_ARGUMENT,
                            "generated simulators: %s has a value that cannot be bounded within a step, so that its "
                            "change could be missed; use a unit on the library instead (fmu --binary)",
                            x->condition_name[k]);
        const bool third = late[bounds->output[output] >> 1] || bounds->given[output];
        x->watch_traits[k] |= third ? KEMPE_WATCH_MIDDLE : 0;
    }
    return kmp_made(source->context, !source->arena.failed);
}

/* -- text ------------------------------------------------------------------------------------------------ */

static void put_doubles(kmp_text *text, const char *name, int number, int count, const double *x)
{
    kmp_text_printf(text, "static const double %s%d[] = ", name, number);
    for (int k = 0; k < count; k++) {
        kmp_put_list_item(text, &kmp_language_c.numbers, k);
        kmp_language_number(text, &kmp_language_c, x[k]);
    }
    kmp_text_printf(text, "%s};\n", count ? "" : "{0");
}

static void put_tables(kmp_text *text, const kmp_program *p)
{
    for (int k = 0; k < p->table_count; k++) {
        const kmp_table *t = p->table[k];
        put_doubles(text, "watch_x", k, t->count, t->x);
        put_doubles(text, "watch_y", k, t->count, t->y);
        put_doubles(text, "watch_pieces", k, 4 * (t->count - 1), t->piece[0]);
    }
    for (int k = 0; k < p->table_count; k++)
        kmp_text_printf(text, "%s{%d, %d, watch_x%d, watch_y%d, watch_pieces%d}%s",
                        k ? ",\n    " : "static const kempe_watch_table watch_tables[] = {", p->table[k]->count,
                        kmp_table_degree(p->table[k]), k, k, k, k + 1 < p->table_count ? "" : "};\n");
}

static void put_code(kmp_text *text, const struct kmp_simulated *x)
{
    const kmp_bound_code *code = &x->watch->code;
    put_doubles(text, "watch_constants", 0, code->constants, code->constant);
    kmp_text_put(text, "static const int watch_inputs[] = {");
    for (int k = 0; k < 2 * code->inputs; k++)
        kmp_text_printf(text, "%s%d", k ? k % 20 == 0 ? ",\n    " : ", " : "", x->watch_input[k]);
    kmp_text_printf(text, "%s};\nstatic const unsigned watch_steps[] = {", code->inputs ? "" : "0");
    for (int k = 0; k < code->steps; k++)
        kmp_text_printf(text, "%s%u, %u, %u, %u", k ? k % 5 == 0 ? ",\n    " : ", " : "", code->step[k].op,
                        code->step[k].a, code->step[k].b, code->step[k].c);
    kmp_text_printf(text, "%s};\nstatic const unsigned watch_outputs[] = {", code->steps ? "" : "0");
    for (int k = 0; k < x->condition_count + x->watch_solved; k++)
        kmp_text_printf(text, "%s%u", k ? k % 20 == 0 ? ",\n    " : ", " : "", x->watch->output[x->watch_first + k]);
    kmp_text_put(text, "};\nstatic const int watch_traits[] = {");
    for (int k = 0; k < x->condition_count; k++)
        kmp_text_printf(text, "%s%d", k ? k % 20 == 0 ? ",\n    " : ", " : "", x->watch_traits[k]);
    kmp_text_put(text, "};\n");
}

void kmp_watch_put(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    if (!x->watch)
        return;
    const kmp_program *p = kmp_simulated_routine(s, "changes")->program;
    const kmp_bound_code *code = &x->watch->code;
    put_tables(text, p);
    put_code(text, x);
    kmp_text_printf(
        text,
        "static const kempe_watch watch = {%d, %d, %d, %d, %d, %d, watch_constants0, watch_inputs, watch_steps, "
        "watch_outputs,\n    watch_traits, %s, %s, kempe_watch_search};\n\n",
        code->constants, code->inputs, code->steps, p->table_count, code->fixed, x->watch_solved,
        p->table_count > 0 ? "watch_tables" : "0", x->watch_solved > 0 ? "watch_values" : "0");
}

void kmp_watch_put_size(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    const kmp_bound_code *code = &x->watch->code;
    kmp_text_printf(text, "%d, %d, %d, %d", x->condition_count, code->constants + code->inputs + code->steps,
                    code->inputs, x->watch_solved);
}
