/* SPDX-License-Identifier: BSD-3-Clause */
/* Derives h, J, h_t, their rates and jdqd of all closures by differentiation in the graph. A row without coordinates is
 * dropped if it is zero, and otherwise an error. Multipliers are numbered by the remaining rows. */
#include "dynamics/closures.h"
#include "constraints/kinds/kind.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/cam_contact.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/gear_mesh.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/point_gap.h"
#include "dynamics/system.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "model/read/loads.h"
#include "symbolic/derivative.h"
#include "symbolic/substitute.h"
#include "symbolic/table_function.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* -- rows -------------------------------------------------------------------------------------------- */

/* The largest coefficient that counts as zero after summation of the points' components along the loops. */
#define ROUNDING 1e-13

/* The component of a row, for closures between two points, whose rows are components of a vector. */
static const char *component_name(const kmp_closure *closure, int component)
{
    static const char *const names[] = {"x", "y", "z"}, *const numbers[] = {"1", "2", "3", "4", "5", "6"};
    return kmp_closure_row_of(closure)->balls == 1 ? names[component] : numbers[component];
}

/* The value of an expression without coordinates, at t = 0; NaN when there is no memory. An expression of only a
 * rotation by a chart is the expression of a vector without coordinates in turned axes: its size does not depend on the
 * chart. */
static double constant_value(const kmp_equations *eq, kmp_ref h)
{
    double gap = NAN, *parameter, *times, *chart, *value;
    const kmp_tree *tree = &eq->tree;
    int charts = 1;
    for (int i = 0; i < tree->count; i++) {
        charts = tree->links[i].before >= charts ? tree->links[i].before + 1 : charts;
        charts = tree->links[i].after >= charts ? tree->links[i].after + 1 : charts;
    }
    kmp_arena room = {0};
    if (KMP_ARENA_MAKE(&room, KMP_ROOM(double, kmp_graph_count(eq->graph), &value),
                       KMP_ROOM(double, kmp_tree_symbol_count(&eq->tree), &parameter),
                       KMP_ROOM(double, 1 + KMP_TIME_NUMBERS * eq->model->input_count, &times),
                       KMP_ROOM(double, 9 * charts, &chart))) {
        const double *inputs[KMP_IN_COUNT] = {
            [KMP_IN_PARAMETER] = parameter, [KMP_IN_TIME] = times, [KMP_IN_CHART] = chart};
        for (int k = 0; k < 9 * charts; k++) /* rotations of charts that turn nothing */
            chart[k] = k % 9 % 4 == 0;
        kmp_model_times(eq->model, 0, times);
        kmp_tree_symbol_values(&eq->tree, parameter);
        kmp_graph_eval(eq->graph, inputs, value);
        gap = kmp_is_negative(h) ? -value[kmp_id(h)] : value[kmp_id(h)];
    }
    kmp_arena_free(&room);
    return gap;
}

/* A row without coordinates: 0 = 0, but for rounding of the program or of the model's numbers, is dropped, anything
 * else can never be met. */
static kempe_status constant_row(kmp_equations *eq, const kmp_closure *closure, int component, kmp_ref h, double size,
                                 double unit)
{
    unsigned depends = kmp_graph_node(eq->graph, kmp_id(h))->depends;
    bool moves = depends & (1u << KMP_IN_TIME);
    if (depends & (1u << KMP_IN_PARAMETER) && eq->tree.keep == KMP_KEEP_NOTHING)
        return kmp_complain(eq->context, eq->model->source.files[closure->place.file], closure->place.line,
                            closure->place.column,
                            "closure '%s' cannot have variable parameters: its component %s depends on them, but not "
                            "on coordinates; let both its points depend on the same parameters",
                            closure->name, component_name(closure, component));
    double gap = h == KMP_ZERO ? 0 : constant_value(eq, h);
    if (isnan(gap))
        return kmp_fail_memory(eq->context);
    if (!moves && fabs(gap) <= ROUNDING * size)
        return KEMPE_OK;
    if (moves)
        return kmp_complain(eq->context, eq->model->source.files[closure->place.file], closure->place.line,
                            closure->place.column,
                            "closure '%s' cannot be satisfied at all times: its component %s depends on t only; let it "
                            "depend on a coordinate",
                            closure->name, component_name(closure, component));
    double length = kmp_system_length(eq->model), allowed = kmp_closure_tolerance(eq->model);
    double *misfit = &eq->closures.misfit[closure - eq->model->closures];
    if (fabs(gap) / unit * length <= allowed) {
        *misfit = fmax(*misfit, fabs(gap) / unit);
        return KEMPE_OK;
    }
    return kmp_complain(eq->context, eq->model->source.files[closure->place.file], closure->place.line,
                        closure->place.column,
                        "closure '%s' cannot be satisfied: its component %s is %.6g for all coordinates, more than the "
                        "closure_tolerance of %.2g m; move one of its points",
                        closure->name, component_name(closure, component), gap, allowed);
}

