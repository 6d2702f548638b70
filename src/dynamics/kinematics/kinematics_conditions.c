/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions: of expressions, and of elements, whose value in a graph is noted when their law or residual is derived
 * there. */
#include "dynamics/kinematics/kinematics_conditions.h"
#include "base/memory.h"
#include "base/text.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "symbolic/function_table.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Part of a coefficient of cubics within which two pieces are one: they are computed with roundings. */
#define ONE_CUBIC 1e-9

void kmp_events_free(kmp_events *events)
{
    for (int k = 0; k < events->count; k++)
        kmp_free(events->condition[k].text);
    kmp_free(events->condition);
    kmp_free(events->place);
    *events = (kmp_events){0};
}

void kmp_noted_free(kmp_noted *noted)
{
    if (noted)
        kmp_free(noted->note);
}

/* -- numbers of conditions --------------------------------------------------------------------------- */

static bool is_condition(const kmp_condition *condition, const void *of, int number)
{
    return condition->of == of && condition->number == number;
}

/* The place of a condition, or the free one for it. An address determines only the place, never an order. */
static int *place_of(const kmp_events *events, const void *of, int number)
{
    uint64_t hash = ((uint64_t)(uintptr_t)of + (uint64_t)number) * 0x9e3779b97f4a7c15u;
    int k = (int)((hash >> 32) % (uint64_t)events->places);
    while (events->place[k] > 0 && !is_condition(&events->condition[events->place[k] - 1], of, number))
        k = k + 1 < events->places ? k + 1 : 0;
    return &events->place[k];
}

int kmp_events_find(const kmp_events *events, const void *of, int number)
{
    if (events->places > 0)
        return *place_of(events, of, number) - 1;
    for (int k = 0; k < events->count; k++)
        if (is_condition(&events->condition[k], of, number))
            return k;
    return -1;
}

static void put_place(kmp_events *events, int k)
{
    int *place = place_of(events, events->condition[k].of, events->condition[k].number);
    *place = *place > 0 ? *place : k + 1; /* the first of equal ones counts */
}

/* Makes places for one condition more. False: no memory. */
static bool grow_places(kmp_events *events)
{
    enum { FIRST = 64 };
    int places = events->places > 0 ? events->places : FIRST;
    while (places < 2 * (events->count + 1))
        places *= 2;
    if (places == events->places)
        return true;
    int *place = KMP_NEW(int, places);
    if (!place)
        return false;
    kmp_free(events->place);
    events->place = place;
    events->places = places;
    for (int k = 0; k < events->count; k++)
        put_place(events, k);
    return true;
}

int kmp_events_add(kmp_events *events, kmp_condition condition)
{
    kmp_condition *grown = kmp_realloc(events->condition, (size_t)events->count + 1, sizeof *grown);
    events->condition = grown ? grown : events->condition;
    if (!grown || (!condition.expr && !condition.text) || !grow_places(events)) {
        kmp_free(condition.text);
        return -1;
    }
    events->condition[events->count] = condition;
    put_place(events, events->count);
    return events->count++;
}

static bool moves(const kmp_graph *g, kmp_ref value)
{
    return kmp_graph_node(g, kmp_id(value))->depends & ~(1u << KMP_IN_PARAMETER);
}

/* True if a condition may be an input: not where multipliers or accelerations decide. Once the events are settled only
 * existing conditions may: a condition without influence on the motion is evaluated at each row. */
static bool can_stand(const kmp_tree *tree, const void *of, int number, kmp_ref less)
{
    const unsigned late = 1u << KMP_IN_LAMBDA | 1u << KMP_IN_QDD;
    unsigned depends = kmp_graph_node(tree->graph, kmp_id(less))->depends;
    return tree->conditions.events && moves(tree->graph, less) && !(depends & late) &&
           (!tree->conditions.settled || kmp_events_find(tree->conditions.events, of, number) >= 0);
}

/* -- of expressions ---------------------------------------------------------------------------------- */

static bool note(kmp_noted *noted, int k, kmp_ref value)
{
    if (k >= noted->count) {
        kmp_noted_value *grown = kmp_realloc(noted->note, (size_t)k + 1, sizeof *grown);
        if (!grown)
            return false;
        for (int i = noted->count; i <= k; i++)
            grown[i] = (kmp_noted_value){.known = false};
        noted->note = grown;
        noted->count = k + 1;
    }
    noted->note[k] = (kmp_noted_value){value, true};
    return true;
}

