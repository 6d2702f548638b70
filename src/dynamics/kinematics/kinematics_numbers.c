/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers and expressions of the model as nodes of the graph. */
#include "dynamics/kinematics/kinematics_numbers.h"
#include "base/clones.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_measures.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "symbolic/function_table.h"
#include "symbolic/surface.h"
#include <math.h>
#include <string.h>

static kmp_ref call(kmp_graph *g, kmp_function f, kmp_ref a, kmp_ref b, kmp_ref c)
{
    (void)b, (void)c;
    switch (f) {
#define KMP_FUNCTION(name, arity, value, node)                                                                         \
    case KMP_FUNCTION_##name:                                                                                          \
        return node;
#include "model/language/functions.def"
#undef KMP_FUNCTION
    case KMP_FUNCTION_COUNT:
        break;
    }
    return KMP_ZERO;
}

/* True if an expression depends on parameters that can be kept as symbols. An exact zero stays a zero: the zero pattern
 * of the data is part of a program's identity. Numbers that shape the equations have the value read in all of them. */
static bool follows(const kempe_model *model, const kmp_expr *e)
{
    if (!e)
        return false;
    if (e->kind == KMP_EXPR_PARAMETER) {
        const kmp_parameter *p = &model->parameters[e->index];
        return !p->shapes && (p->number.value != 0 || follows(model, p->number.expr));
    }
    return follows(model, e->a) || follows(model, e->b) || follows(model, e->c);
}

/* A parameter's reference. A dependent parameter is no symbol of its own. A variable one has no value yet. */
KMP_NOINLINE static kmp_ref parameter(const kmp_tree *tree, int index)
{
    const kmp_parameter *p = &tree->model->parameters[index];
    if (p->varies)
        return kmp_input(tree->graph, KMP_IN_PARAMETER, (uint32_t)index);
    if (tree->keep == KMP_KEEP_NOTHING || p->shapes)
        return kmp_const(tree->graph, p->number.value);
    if (follows(tree->model, p->number.expr))
        return kmp_tree_expression(tree, p->number.expr);
    return p->number.value == 0 ? KMP_ZERO : kmp_input(tree->graph, KMP_IN_PARAMETER, (uint32_t)index);
}

KMP_NOINLINE static kmp_ref symbol(const kmp_tree *tree, int number, double value)
{
    int index = tree->model->parameter_count + number - 1;
    if (value == 0)
        return KMP_ZERO;
    tree->symbols[index] = value;
    return kmp_input(tree->graph, KMP_IN_PARAMETER, (uint32_t)index);
}

static double constant_value(const kmp_tree *tree, const kmp_expr *e);

kmp_ref kmp_tree_multiplier(const kmp_tree *tree, int closure, int component)
{
    int row = tree->row && component >= 0 ? tree->row[KMP_CLOSURE_ROWS * closure + component] : -1;
    return row < 0 ? KMP_ZERO : kmp_input(tree->graph, KMP_IN_LAMBDA, (uint32_t)row);
}

int kmp_tree_kept(const kmp_tree *tree, int closure, int k)
{
    for (int i = 0; tree->row && i < KMP_CLOSURE_ROWS; i++)
        if (tree->row[KMP_CLOSURE_ROWS * closure + i] >= 0 && k-- == 0)
            return i;
    return -1;
}

/* The force of a pin that closes a loop, across its axis. */
static void press_pin(const kmp_tree *tree, int c, kmp_ref force[3])
{
    const kempe_model *model = tree->model;
    const kmp_closure *closure = &model->closures[c];
    const int *point = closure->point;
    int frame = kmp_tree_common(tree, kmp_point_link(tree, point[0]), kmp_point_link(tree, point[1]));
    int body = kmp_model_common_body(model, model->points[point[0]].body, model->points[point[1]].body);
    kmp_vec axis = kmp_point_direction(tree, point[0], closure->axis[0], frame);
    axis = kmp_body_vector_back(tree, body, axis);
    kmp_vec whole = {{force[0], force[1], force[2]}}, across = kmp_vec_cross(tree->graph, whole, axis);
    for (int k = 0; k < 3; k++)
        force[k] = across.x[k];
}