/* A row of an element with modes that no coordinate moves. */
static kempe_status complain_still(const kmp_equations *eq, const kmp_closure *closure)
{
    const kmp_force *force = &eq->model->forces[closure->force];
    const kmp_place at = closure->place;
    if (force->contact > 0)
        return kmp_complain(eq->context, eq->model->source.files[at.file], at.line, at.column,
                            "contact '%s': no coordinate slides or rolls its surfaces along '%s'; leave 'friction' out",
                            eq->model->forces[force->contact - 1].name, closure->name);
    return kmp_complain(eq->context, eq->model->source.files[at.file], at.line, at.column,
                        "'%s' depends on no coordinate", closure->name);
}

static int power_of(const kempe_model *model, const kmp_closure *closure, const kmp_closure_parts *kind, int row)
{
    int power = (row < kind->force->rows ? kind->force : kind->moment)->length_power;
    if (power == KMP_KIND_POWER_OF_COORDINATE)
        return model->motions[closure->motion].rotation ? 0 : 1;
    return power == KMP_KIND_POWER_GIVEN ? closure->power : power;
}

/* True for a sum of coordinates times numbers that are rounding of products of axes: the row vanishes. */
static bool is_rounding(const kmp_equations *eq, kmp_ref h)
{
    const kmp_node *node = kmp_graph_node(eq->graph, kmp_id(h));
    if (node->op == KMP_OP_ADD)
        return is_rounding(eq, node->a) && is_rounding(eq, node->b);
    if (node->op != KMP_OP_MUL)
        return false;
    const kmp_node *a = kmp_graph_node(eq->graph, kmp_id(node->a)), *b = kmp_graph_node(eq->graph, kmp_id(node->b));
    bool first = a->op == KMP_OP_CONST;
    return (first || b->op == KMP_OP_CONST) && (first ? b : a)->op == KMP_OP_INPUT &&
           fabs(constant_value(eq, first ? node->a : node->b)) <= 4 * DBL_EPSILON;
}

/* True for a component of slip in two directions that no coordinate moves, if one moves the other component: its row
 * is kept, and stays zero. */
static bool slides_otherwise(const kmp_equations *eq, const kmp_closure *closure)
{
    const kmp_force *force = kmp_closure_is_friction(closure) ? &eq->model->forces[closure->force] : NULL;
    return eq->tree.conditions.events && force && force->across > 0 &&
           kmp_depends_on(eq->graph, kmp_friction_rate(&eq->tree, kmp_friction_twin(force)), KMP_IN_QD);
}

/* True for a pair of a contact with outlines: others of its pairs move. */
static bool is_of_outline(const kmp_equations *eq, const kmp_closure *closure)
{
    const kmp_force *force = kmp_closure_is_of_modes(closure) ? &eq->model->forces[closure->force] : NULL;
    if (force && force->contact > 0)
        force = &eq->model->forces[force->contact - 1];
    return eq->tree.conditions.events && force && (force->touch.side[1].piece || force->touch.side[0].off);
}

/* Rows and rates of a closure with all translations at zero that are locked for the reactions of joints: they are what
 * other coordinates move. Of the lock of one it is its row as it is. */
static void find_moved(kmp_equations *eq, const kmp_closure *closure, const kmp_ref *h, const kmp_ref *rates,
                       kmp_ref *moved)
{
    const kempe_model *model = eq->model;
    kmp_ref from[6], none[6]; /* of at most three translations */
    uint16_t through;
    memcpy(moved, h, KMP_KIND_MAX_ROWS * sizeof *h);
    memcpy(moved + KMP_KIND_MAX_ROWS, rates, KMP_KIND_MAX_ROWS * sizeof *rates);
    for (int i = 1; i < model->body_count; i++) {
        const kmp_body *body = &model->bodies[i];
        int first = body->first_motion, count = 0;
        if (closure->motion >= first && closure->motion < first + body->load_count)
            continue;
        for (int k = first; k < first + body->load_count; k++)
            for (int rate = 0; rate < 2; rate++) {
                from[count] = kmp_input(eq->graph, rate ? KMP_IN_QD : KMP_IN_Q, (uint32_t)k);
                none[count++] = KMP_ZERO;
            }
        if (count > 0 && !kmp_substitute(eq->graph, count, from, none, 2 * KMP_KIND_MAX_ROWS, moved, &through))
            kmp_graph_fail(eq->graph);
    }
}