static bool is_place(const kmp_expr *e, const void *user)
{
    (void)user;
    return e->kind == KMP_EXPR_PLACE;
}

/* True for an expression of a curve: its value is known where its row is derived. */
static bool has_place(const kmp_expr *e)
{
    return kmp_expr_find(e, is_place, NULL);
}

/* The input for a condition of its expression with this difference, or `otherwise`. */
static kmp_ref stand_in(const kmp_tree *tree, kmp_condition condition, kmp_ref difference, kmp_ref otherwise)
{
    const kmp_expr *e = condition.expr;
    int k = kmp_events_find(tree->conditions.events, e, condition.number);
    condition.of = e;
    if (k < 0)
        k = kmp_events_add(tree->conditions.events, condition);
    if (k < 0 || (tree->place && has_place(e) && !note(tree->conditions.noted, k, difference)))
        kmp_graph_fail(tree->graph);
    return k >= 0 ? kmp_input(tree->graph, KMP_IN_MODE, (uint32_t)k) : otherwise;
}

kmp_ref kmp_tree_stated(const kmp_tree *tree, const kmp_expr *e, kmp_ref a, kmp_ref b)
{
    kmp_graph *g = tree->graph;
    kmp_ref less = kmp_less(g, a, b);
    return can_stand(tree, e, 0, less) ? stand_in(tree, (kmp_condition){.expr = e}, kmp_sub(g, a, b), less) : less;
}

/* Bends have negative numbers: an expression under a name may be in a closure and in a force. */
static kmp_ref bend(const kmp_tree *tree, const kmp_expr *e, int number, kmp_ref difference)
{
    static const char *const advice = "rates jump there each time; make the closure smooth at this place";
    return stand_in(tree, (kmp_condition){.expr = e, .number = -number, .bend = true, .advice = advice}, difference,
                    KMP_ZERO);
}

static kmp_ref kink(const kmp_tree *tree, const kmp_expr *e, int number, kmp_ref difference)
{
    return stand_in(tree, (kmp_condition){.expr = e, .number = number, .kink = true}, difference, KMP_ZERO);
}

/* The branch for side below: a - b is negative. */
static kmp_ref branch_of(kmp_graph *g, kmp_op op, kmp_ref below, kmp_ref a, kmp_ref b)
{
    return op == KMP_OP_ABS   ? kmp_mul(g, kmp_select(g, below, kmp_neg(KMP_ONE), KMP_ONE), a)
           : op == KMP_OP_MIN ? kmp_select(g, below, a, b)
                              : kmp_select(g, below, b, a);
}

kmp_ref kmp_tree_kink(const kmp_tree *tree, const kmp_expr *e, kmp_ref a, kmp_ref b)
{
    kmp_graph *g = tree->graph;
    kmp_op op = e->function == KMP_FUNCTION_abs   ? KMP_OP_ABS
                : e->function == KMP_FUNCTION_min ? KMP_OP_MIN
                                                  : KMP_OP_MAX;
    kmp_ref whole = op == KMP_OP_ABS ? kmp_unary(g, op, a) : kmp_binary(g, op, a, b), less = kmp_less(g, a, b);
    if (tree->conditions.bends && can_stand(tree, e, -1, less))
        return branch_of(g, op, bend(tree, e, 1, kmp_sub(g, a, b)), a, b);
    if (!tree->conditions.kinks || !can_stand(tree, e, 0, less))
        return whole;
    kmp_ref side = kink(tree, e, 0, kmp_sub(g, a, b));
    kmp_ref branch =
        op == KMP_OP_ABS ? kmp_neg(kmp_mul(g, side, a)) : branch_of(g, op, kmp_less(g, KMP_ZERO, side), a, b);
    return kmp_select(g, side, branch, whole);
}

/* Arguments of exp, and less the size of others, at which a function that falls as an exponential begins to count, and
 * at which a step sees that it does. */
static const double levels[] = {-14, -7, -2};

static kmp_ref beyond_level(kmp_graph *g, const kmp_expr *e, int number, kmp_ref a)
{
    kmp_ref above = e->function == KMP_FUNCTION_exp ? a : kmp_neg(kmp_unary(g, KMP_OP_ABS, a));
    return kmp_sub(g, above, kmp_const(g, levels[number - 1]));
}

