/* SPDX-License-Identifier: BSD-3-Clause */
/* Sets of equations by name, their entries and their operation counts; the steps of a program. */
#include "studies/show/sets.h"
#include "base/memory.h"
#include "dynamics/choose_variants.h"
#include "model/data/model.h"
#include "symbolic/live.h"
#include "symbolic/ops.h"
#include <string.h>

/* -- steps ----------------------------------------------------------------------------------------------- */

/* Steps of a program: the longest chain of named variables, found in one loop through the instructions. A value that is
 * used once is a part of the expression that uses it, and not a separate step. */

typedef struct work {
    const kmp_program *p;
    int leaves;
    int *uses;
    long *index; /* the largest one below an instruction; of a variable its own */
    bool *angle; /* a sum of inputs */
} work;

static void count_readers(work *w, int count)
{
    const kmp_program *p = w->p;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++) {
            int value = (int)(kmp_instruction_operand(&p->instruction[i], k) >> 1);
            if (value >= w->leaves)
                w->uses[value - w->leaves]++;
        }
    for (int k = 0; k < p->outputs[p->stages]; k++) {
        int value = (int)(p->output[k] >> 1);
        if (value >= w->leaves)
            w->uses[value - w->leaves] += 2; /* has a separate name */
    }
}

/* True for values available before the first step: functions of parameters, sums of inputs, their sines and cosines. */
static bool is_known(const work *w, int i)
{
    const kmp_instruction *in = &w->p->instruction[i];
    int value = (int)(in->a >> 1);
    if (i < w->p->code[1])
        return true;
    return (in->op == KMP_OP_SIN || in->op == KMP_OP_COS) && (value < w->leaves || w->angle[value - w->leaves]);
}

static long index_of(const work *w, int i)
{
    const kmp_instruction *in = &w->p->instruction[i];
    long index = 0;
    if (is_known(w, i))
        return 0;
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
        int value = (int)(kmp_instruction_operand(in, k) >> 1);
        if (value >= w->leaves && w->index[value - w->leaves] > index)
            index = w->index[value - w->leaves];
    }
    return w->uses[i] > 1 ? index + 1 : index;
}

kmp_steps kmp_program_steps(const kmp_program *p)
{
    int count = p->code[p->stages];
    kmp_arena arena = {0};
    kmp_steps steps = {.vector = -1};
    work w = {.p = p,
              .leaves = p->constant_count + p->input_count,
              .uses = KMP_ARENA_NEW(&arena, int, count),
              .index = KMP_ARENA_NEW(&arena, long, count),
              .angle = KMP_ARENA_NEW(&arena, bool, count)};
    if (!arena.failed) {
        steps.vector = 0;
        count_readers(&w, count);
    }
    for (int i = 0; !arena.failed && i < count; i++) {
        const kmp_instruction *in = &p->instruction[i];
        bool sum = in->op == KMP_OP_ADD || in->op == KMP_OP_MUL;
        for (int k = 0; sum && k < kmp_op_arity((kmp_op)in->op); k++) {
            int value = (int)(kmp_instruction_operand(in, k) >> 1);
            sum = value < w.leaves || w.angle[value - w.leaves];
        }
        w.angle[i] = sum;
        w.index[i] = index_of(&w, i);
        steps.serial += w.uses[i] > 1 && !is_known(&w, i);
        if (w.index[i] > steps.vector)
            steps.vector = w.index[i];
    }
    kmp_arena_free(&arena);
    return steps;
}

static const struct {
    const char *name;
    unsigned sets;
} groups[] = {
#define KMP_EQUATIONS(id, name, derive, rows, columns, lower, entries, inputs, array, meaning)
#define KMP_GROUP(name, members) {name, members},
#include "studies/show/sets.def"
#undef KMP_EQUATIONS
#undef KMP_GROUP
};

enum { GROUPS = sizeof groups / sizeof *groups };