/* A table with kinks that are not located: of two variables, or periodic; also under a name. */
static bool is_bilinear(const kmp_expr *e, const void *user)
{
    const kempe_model *model = user;
    const kmp_unknowns *name = e->kind == KMP_EXPR_UNKNOWN ? &model->unknowns[e->index] : NULL;
    if (name && name->count == 0)
        return kmp_expr_find(name->zero[0], is_bilinear, user);
    if (e->kind != KMP_EXPR_TABLE)
        return false;
    const kmp_table *t = e->b ? e->table->surface->one[0] : e->table->table;
    return (e->b || e->table->periodic) && (t->method == KMP_TABLE_LINEAR || e->table->outside == KMP_OUTSIDE_HOLD);
}

/* Rates would jump at each line between two points of such a table: these are not located. */
static kempe_status refuse_bilinear(const kmp_equations *eq, const kmp_closure *closure)
{
    const kmp_expr *gap = kmp_closure_is_of_modes(closure) ? eq->model->forces[closure->force].touch.gap : NULL;
    const kmp_expr *const parts[] = {closure->function, closure->curve[0], closure->curve[1], gap};
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
        const kmp_expr *found = parts[k] ? kmp_expr_find(parts[k], is_bilinear, eq->model) : NULL;
        while (found && found->kind == KMP_EXPR_UNKNOWN) /* a name */
            found = kmp_expr_find(eq->model->unknowns[found->index].zero[0], is_bilinear, eq->model);
        if (found)
            return kmp_complain(eq->context, eq->model->source.files[closure->place.file], closure->place.line,
                                closure->place.column,
                                "'%s' depends on a table %s with the method linear%s: velocities would jump at its "
                                "lines; use the method spline",
                                closure->name, found->b ? "of two variables" : "with a period",
                                found->table->outside == KMP_OUTSIDE_HOLD ? " or outside: hold" : "");
    }
    return KEMPE_OK;
}

static kempe_status derive_rows(kmp_equations *eq, const kmp_derivation_request *request)
{
    const kempe_model *model = eq->model;
    kempe_status status = KEMPE_OK;
    /* The largest component of any point of the model, or of an axis. */
    double size = 1, length = kmp_system_length(model);
    for (int k = 0; k < model->point_count; k++)
        for (int i = 0; i < 3; i++)
            size = fmax(size, fabs(model->points[k].at[i].value));
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure *closure = &model->closures[c];
        const kmp_closure_parts *kind = kmp_closure_parts_of(closure->kind);
        kmp_ref h[KMP_KIND_MAX_ROWS] = {KMP_ZERO}, rates[KMP_KIND_MAX_ROWS] = {KMP_ZERO};
        int kept = 0;
        if (!kind)
            return kmp_fail(eq->context, KEMPE_E_BUG, "closure '%s' is of no kind", closure->name);
        if ((request->loops_alone && kmp_closure_is_drive(closure)) ||
            (request->frictionless && kmp_closure_is_of_modes(closure)))
            continue;
        KMP_TRY(refuse_bilinear(eq, closure));
        /* The rows of a closure: h, or, where the rows are between rates, these in `rates`, and h stays zero. */
        bool of_rates = kmp_closure_rates(kind, &eq->tree, closure, rates);
        if (!of_rates)
            kmp_closure_residual(kind, &eq->tree, closure, h);
        if (kmp_graph_failed(eq->graph))
            return kmp_fail_memory(eq->context);
        kmp_ref moved[2 * KMP_KIND_MAX_ROWS];
        find_moved(eq, closure, h, rates, moved);
        for (int k = 0; k < kmp_closure_rows(kind, closure); k++) {
            bool moves = kmp_depends_on(eq->graph, moved[k], KMP_IN_Q) && !is_rounding(eq, moved[k]);
            h[k] = moves ? h[k] : is_rounding(eq, moved[k]) ? KMP_ZERO : moved[k];
            if (moves || (of_rates && kmp_depends_on(eq->graph, moved[KMP_KIND_MAX_ROWS + k], KMP_IN_QD)) ||
                (request->keep_modes && kmp_closure_is_of_modes(closure)) || slides_otherwise(eq, closure) ||
                is_of_outline(eq, closure)) {
                eq->closures.h[eq->m] = h[k];
                eq->closures.rate[eq->m] = rates[k];
                eq->closures.first[KMP_CLOSURE_ROWS * c + k] = eq->m;
                eq->closures.rows[eq->m++] = (kmp_row){c, k, kept++, power_of(model, closure, kind, k), of_rates};
            } else if (kmp_closure_is_of_modes(closure)) { /* evaluated in place it is zero */
                status = eq->tree.conditions.events ? complain_still(eq, closure) : status;
            } else if (status != KEMPE_E_MEMORY) {
                kempe_status met =
                    constant_row(eq, closure, k, h[k], size, pow(length, power_of(model, closure, kind, k)));
                status = met != KEMPE_OK ? met : status;
            }
        }
    }
    return status;
}