/* The size of the force of closures that presses surfaces together. */
KMP_NOINLINE static kmp_ref size_of_force(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    kmp_ref sum = KMP_ZERO, only = KMP_ZERO;
    int count = 0;
    for (int c = e->index; c < e->index - e->number; c++) {
        const kmp_closure *closure = &tree->model->closures[c];
        kmp_ref force[KMP_CLOSURE_ROWS] = {KMP_ZERO};
        const kmp_closure_row *row = kmp_closure_row_of(closure);
        int rows = row->pressing;
        for (int k = 0; k < rows; k++)
            force[k] = kmp_tree_multiplier(tree, c, k);
        if (row->needs == KMP_NEEDS_SAME_AXIS && rows == 3) /* a pin: without the part along its axis */
            press_pin(tree, c, force);
        for (int k = 0; k < rows; k++) {
            kmp_ref lambda = force[k];
            count += lambda != KMP_ZERO;
            only = lambda != KMP_ZERO ? lambda : only;
            sum = kmp_add(g, sum, kmp_mul(g, lambda, lambda));
        }
    }
    return count == 1 ? kmp_unary(g, KMP_OP_ABS, only) : kmp_sqrt(g, sum);
}

static bool is_function(const kmp_expr *e, kmp_function function)
{
    return e->kind == KMP_EXPR_CALL && e->function == function;
}

static bool is_kink(const kmp_expr *e)
{
    return is_function(e, KMP_FUNCTION_abs) || is_function(e, KMP_FUNCTION_min) || is_function(e, KMP_FUNCTION_max);
}

/* True for a comparison. Bounds take account of the kinks of compared expressions: they need not be conditions. */
static bool is_compared(const kmp_expr *e)
{
    return e->kind == KMP_EXPR_LESS || e->kind == KMP_EXPR_AT_MOST || e->kind == KMP_EXPR_GREATER ||
           e->kind == KMP_EXPR_AT_LEAST || is_function(e, KMP_FUNCTION_sign);
}

/* True if an expression is undefined somewhere. A fixed branch is evaluated beyond its kink for a part of a step, which
 * must not leave the domain. */
static bool has_limits(const kmp_expr *e)
{
    return e->kind == KMP_EXPR_DIV || is_function(e, KMP_FUNCTION_pow) || is_function(e, KMP_FUNCTION_sqrt) ||
           is_function(e, KMP_FUNCTION_log) || is_function(e, KMP_FUNCTION_asin) || is_function(e, KMP_FUNCTION_acos) ||
           is_function(e, KMP_FUNCTION_atan2);
}

static bool is_limit(const kmp_expr *e, double limit)
{
    return e && e->kind == KMP_EXPR_NUMBER && fabs(e->value) == limit;
}

/* True if a kink keeps the argument of a function within its domain, which ends at `limit` and its negative: beyond the
 * kink the function is undefined, and at it the rates do not jump. */
static bool is_kept_in(const kmp_expr *e, double limit)
{
    if (is_kink(e))
        return (is_function(e, KMP_FUNCTION_abs) && limit == 0) || is_limit(e->a, limit) || is_limit(e->b, limit);
    bool product = e->kind == KMP_EXPR_MUL || e->kind == KMP_EXPR_NEG;
    return product && (is_kept_in(e->a, limit) || (e->b && is_kept_in(e->b, limit)));
}

static bool keeps_in(const kmp_expr *e)
{
    bool by_one = is_function(e, KMP_FUNCTION_asin) || is_function(e, KMP_FUNCTION_acos);
    bool by_zero =
        is_function(e, KMP_FUNCTION_sqrt) || is_function(e, KMP_FUNCTION_log) || is_function(e, KMP_FUNCTION_pow);
    return (by_zero && is_kept_in(e->a, 0)) || (by_one && is_kept_in(e->a, 1));
}

/* An operand, within which kinks and bends may be no conditions. */
KMP_NOINLINE static kmp_ref without(const kmp_tree *tree, bool kinks, bool bends, const kmp_expr *e)
{
    kmp_tree within = *tree;
    within.kinks = kinks;
    within.bends = bends;
    return kmp_tree_expression(&within, e);
}