kmp_set kmp_set_of(const kmp_equations *eq, int set)
{
    enum {
        QD = 1 << KMP_IN_QD,
        QDD = 1 << KMP_IN_QDD,
        LAMBDA = 1 << KMP_IN_LAMBDA,
        MODES = 1 << KMP_IN_MODE,
        ALONG = 1 << KMP_IN_ALONG
    };
    enum { LOADS = 1 << KMP_IN_FORCE | 1 << KMP_IN_TORQUE };
    static const kmp_equations none;
    const kmp_equations *of = eq ? eq : &none;
    const int n = of->n, m = of->m, w = of->outputs.shown_count, f = of->sticking.count, d = of->states.count;
    const int c = of->contacts.count, e = of->delays.count, g = of->conditions.watched_count, s = of->along.count;
    const kmp_set sets[] = {
#define KMP_EQUATIONS(id, name, derive, rows, columns, lower, entries, inputs, array, meaning)                         \
    {name, derive, rows, columns, lower, of->entries, inputs, array, meaning},
#define KMP_GROUP(name, members)
#include "studies/show/sets.def"
#undef KMP_EQUATIONS
#undef KMP_GROUP
    };
    return sets[set];
}

int kmp_set_size(const kmp_set *set)
{
    return set->lower ? set->rows * (set->rows + 1) / 2 : set->rows * (set->columns ? set->columns : 1);
}

/* -- names ------------------------------------------------------------------------------------------- */

static bool is_called(const char *own, const char *name, size_t length)
{
    return strlen(own) == length && strncmp(own, name, length) == 0;
}

unsigned kmp_sets_find(const char *name, size_t length)
{
    for (int k = 0; k < GROUPS; k++)
        if (is_called(groups[k].name, name, length))
            return groups[k].sets;
    for (int k = 0; k < KMP_EQ_LOADS; k++)
        if (is_called(kmp_set_of(NULL, k).name, name, length))
            return 1u << k;
    return 0;
}

void kmp_sets_list(kmp_text *text)
{
    for (int k = 0; k < GROUPS; k++)
        kmp_text_printf(text, "%s%s", k ? ", " : "", groups[k].name);
    for (int k = 0; k < KMP_EQ_LOADS; k++)
        kmp_text_printf(text, ", %s", kmp_set_of(NULL, k).name);
}

unsigned kmp_sets_derive(unsigned wanted)
{
    unsigned derive = 0;
    for (int k = 0; k < KMP_EQ_SETS; k++)
        derive |= wanted & 1u << k ? kmp_set_of(NULL, k).derive : 0;
    return derive;
}

/* -- entries ----------------------------------------------------------------------------------------- */

int kmp_sets_size(const kmp_equations *eq, unsigned wanted)
{
    int size = 0;
    for (int k = 0; k < KMP_EQ_SETS; k++) {
        kmp_set set = kmp_set_of(eq, k);
        size += wanted & 1u << k ? kmp_set_size(&set) : 0;
    }
    return size;
}

void kmp_sets_put(const kmp_equations *eq, unsigned wanted, kmp_assignment *entries)
{
    for (int k = 0; k < KMP_EQ_SETS; k++) {
        kmp_set set = kmp_set_of(eq, k);
        if (!(wanted & 1u << k))
            continue;
        for (int i = 0; i < set.rows; i++)
            if (set.columns)
                for (int j = 0; j < (set.lower ? i + 1 : set.columns); j++)
                    *entries++ = (kmp_assignment){set.name, i, j, set.entries[i * set.columns + j]};
            else
                *entries++ = (kmp_assignment){set.name, i, -1, set.entries[i]};
    }
}

