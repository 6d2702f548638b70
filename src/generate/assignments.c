/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/assignments.h"
#include "symbolic/program/live.h"
#include <string.h>

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