void kmp_tree_watch_pulse(const kmp_tree *tree, const kmp_expr *e, kmp_ref a)
{
    kmp_graph *g = tree->graph;
    const unsigned state = 1u << KMP_IN_Q | 1u << KMP_IN_QD;
    const bool falls = e->function == KMP_FUNCTION_exp || e->function == KMP_FUNCTION_cosh ||
                       e->function == KMP_FUNCTION_sinh || e->function == KMP_FUNCTION_tanh;
    if (!tree->conditions.watches || !falls)
        return;
    /* Functions only of t are studied before a run (backend/time_scales.h). */
    const unsigned depends = kmp_graph_node(g, kmp_id(a))->depends;
    if (!(depends & state) && !(depends & 1u << KMP_IN_TIME && kmp_expr_find_named(e->a, kmp_expr_is_input, NULL)))
        return;
    for (int k = 1; k <= (int)(sizeof levels / sizeof *levels); k++) {
        kmp_ref beyond = beyond_level(g, e, k, a);
        if (can_stand(tree, e, k, kmp_less(g, beyond, KMP_ZERO)))
            (void)stand_in(tree, (kmp_condition){.expr = e, .number = k, .rough = true}, beyond, KMP_ZERO);
    }
}

/* -- of tables --------------------------------------------------------------------------------------- */

/* Conditions of a table by their numbers: its knots, as bends negative ones; both ends of each variable; where a table
 * holds its values, its ends as knots are; all knots of a variable in one. */
int kmp_table_end_number(const kmp_named_table *table, int end)
{
    return (table->table ? table->table->count : 0) + 1 + end;
}

static int hold_number(const kmp_named_table *table, int side)
{
    return kmp_table_end_number(table, 4 + side);
}

/* max(beyond, 0) at knot k of the table of expression e. */
static kmp_ref hinge(const kmp_tree *tree, const kmp_expr *e, int k, kmp_ref beyond)
{
    kmp_graph *g = tree->graph;
    if (tree->conditions.bends)
        return kmp_select(g, bend(tree, e, k, beyond), KMP_ZERO, beyond);
    kmp_ref side = kink(tree, e, k, beyond);
    return kmp_select(g, side, kmp_select(g, kmp_less(g, KMP_ZERO, side), KMP_ZERO, beyond),
                      kmp_binary(g, KMP_OP_MAX, beyond, KMP_ZERO));
}

/* Inputs that select pieces are at most this number, except of straight lines in a closure, where rates jump at each
 * knot. Tables of more knots than are watched have small kinks, which cost more to locate than to pass. */
enum { MOST_KNOTS = 34, MOST_WATCHED = 1000 };

static bool can_stand_at(const kmp_tree *tree, const kmp_expr *e, int first, int last, kmp_ref x)
{
    const int sign = tree->conditions.bends && e->table->table->method == KMP_TABLE_LINEAR ? -1 : 1;
    bool can = moves(tree->graph, x);
    for (int k = first; can && k <= last; k++)
        can = can_stand(tree, e, sign * k, kmp_less(tree->graph, x, kmp_const(tree->graph, e->table->table->x[k])));
    return can;
}

/* Straight lines: the first of them, and at each knot the change of the slope times max(x - knot, 0). */
static kmp_ref lines(const kmp_tree *tree, const kmp_expr *e, kmp_ref x)
{
    kmp_graph *g = tree->graph;
    const kmp_table *t = e->table->table;
    kmp_ref sum = kmp_add(g, kmp_const(g, t->y[0]),
                          kmp_mul(g, kmp_const(g, t->piece[0][1]), kmp_sub(g, x, kmp_const(g, t->x[0]))));
    for (int k = 1; k < t->count - 1; k++) {
        kmp_ref beyond = kmp_sub(g, x, kmp_const(g, t->x[k]));
        kmp_ref change = kmp_const(g, t->piece[k][1] - t->piece[k - 1][1]);
        sum = kmp_add(g, sum, kmp_mul(g, change, hinge(tree, e, k, beyond)));
    }
    return sum;
}