kmp_ref *kmp_sets_outputs(const kmp_equations *eq, unsigned wanted)
{
    int count = kmp_sets_size(eq, wanted);
    kmp_assignment *entries = KMP_NEW(kmp_assignment, count);
    kmp_ref *outputs = entries ? KMP_NEW(kmp_ref, count) : NULL;
    if (outputs)
        kmp_sets_put(eq, wanted, entries);
    for (int k = 0; outputs && k < count; k++)
        outputs[k] = entries[k].value;
    kmp_free(entries);
    return outputs;
}

kmp_program *kmp_sets_program(const kmp_equations *eq, unsigned wanted)
{
    int count = kmp_sets_size(eq, wanted);
    kmp_ref *outputs = kmp_sets_outputs(eq, wanted);
    kmp_program *program = NULL;
    if (outputs && kmp_equations_shorten(eq, count, outputs))
        program = kmp_program_of_parameters(eq->graph, count, outputs);
    kmp_free(outputs);
    return program;
}

/* -- counts ------------------------------------------------------------------------------------------ */

kmp_tally kmp_tally_program(const kmp_program *p, int first, int last)
{
    return (kmp_tally){.counts = kmp_program_count(p, first, last),
                       .runtime = kmp_program_count(p, first > 0 ? first : 1, last),
                       .created = (long)p->graph_nodes,
                       .kept = (long)p->constant_count + p->input_count + p->code[p->stages],
                       .operations = p->code[last + 1] - p->code[first]};
}

kempe_status kmp_tally_sets(const kempe_model *model, const kmp_derivation_request *scene, unsigned wanted,
                            kmp_tally *tally)
{
    kmp_equations eq;
    kmp_derivation_request alone = *scene;
    alone.sets = kmp_sets_derive(wanted);
    KMP_TRY(kmp_equations_derive(&eq, model, &alone));
    kmp_program *program = kmp_sets_program(&eq, wanted);
    kmp_steps steps = {.vector = -1};
    if (program)
        steps = kmp_program_steps(program);
    bool ok = steps.vector >= 0;
    if (ok) {
        *tally = kmp_tally_program(program, 0, 1);
        long count = 0;
        for (uint32_t id = 0; id < kmp_graph_count(eq.graph); id++)
            count += kmp_op_arity((kmp_op)kmp_graph_node(eq.graph, id)->op) > 0;
        tally->useless = count - tally->operations;
        tally->steps = steps;
    }
    kmp_program_free(program);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(model->context);
}

/* -- assignments ----------------------------------------------------------------------------------------- */

/* Graph outputs as scalar assignments for reading: an auxiliary variable for each expression that is used more than
 * once or would make a line too long, everything else in place. */

enum { LONGEST = 72, INPUT_LENGTH = 10 };

/* The precedence of an operand's position. */
typedef enum place { PLACE_TOP, PLACE_TERM, PLACE_FACTOR, PLACE_DIVISOR } place;

typedef struct printer {
    const kmp_equations *eq;
    const kmp_graph *g;
    kmp_text *text;
    uint8_t *needed;    /* 1 + the set that needs a node first, 0: none */
    uint32_t *uses;     /* by needed nodes and outputs */
    uint32_t *length;   /* of the text in place, approximately */
    uint32_t *variable; /* number of the auxiliary variable, 0: none */
    uint32_t variables;
} printer;

/* -- nodes with a name ------------------------------------------------------------------------------- */

static void count_uses(printer *p, int count, const kmp_assignment *a)
{
    for (uint32_t id = 0; id < kmp_graph_count(p->g); id++) {
        const kmp_node *n = kmp_graph_node(p->g, id);
        int arity = kmp_op_arity((kmp_op)n->op);
        if (!p->needed[id] || arity == 0)
            continue;
        for (int k = 0; k < arity; k++)
            p->uses[kmp_id(kmp_operand(n, k))]++;
    }
    for (int k = 0; k < count; k++)
        p->uses[kmp_id(a[k].value)]++;
}