/* Most operations change nothing for their operands: in deep expressions the stack holds no copies of the tree. */
static kmp_ref operand(const kmp_tree *tree, bool kinks, bool bends, const kmp_expr *e)
{
    return kinks == tree->kinks && bends == tree->bends ? kmp_tree_expression(tree, e) : without(tree, kinks, bends, e);
}

KMP_NOINLINE static kmp_ref power(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    bool kept = tree->keep != KMP_KEEP_NOTHING && follows(tree->model, e->b);
    double exponent = kept || kmp_expr_varies(tree->model, e->b) ? NAN : constant_value(tree, e->b);
    bool whole = exponent >= 0 && exponent == floor(exponent);
    const bool kinks = tree->kinks && whole, bends = tree->bends && (whole || !is_kept_in(e->a, 0));
    kmp_ref base = operand(tree, kinks, bends, e->a);
    if (is_function(e->a, KMP_FUNCTION_tanh))
        kmp_tree_watch_pulse(tree, e->a, operand(tree, kinks, bends, e->a->a));
    if (tree->bends && exponent > 0 && !whole) {
        /* max(x, 0)^p of a closure: zero with all its derivatives where x is not positive, where those of x^p are
         * infinite. */
        const kmp_node *n = kmp_graph_node(g, kmp_id(base));
        const kmp_ref x = n->a == KMP_ZERO ? n->b : n->a;
        if (n->op != KMP_OP_MAX || kmp_is_negative(base) || (n->a != KMP_ZERO && n->b != KMP_ZERO))
            return kmp_power(g, base, exponent);
        const kmp_ref positive = kmp_less(g, KMP_ZERO, x);
        return kmp_select(g, positive, kmp_power(g, kmp_select(g, positive, x, KMP_ONE), exponent), KMP_ZERO);
    }
    return isnan(exponent) ? kmp_binary(g, KMP_OP_POW, base, operand(tree, kinks, bends, e->b))
                           : kmp_power(g, base, exponent);
}

static kmp_ref operation(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    const bool kinks = tree->kinks && !is_compared(e) && !has_limits(e);
    const bool bends = tree->bends && !is_compared(e) && !keeps_in(e);
    kmp_ref a = e->kind == KMP_EXPR_DIV ? kmp_tree_expression(tree, e->a) : operand(tree, kinks, bends, e->a);
    kmp_ref b = e->b ? operand(tree, kinks, bends, e->b) : KMP_ZERO;
    switch (e->kind) {
    case KMP_EXPR_ADD:
        return kmp_add(g, a, b);
    case KMP_EXPR_SUB:
        return kmp_sub(g, a, b);
    case KMP_EXPR_MUL:
        return kmp_mul(g, a, b);
    case KMP_EXPR_LESS:
        return kmp_tree_stated(tree, e, a, b);
    case KMP_EXPR_GREATER:
        return kmp_tree_stated(tree, e, b, a);
    case KMP_EXPR_AT_MOST:
        return kmp_select(g, kmp_tree_stated(tree, e, b, a), KMP_ZERO, KMP_ONE);
    case KMP_EXPR_AT_LEAST:
        return kmp_select(g, kmp_tree_stated(tree, e, a, b), KMP_ZERO, KMP_ONE);
    case KMP_EXPR_CALL:
        if (e->function == KMP_FUNCTION_sign)
            return kmp_select(g, kmp_tree_stated(tree, e, a, KMP_ZERO), kmp_neg(KMP_ONE), KMP_ONE);
        if (is_kink(e))
            return kmp_tree_kink(tree, e, a, b);
        if (e->function != KMP_FUNCTION_tanh) /* of a step of the function both ends of a step of the run tell */
            kmp_tree_watch_pulse(tree, e, a);
        return call(g, e->function, a, b, e->c ? kmp_tree_expression(tree, e->c) : KMP_ZERO);
    default:
        return kmp_div(g, a, b);
    }
}