/* The place and the coefficients of a cubic piece, from the straight line before the table, -1, to that behind it. */
static void find_cubic(const kmp_table *t, int k, double number[5])
{
    const double before[] = {t->x[0], t->y[0], t->piece[0][1], 0, 0};
    const double behind[] = {t->x[t->count - 1], t->y[t->count - 1], t->last_slope, 0, 0};
    number[0] = t->x[k < 0 ? 0 : k];
    if (k < 0 || k == t->count - 1)
        memcpy(number, k < 0 ? before : behind, sizeof before);
    else
        memcpy(number + 1, t->piece[k], sizeof t->piece[k]);
}

/* True where two pieces are one cubic, as the first two and the last two of a table. */
static bool is_one_cubic(const kmp_table *t, int k)
{
    return k > 0 && k < t->count - 1 &&
           fabs(t->piece[k][3] - t->piece[k - 1][3]) <=
               ONE_CUBIC * fmax(fabs(t->piece[k][3]), fabs(t->piece[k - 1][3]));
}

/* A cubic curve in a closure. Accelerations have a kink at each knot, where a third derivative jumps, and jump at both
 * ends. Between them the curve is the cubic that the inputs of all knots select; near a knot that has none, the table.
 */
static kmp_ref cubics(const kmp_tree *tree, const kmp_expr *e, kmp_ref x, kmp_ref whole)
{
    kmp_graph *g = tree->graph;
    const kmp_table *t = e->table->table;
    kmp_ref chosen[5] = {KMP_ZERO}, all = KMP_ONE;
    double number[5];
    for (int k = t->count - 1; k >= 0; k--) {
        find_cubic(t, k, number);
        for (int i = 0; k == t->count - 1 && i < 5; i++)
            chosen[i] = kmp_const(g, number[i]);
        if (is_one_cubic(t, k))
            continue;
        kmp_ref side = kink(tree, e, k, kmp_sub(g, x, kmp_const(g, t->x[k]))), below = kmp_less(g, KMP_ZERO, side);
        int before = k - 1;
        while (is_one_cubic(t, before))
            before--;
        find_cubic(t, before, number);
        for (int i = 0; i < 5; i++)
            chosen[i] = kmp_select(g, below, kmp_const(g, number[i]), chosen[i]);
        all = kmp_mul(g, all, side);
    }
    kmp_ref d = kmp_sub(g, x, chosen[0]), value = chosen[4];
    for (int i = 3; i >= 1; i--)
        value = kmp_add(g, kmp_mul(g, value, d), chosen[i]);
    return kmp_select(g, all, value, whole);
}

/* x within the range of a table: first + max(x - first, 0) - max(x - last, 0). */
static kmp_ref held(const kmp_tree *tree, const kmp_expr *e, kmp_ref x)
{
    kmp_graph *g = tree->graph;
    const kmp_named_table *table = e->table;
    kmp_ref beyond[2], part[2];
    bool can = moves(g, x) && (tree->conditions.bends || tree->conditions.kinks);
    for (int side = 0; side < 2; side++) {
        const int number = hold_number(table, side);
        beyond[side] = kmp_sub(g, x, kmp_const(g, kmp_table_end(table, side)));
        can = can && can_stand(tree, e, tree->conditions.bends ? -number : number, kmp_less(g, beyond[side], KMP_ZERO));
    }
    for (int side = 0; side < 2; side++)
        part[side] = can ? hinge(tree, e, hold_number(table, side), beyond[side])
                         : kmp_binary(g, KMP_OP_MAX, beyond[side], KMP_ZERO);
    return kmp_sub(g, kmp_add(g, kmp_const(g, kmp_table_end(table, 0)), part[0]), part[1]);
}

/* The argument of a periodic table less *turns times the period. */
static kmp_ref wrapped(kmp_graph *g, const kmp_named_table *table, int periods, kmp_ref x, kmp_ref *turns)
{
    const double first = kmp_table_end(table, 0), period = periods * (kmp_table_end(table, 1) - first);
    *turns = kmp_unary(g, KMP_OP_FLOOR, kmp_div(g, kmp_sub(g, x, kmp_const(g, first)), kmp_const(g, period)));
    return kmp_sub(g, x, kmp_mul(g, kmp_const(g, period), *turns));
}

static int knot_count(const kmp_named_table *table, int variable)
{
    return table->of_two ? table->surface->count[variable] : table->table->count;
}

/* Straight lines with a zero at each knot of a table where a derivative jumps, and another sign behind it. One period
 * may have an odd number of them, and two have not. NULL: no memory. */