/* Chooses variables. Operands precede their users, so that one pass decides. */
static void choose_variables(printer *p)
{
    for (uint32_t id = 0; id < kmp_graph_count(p->g); id++) {
        const kmp_node *n = kmp_graph_node(p->g, id);
        int arity = kmp_op_arity((kmp_op)n->op);
        p->length[id] = INPUT_LENGTH;
        if (!p->needed[id] || arity == 0)
            continue;
        p->length[id] = 5;
        for (int k = 0; k < arity; k++)
            p->length[id] += p->variable[kmp_id(kmp_operand(n, k))] ? 5 : p->length[kmp_id(kmp_operand(n, k))];
        if (p->uses[id] > 1 || p->length[id] > LONGEST)
            p->variable[id] = 1;
    }
}

/* -- text -------------------------------------------------------------------------------------------- */

static void print_input(printer *p, const kmp_node *n)
{
    static const char *const vector[KMP_IN_COUNT] = {"",     "t",     "q",     "qd",    "qdd",    "lambda", "mu",
                                                     "mode", "place", "chart", "force", "torque", "effort", "along"};
    const kempe_model *model = p->eq->model;
    const bool of_motion = n->a == KMP_IN_Q || n->a == KMP_IN_QD || n->a == KMP_IN_QDD;
    if (n->a == KMP_IN_PARAMETER)
        kmp_text_put(p->text, model->parameters[n->b].name);
    else if (n->a == KMP_IN_TIME && n->b == 0)
        kmp_text_put(p->text, "t");
    else if (n->a == KMP_IN_TIME)
        kmp_text_printf(p->text, "%s%.*s", model->inputs[(n->b - 1) / KMP_TIME_NUMBERS].name,
                        (int)((n->b - 1) % KMP_TIME_NUMBERS), "''");
    else if (of_motion)
        kmp_text_printf(p->text, "%s(%s)", vector[n->a], model->motions[n->b].name);
    else
        kmp_text_printf(p->text, "%s(%u)", n->a < KMP_IN_COUNT ? vector[n->a] : "?", n->b + 1);
}

static void print_operand(printer *p, kmp_ref r, place at);

/* A table has its number, and a prime for each differentiation. */
static void print_function(printer *p, const kmp_node *n)
{
    kmp_text_put(p->text, kmp_op_text((kmp_op)n->op));
    if (kmp_op_form_of((kmp_op)n->op) == KMP_FORM_APPLIED)
        kmp_text_printf(p->text, "%u%.*s", n->b + 1, (int)n->c, "'''");
    for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++) {
        kmp_text_put(p->text, k ? ", " : "(");
        print_operand(p, kmp_operand(n, k), PLACE_TOP);
    }
    kmp_text_put(p->text, ")");
}

static void print_node(printer *p, uint32_t id)
{
    const kmp_node *n = kmp_graph_node(p->g, id);
    switch ((kmp_op)n->op) {
    case KMP_OP_CONST:
        kmp_text_number(p->text, kmp_graph_value(p->g, id));
        break;
    case KMP_OP_INPUT:
        print_input(p, n);
        break;
    case KMP_OP_ADD:
        print_operand(p, n->a, PLACE_TERM);
        kmp_text_put(p->text, kmp_is_negative(n->b) ? " - " : " + ");
        print_operand(p, n->b & ~1u, PLACE_TERM);
        break;
    case KMP_OP_MUL:
        print_operand(p, n->a, PLACE_FACTOR);
        kmp_text_put(p->text, "*");
        print_operand(p, n->b, PLACE_FACTOR);
        break;
    case KMP_OP_DIV:
        print_operand(p, n->a, PLACE_FACTOR);
        kmp_text_put(p->text, "/");
        print_operand(p, n->b, PLACE_DIVISOR);
        break;
    default:
        print_function(p, n);
    }
}