/* -- multipliers that forces and sensors use --------------------------------------------------------- */

/* The first one that is of no row, NULL when there is none. */
static const kmp_expr *find_absent(const kmp_equations *eq, const kmp_expr *expr)
{
    if (!expr)
        return NULL;
    int number = expr->number < 0 || expr->measure ? 0 : expr->number; /* of a reaction: any */
    if (expr->kind == KMP_EXPR_LAMBDA)
        return kmp_tree_kept(&eq->tree, expr->index, number) < 0 ? expr : NULL;
    const kmp_expr *found = find_absent(eq, expr->a);
    found = found ? found : find_absent(eq, expr->b);
    return found ? found : find_absent(eq, expr->c);
}

/* Complains where an expression depends on a multiplier that is of no row. */
static kempe_status check_expression(const kmp_equations *eq, kmp_place place, const char *what, const char *name,
                                     const kmp_expr *expr)
{
    const kmp_expr *lambda = find_absent(eq, expr);
    if (!lambda)
        return KEMPE_OK;
    const char *loop = eq->model->closures[lambda->index].name;
    int closure = lambda->index;
    int kept = 0;
    while (kmp_tree_kept(&eq->tree, closure, kept) >= 0)
        kept++;
    if (lambda->measure)
        return kmp_complain(eq->context, eq->model->source.files[place.file], place.line, place.column,
                            "%s '%s' depends on %s(%s), but '%s' has no multipliers: equations that no coordinate "
                            "changes have none",
                            what, name, lambda->measure->word, loop, loop);
    return kmp_complain(eq->context, eq->model->source.files[place.file], place.line, place.column,
                        "%s '%s' depends on lambda(%s.%d), but '%s' has %d multiplier%s: equations that no coordinate "
                        "changes have none",
                        what, name, loop, lambda->number + 1, loop, kept, kept == 1 ? "" : "s");
}

static kempe_status check_multipliers(const kmp_equations *eq)
{
    const kempe_model *model = eq->model;
    for (int k = 0; k < model->force_count; k++) {
        const kmp_force *force = &model->forces[k];
        KMP_TRY(check_expression(eq, force->place, "force", force->name, force->effort));
        KMP_TRY(check_expression(eq, force->place, "force", force->name, force->holding_effort));
        for (int i = 0; i < 3; i++)
            KMP_TRY(check_expression(eq, force->place, "force", force->name, force->vector[i]));
    }
    for (int k = 0; k < model->run.until_count; k++)
        KMP_TRY(check_expression(eq, model->run.until_place, "run", "until", model->run.until[k]));
    for (int k = 0; k < model->sensor_count; k++)
        KMP_TRY(
            check_expression(eq, model->sensors[k].place, "sensor", model->sensors[k].name, model->sensors[k].expr));
    return KEMPE_OK;
}

/* Total derivatives of the rows by time. */
static void differentiate(const kmp_equations *eq, const kmp_ref *rows, kmp_ref *rates)
{
    kmp_derivative *d = kmp_time_derivative(&eq->tree);
    for (int r = 0; r < eq->m; r++)
        rates[r] = kmp_derivative_of(d, rows[r]);
    kmp_derivative_free(d);
}

kmp_vec kmp_closure_load(const kmp_tree *tree, int c, bool moment)
{
    const kmp_closure *closure = &tree->model->closures[c];
    const kmp_closure_parts *kind = kmp_closure_parts_of(closure->kind);
    kmp_ref lambda[KMP_KIND_MAX_ROWS] = {KMP_ZERO};
    for (int k = 0; k < kmp_closure_rows(kind, closure); k++)
        lambda[k] = kmp_tree_multiplier(tree, c, k);
    if (closure->gear)
        lambda[0] = kmp_gear_transmitted(tree, c);
    const kmp_part *part = moment ? kind->moment : kind->force;
    const bool of_face = moment && closure->cam;
    if (part->rows == 0 && !of_face)
        return kmp_vec_zero();
    kmp_vec load = of_face ? kmp_cam_load(tree, closure, lambda[0], true)
                           : part->load(tree, closure, moment ? lambda + kind->force->rows : lambda);
    if (part->load == kmp_part_effort || closure->gear)
        return load;
    const kmp_point *points = tree->model->points;
    int common = kmp_model_common_body(tree->model, points[closure->point[0]].body, points[closure->point[1]].body);
    return kmp_link_direction(tree, tree->mounts[common].link, kmp_body_vector(tree, common, load), 0);
}