static kmp_table *signs_of(const kmp_named_table *named, int variable)
{
    const kmp_table *t = named->table;
    const double *knots = t ? t->x : named->surface->knot[variable];
    const int all = knot_count(named, variable);
    const double period = knots[all - 1] - knots[0];
    const bool spline = t && (t->method == KMP_TABLE_CUBIC || t->method == KMP_TABLE_PERIODIC);
    int count = 0;
    double *x = kmp_calloc(4 * (size_t)all, sizeof *x), *y = kmp_calloc(4 * (size_t)all, sizeof *y);
    for (int turn = 0; x && y && turn <= named->periodic; turn++)
        for (int k = turn > 0; k < all; k++) {
            const double knot = knots[k] + turn * period;
            if (spline && is_one_cubic(t, k))
                continue;
            if (count > 0) {
                x[count] = x[count - 1] + (knot - x[count - 1]) / 2;
                y[count] = count % 4 == 1 ? 1 : -1;
                count++;
            }
            x[count++] = knot;
        }
    kmp_table *signs = x && y ? kmp_table_new(KMP_TABLE_LINEAR, count, x, y) : NULL;
    kmp_free(x);
    kmp_free(y);
    return signs;
}

/* The value of the condition of all knots of a variable, x. */
static kmp_ref sign_between_knots(kmp_graph *g, const kmp_named_table *table, int variable, kmp_ref x)
{
    kmp_table *signs = signs_of(table, variable);
    const int number = kmp_graph_add_table(g, signs);
    kmp_ref turns, sign = kmp_table_at(g, number, table->periodic ? wrapped(g, table, 2, x, &turns) : x);
    if (signs)
        kmp_table_free(signs);
    return sign;
}

/* Between the knots of a table the equations are smooth: there a step of high order ends. */
static void watch_knots(const kmp_tree *tree, const kmp_expr *e, int variable, kmp_ref x)
{
    const int number = hold_number(e->table, 2 + variable);
    if (!tree->conditions.watches || knot_count(e->table, variable) > MOST_WATCHED || !moves(tree->graph, x))
        return;
    kmp_ref sign = sign_between_knots(tree->graph, e->table, variable, x);
    if (can_stand(tree, e, number, kmp_less(tree->graph, sign, KMP_ZERO)))
        (void)stand_in(tree, (kmp_condition){.expr = e, .number = number, .kink = true, .rough = true}, sign, KMP_ZERO);
}

/* Notes an argument of a table that an output uses. */
static void note_use(const kmp_tree *tree, const kmp_expr *e, int variable, kmp_ref x)
{
    kmp_table_uses *uses = tree->uses;
    const kmp_table_use use = {(int)(e->table - tree->model->tables), variable, x};
    for (int k = 0; k < uses->count; k++)
        if (uses->use[k].table == use.table && uses->use[k].variable == variable && uses->use[k].at == x)
            return;
    if (uses->count == uses->most) {
        kmp_table_use *more = KMP_GRAPH_NEW(tree->graph, kmp_table_use, 2 * uses->most + 4);
        if (!more)
            return;
        for (int k = 0; k < uses->count; k++)
            more[k] = uses->use[k];
        uses->use = more;
        uses->most = 2 * uses->most + 4;
    }
    uses->use[uses->count++] = use;
}

/* Watches both ends of a variable of a table, x: its run ends there, or it is reported that they are passed. */
static void watch_ends(const kmp_tree *tree, const kmp_expr *e, int variable, kmp_ref x)
{
    static const char *const advice = "give it more points, or say outside: linear or hold";
    bool ends = e->table->outside == KMP_OUTSIDE_ERROR;
    if (tree->uses && e->table->outside != KMP_OUTSIDE_LINEAR)
        note_use(tree, e, variable, x);
    if (e->table->outside == KMP_OUTSIDE_LINEAR || !tree->conditions.events || tree->conditions.settled ||
        !moves(tree->graph, x) || (tree->place && has_place(e)))
        return;
    for (int end = 2 * variable; end < 2 * variable + 2; end++) {
        int number = kmp_table_end_number(e->table, end);
        const kmp_condition condition = {.of = e,
                                         .number = number,
                                         .expr = e,
                                         .ends = ends,
                                         .validity = ends ? KMP_VALIDITY_NONE : KMP_VALIDITY_TABLE,
                                         .advice = ends ? advice : NULL};
        if (kmp_events_find(tree->conditions.events, e, number) < 0 &&
            kmp_events_add(tree->conditions.events, condition) < 0)
            kmp_graph_fail(tree->graph);
    }
}