/* A sum inside a product, anything composed below a fraction bar, and a sign that is not in front need parentheses. */
static bool needs_parentheses(const printer *p, kmp_ref r, place at)
{
    uint32_t id = kmp_id(r);
    kmp_op op = (kmp_op)kmp_graph_node(p->g, id)->op;
    bool composed = !p->variable[id] && (op == KMP_OP_ADD || op == KMP_OP_MUL || op == KMP_OP_DIV);
    if (kmp_is_negative(r))
        return at >= PLACE_FACTOR;
    return composed && ((at == PLACE_FACTOR && op == KMP_OP_ADD) || at == PLACE_DIVISOR);
}

static void print_operand(printer *p, kmp_ref r, place at)
{
    uint32_t id = kmp_id(r);
    bool parentheses = needs_parentheses(p, r, at);
    kmp_text_put(p->text, parentheses ? "(" : "");
    if (kmp_is_negative(r)) {
        kmp_text_put(p->text, "-");
        print_operand(p, r ^ 1u, PLACE_FACTOR);
    } else if (p->variable[id]) {
        kmp_text_printf(p->text, "a%u", p->variable[id]);
    } else {
        print_node(p, id);
    }
    kmp_text_put(p->text, parentheses ? ")" : "");
}

/* -- sets -------------------------------------------------------------------------------------------- */

static void print_variables(printer *p, uint8_t set)
{
    for (uint32_t id = 0; id < kmp_graph_count(p->g); id++) {
        if (p->needed[id] != set || !p->variable[id])
            continue;
        p->variable[id] = ++p->variables;
        kmp_text_printf(p->text, "a%u = ", p->variable[id]);
        print_node(p, id);
        kmp_text_put(p->text, "\n");
    }
}

static void print_assignment(printer *p, const kmp_assignment *a)
{
    if (a->value == KMP_ZERO)
        return;
    kmp_text_printf(p->text, "%s[%d", a->set, a->row + 1);
    if (a->col >= 0)
        kmp_text_printf(p->text, ",%d", a->col + 1);
    kmp_text_put(p->text, "] = ");
    print_operand(p, a->value, PLACE_TOP);
    kmp_text_put(p->text, "\n");
}

static int end_of_set(int count, const kmp_assignment *a, int first)
{
    int end = first;
    while (end < count && strcmp(a[end].set, a[first].set) == 0)
        end++;
    return end;
}

static void mark_needed(printer *p, int count, const kmp_assignment *a)
{
    uint8_t set = 0;
    for (int first = 0; first < count;) {
        int end = end_of_set(count, a, first);
        for (set++; first < end; first++)
            kmp_live_begin(1, &a[first].value, p->needed, set);
    }
    kmp_live_spread(p->g, p->needed);
}

static void print_sets(printer *p, int count, const kmp_assignment *a)
{
    uint8_t set = 0;
    for (int first = 0; first < count;) {
        int end = end_of_set(count, a, first);
        kmp_text_printf(p->text, "%s# %s\n", first ? "\n" : "", a[first].set);
        print_variables(p, ++set);
        for (; first < end; first++)
            print_assignment(p, &a[first]);
    }
}

bool kmp_assignments_print(const kmp_equations *eq, int count, const kmp_assignment *a, kmp_text *text)
{
    uint32_t nodes = kmp_graph_count(eq->graph);
    kmp_arena arena = {0};
    printer p = {.eq = eq,
                 .g = eq->graph,
                 .text = text,
                 .needed = KMP_ARENA_NEW(&arena, uint8_t, nodes),
                 .uses = KMP_ARENA_NEW(&arena, uint32_t, nodes),
                 .length = KMP_ARENA_NEW(&arena, uint32_t, nodes),
                 .variable = KMP_ARENA_NEW(&arena, uint32_t, nodes)};
    bool ok = !arena.failed;
    if (ok) {
        mark_needed(&p, count, a);
        count_uses(&p, count, a);
        choose_variables(&p);
        print_sets(&p, count, a);
    }
    kmp_arena_free(&arena);
    return ok;
}