/* -- the whole --------------------------------------------------------------------------------------- */

/* (J' x)_k for the multipliers of one kind. */
void kmp_closures_transposed(kmp_equations *eq, kmp_input_kind kind, kmp_ref *out)
{
    for (int k = 0; k < eq->n; k++)
        out[k] = KMP_ZERO;
    for (int r = 0; r < eq->m; r++)
        (void)kmp_input(eq->graph, kind, (uint32_t)r);
    for (int k = 0; k < eq->n; k++)
        for (int r = 0; r < eq->m; r++) {
            kmp_ref entry = eq->closures.jacobian[r * eq->n + k];
            if (entry != KMP_ZERO)
                out[k] = kmp_add(eq->graph, out[k], kmp_mul(eq->graph, entry, kmp_input(eq->graph, kind, (uint32_t)r)));
        }
}

kempe_status kmp_closures_derive(kmp_equations *eq, const kmp_derivation_request *request)
{
    unsigned sets = request->sets;
    if (sets & KMP_SET_ACCELERATION)
        sets |= KMP_SET_CLOSURE | KMP_SET_JDQD;
    if (sets & (KMP_SET_CLOSED | KMP_SET_CLOSED_Q))
        sets |= KMP_SET_CLOSURE;
    const unsigned needing = KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL | KMP_SET_REACTION | KMP_SET_OUTPUT;
    if (!(sets & needing) && !kmp_model_has_loads(eq->model))
        return KEMPE_OK;
    KMP_TRY(derive_rows(eq, request));
    if (!request->loops_alone)
        KMP_TRY(check_multipliers(eq));
    if (sets & (KMP_SET_CLOSURE | KMP_SET_RESIDUAL)) {
        kmp_partials_all(eq->graph, eq->m, eq->closures.h, KMP_IN_Q, eq->n, eq->closures.jacobian);
        kmp_derivative *d = kmp_partial_time_derivative(&eq->tree);
        for (int r = 0; r < eq->m; r++)
            eq->closures.h_t[r] = kmp_derivative_of(d, eq->closures.h[r]);
        kmp_derivative_free(d);
        /* v = J qd + h_t. */
        kmp_graph *g = eq->graph;
        kmp_ref *qd = KMP_GRAPH_NEW(g, kmp_ref, eq->n), *none = KMP_GRAPH_NEW(g, kmp_ref, eq->n);
        uint16_t through;
        for (int k = 0; qd && none && k < eq->n; k++) {
            qd[k] = kmp_input(g, KMP_IN_QD, (uint32_t)k);
            none[k] = KMP_ZERO;
        }
        for (int r = 0; r < eq->m; r++) {
            if (!eq->closures.rows[r].of_rates)
                continue;
            kmp_partials_all(g, 1, &eq->closures.rate[r], KMP_IN_QD, eq->n, eq->closures.jacobian + r * eq->n);
            eq->closures.h_t[r] = eq->closures.rate[r];
            if (!qd || !none || !kmp_substitute(g, eq->n, qd, none, 1, &eq->closures.h_t[r], &through))
                kmp_graph_fail(g);
        }
    }
    if (sets & (KMP_SET_JDQD | KMP_SET_RESIDUAL)) { /* hdot = J qd + h_t */
        differentiate(eq, eq->closures.h, eq->closures.hdot);
        for (int r = 0; r < eq->m; r++)
            eq->closures.hdot[r] = eq->closures.rows[r].of_rates ? eq->closures.rate[r] : eq->closures.hdot[r];
    }
    if (sets & KMP_SET_JDQD) /* at constant qd */
        differentiate(eq, eq->closures.hdot, eq->closures.jdqd);
    if (kmp_graph_failed(eq->graph) || (!request->plain && !kmp_gaps_shorten(eq, sets, !request->savings)))
        return kmp_fail_memory(eq->context);
    if (sets & KMP_SET_REACTION) {
        /* Forces of closures on their second bodies. */
        for (int c = 0; c < eq->model->closure_count; c++) {
            kmp_vec f = kmp_closure_load(&eq->tree, c, false);
            for (int k = 0; k < 3; k++)
                eq->closures.reaction[3 * c + k] = f.x[k];
        }
    }
    return KEMPE_OK;
}