kmp_ref kmp_tree_surface(const kmp_tree *tree, const kmp_expr *e, kmp_ref x, kmp_ref y)
{
    kmp_graph *g = tree->graph;
    const kmp_ref given[2] = {x, y};
    kmp_ref at[2] = {x, y};
    for (int k = 0; k < 2; k++) {
        watch_knots(tree, e, k, given[k]);
        if (e->table->outside == KMP_OUTSIDE_HOLD)
            at[k] = kmp_binary(g, KMP_OP_MIN,
                               kmp_binary(g, KMP_OP_MAX, given[k], kmp_const(g, kmp_table_end(e->table, 2 * k))),
                               kmp_const(g, kmp_table_end(e->table, 2 * k + 1)));
        else
            watch_ends(tree, e, k, given[k]);
    }
    return kmp_surface_at(g, e->table->surface, at[0], at[1]);
}

kmp_ref kmp_tree_table(const kmp_tree *tree, const kmp_expr *e, kmp_ref x)
{
    kmp_graph *g = tree->graph;
    const kmp_named_table *table = e->table;
    const kmp_table *t = table->table;
    const bool straight = t->method == KMP_TABLE_LINEAR, few = t->count <= MOST_KNOTS,
               holds = table->outside == KMP_OUTSIDE_HOLD;
    const int number = kmp_graph_add_table(g, table->table);
    if (table->periodic) {
        kmp_ref turns, inside = wrapped(g, table, 1, x, &turns);
        watch_knots(tree, e, 0, x);
        return kmp_add(g, kmp_table_at(g, number, inside), kmp_mul(g, kmp_const(g, table->rise), turns));
    }
    if (holds)
        x = held(tree, e, x);
    else
        watch_ends(tree, e, 0, x);
    kmp_ref whole = kmp_table_at(g, number, x);
    if (straight && (tree->conditions.bends || (tree->conditions.kinks && few)))
        return can_stand_at(tree, e, 1, t->count - 2, x) ? lines(tree, e, x) : whole;
    if (!straight && !holds && tree->conditions.bends && few)
        return can_stand_at(tree, e, 0, t->count - 1, x) ? cubics(tree, e, x, whole) : whole;
    watch_knots(tree, e, 0, x);
    return whole;
}

/* The value of a condition of a table: the distance from a knot or an end, or within the range. */
static kmp_ref table_event(const kmp_tree *tree, const kmp_condition *condition)
{
    kmp_graph *g = tree->graph;
    const kmp_expr *e = condition->expr;
    const kmp_named_table *table = e->table;
    const int k = abs(condition->number), end = k - kmp_table_end_number(table, 0), hold = k - hold_number(table, 0);
    kmp_ref x = kmp_tree_expression(tree, hold == 3 || (end >= 2 && hold < 0) ? e->b : e->a);
    if (hold >= 2)
        return sign_between_knots(g, table, hold - 2,
                                  table->outside == KMP_OUTSIDE_HOLD && !table->of_two ? held(tree, e, x) : x);
    if (hold >= 0)
        return kmp_sub(g, x, kmp_const(g, kmp_table_end(table, hold)));
    if (end >= 0) {
        kmp_ref last = kmp_const(g, kmp_table_end(table, end));
        return end % 2 ? kmp_sub(g, last, x) : kmp_sub(g, x, last);
    }
    return kmp_sub(g, table->outside == KMP_OUTSIDE_HOLD ? held(tree, e, x) : x, kmp_const(g, table->table->x[k]));
}

/* -- of elements ------------------------------------------------------------------------------------- */

/* The number of a condition whose value is noted; -1 when there is no memory. Frees the text. */
static int meet(const kmp_tree *tree, kmp_condition condition, kmp_ref value, kmp_text *text)
{
    int k = kmp_events_find(tree->conditions.events, condition.of, condition.number);
    if (k < 0) {
        condition.text = kmp_text_take(text);
        k = kmp_events_add(tree->conditions.events, condition);
    }
    kmp_text_free(text);
    if (k >= 0 && note(tree->conditions.noted, k, value))
        return k;
    kmp_graph_fail(tree->graph);
    return -1;
}