KMP_NOINLINE static kmp_ref table_of(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_ref y = e->b ? kmp_tree_expression(tree, e->b) : KMP_ZERO, x = kmp_tree_expression(tree, e->a);
    return e->b ? kmp_tree_surface(tree, e, x, y) : kmp_tree_table(tree, e, x);
}

kmp_ref kmp_tree_expression(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_graph *g = tree->graph;
    /* A law that is one number. */
    if (e->symbol && tree->keep == KMP_KEEP_NUMBERS && !follows(tree->model, e))
        return symbol(tree, e->symbol, constant_value(tree, e));
    switch (e->kind) {
    case KMP_EXPR_NUMBER:
        return kmp_const(g, e->value);
    case KMP_EXPR_PARAMETER:
        return parameter(tree, e->index);
    case KMP_EXPR_TIME:
        return kmp_input(g, KMP_IN_TIME, 0);
    case KMP_EXPR_INPUT:
        return kmp_input(g, KMP_IN_TIME, kmp_time_index(e->index, 0));
    case KMP_EXPR_Q:
        return kmp_input(g, KMP_IN_Q, (uint32_t)e->index);
    case KMP_EXPR_QD:
        return kmp_input(g, KMP_IN_QD, (uint32_t)e->index);
    case KMP_EXPR_LAMBDA:
        if (e->measure)
            return kmp_tree_measure(tree, e->measure, e->number);
        return e->number < 0 ? size_of_force(tree, e)
                             : kmp_tree_multiplier(tree, e->index, kmp_tree_kept(tree, e->index, e->number));
    case KMP_EXPR_UNKNOWN:
        return kmp_tree_unknown(tree, e);
    case KMP_EXPR_PLACE:
        return tree->place[e->index];
    case KMP_EXPR_TABLE:
        return table_of(tree, e);
    case KMP_EXPR_MEASURE:
        return kmp_tree_measure(tree, e->measure, e->number);
    case KMP_EXPR_RATE:
        return kmp_tree_rate(tree, e->a);
    case KMP_EXPR_CUT:
        return kmp_tree_expression(tree, e->a);
    case KMP_EXPR_NEG:
        return kmp_neg(kmp_tree_expression(tree, e->a));
    case KMP_EXPR_POW:
        return power(tree, e);
    default:
        return operation(tree, e);
    }
}

kmp_ref kmp_tree_bent(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_tree bent = *tree;
    bent.bends = bent.watches = true;
    return kmp_tree_expression(&bent, e);
}

/* The value of an exponent, which is a number of the program for all parameters. */
KMP_NOINLINE static double constant_value(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_tree folded = *tree;
    double value = NAN;
    folded.keep = KMP_KEEP_NOTHING;
    folded.unknown = NULL;
    kmp_ref r = kmp_tree_expression(&folded, e);
    return kmp_is_const(tree->graph, r, &value) ? value : NAN;
}

kmp_ref kmp_tree_number(const kmp_tree *tree, const kmp_number *number)
{
    const kmp_expr *e = number->expr;
    if (e && kmp_expr_varies(tree->model, e))
        return kmp_tree_expression(tree, e);
    if (tree->keep != KMP_KEEP_NOTHING && follows(tree->model, e))
        return kmp_tree_expression(tree, e);
    if (tree->keep != KMP_KEEP_NUMBERS || !number->symbol)
        return kmp_const(tree->graph, number->value);
    return symbol(tree, number->symbol, number->value);
}

int kmp_tree_symbol_count(const kmp_tree *tree)
{
    return tree->model->parameter_count + (tree->keep == KMP_KEEP_NUMBERS ? tree->model->symbol_count : 0);
}

void kmp_tree_symbol_values(const kmp_tree *tree, double *value)
{
    for (int k = 0; k < kmp_tree_symbol_count(tree); k++)
        value[k] = k < tree->model->parameter_count ? tree->model->parameters[k].number.value : tree->symbols[k];
}

kmp_vec kmp_tree_vector(const kmp_tree *tree, const kmp_number number[3])
{
    kmp_vec v;
    for (int k = 0; k < 3; k++)
        v.x[k] = kmp_tree_number(tree, &number[k]);
    return v;
}