kmp_ref kmp_tree_condition(const kmp_tree *tree, const void *of, int number, kmp_ref difference, double lag,
                           const char *advice, const char *format, ...)
{
    kmp_graph *g = tree->graph;
    kmp_ref less = kmp_less(g, difference, KMP_ZERO);
    if (!can_stand(tree, of, number, less))
        return less;
    const kmp_condition condition = {.of = of, .number = number, .lag = lag, .advice = advice};
    kmp_text text = {0};
    KMP_TEXT_ARGUMENTS(&text, format);
    int k = meet(tree, condition, difference, &text);
    if (k < 0)
        return less;
    kmp_ref holds = kmp_input(g, KMP_IN_MODE, (uint32_t)k);
    if (lag > 0) {
        /* Notes the value of condition k, whose input is `holds`: the difference with its lag. */
        kmp_ref by = kmp_const(g, lag);
        if (!note(tree->conditions.noted, k, kmp_add(g, difference, kmp_select(g, holds, kmp_neg(by), by))))
            kmp_graph_fail(g);
    }
    return holds;
}

void kmp_tree_watch_table(const kmp_tree *tree, const void *of, int number, const kmp_named_table *table, kmp_ref x,
                          const char *format, ...)
{
    if (!tree->conditions.watches || table->table->count > MOST_KNOTS || !moves(tree->graph, x))
        return;
    kmp_ref sign = sign_between_knots(tree->graph, table, 0, x);
    if (!can_stand(tree, of, number, kmp_less(tree->graph, sign, KMP_ZERO)))
        return;
    const kmp_condition condition = {.of = of, .number = number, .kink = true, .rough = true};
    kmp_text text = {0};
    KMP_TEXT_ARGUMENTS(&text, format);
    (void)meet(tree, condition, sign, &text);
}

void kmp_tree_warn_where_true(const kmp_tree *tree, const void *of, int number)
{
    const int k = tree->conditions.events ? kmp_events_find(tree->conditions.events, of, number) : -1;
    if (k >= 0)
        tree->conditions.events->condition[k].at_start = true;
}

void kmp_tree_end(const kmp_tree *tree, const void *of, int number, kmp_ref value, const char *advice,
                  const char *format, ...)
{
    double constant;
    bool always = kmp_is_const(tree->graph, value, &constant) && constant < 0; /* from the start */
    if (!tree->conditions.events || !(always || moves(tree->graph, value)))
        return;
    const kmp_condition condition = {.of = of, .number = number, .ends = true, .advice = advice};
    kmp_text text = {0};
    KMP_TEXT_ARGUMENTS(&text, format);
    (void)meet(tree, condition, value, &text);
}

bool kmp_tree_event(const kmp_tree *tree, int k, kmp_ref *difference)
{
    const kmp_expr *e = tree->conditions.events->condition[k].expr;
    if (tree->conditions.events->condition[k].role != KMP_ROLE_NONE) {
        *difference = kmp_friction_value(tree, &tree->conditions.events->condition[k]);
        return true;
    }
    const kmp_validity validity = tree->conditions.events->condition[k].validity;
    if (validity == KMP_VALIDITY_DEFLECTION || validity == KMP_VALIDITY_ROTATION) {
        const kmp_flexible *flexible = tree->conditions.events->condition[k].of;
        *difference =
            (validity == KMP_VALIDITY_ROTATION ? kmp_flexible_rate_margin : kmp_flexible_margin)(tree, flexible);
        return true;
    }
    if (!e || has_place(e)) {
        bool known = k < tree->conditions.noted->count && tree->conditions.noted->note[k].known;
        *difference = known ? tree->conditions.noted->note[k].value : KMP_ZERO;
        return known;
    }
    if (e->kind == KMP_EXPR_TABLE) {
        *difference = table_event(tree, &tree->conditions.events->condition[k]);
        return true;
    }
    kmp_ref a = kmp_tree_expression(tree, e->a), b = e->b ? kmp_tree_expression(tree, e->b) : KMP_ZERO;
    if (tree->conditions.events->condition[k].rough) {
        *difference = beyond_level(tree->graph, e, tree->conditions.events->condition[k].number, a);
        return true;
    }
    bool turned = e->kind == KMP_EXPR_GREATER || e->kind == KMP_EXPR_AT_MOST;
    *difference = turned ? kmp_sub(tree->graph, b, a) : kmp_sub(tree->graph, a, b);
    return true;
}
