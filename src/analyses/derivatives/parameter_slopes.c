/* SPDX-License-Identifier: BSD-3-Clause */
/* The parameters are inputs of the graph. Dependent parameters are separate inputs, which the direction of a named
 * one includes: d(dependent) = its expression, differentiated. */
#include "analyses/derivatives/parameter_slopes.h"
#include "base/arena.h"
#include "base/memory.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/friction_modes.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "linalg/dense/dot.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include <string.h>

/* -- entries ----------------------------------------------------------------------------------------- */

/* Expressions of one program while its entries are found. */
typedef struct gather {
    kmp_slopes *s;
    kmp_slope_matrix *x; /* target of the outputs */
    kmp_arena arena;
    kmp_equations eq;
    kmp_derivative *along;     /* of one parameter after the other */
    kmp_ref *leaf, *direction; /* room for all parameters */
    const int *named;          /* the named parameters, by number */
    kmp_ref *of;               /* the expressions that are differentiated */
    int of_count;
    kmp_listing list;
} gather;

/* Ends a column, which consists of the outputs since the last end. */
static void end_column(gather *g)
{
    g->x->start[++g->x->columns] = g->list.count;
}

/* -- directions of parameters ------------------------------------------------------------------------ */

/* Appends the dependent parameters to leaves (`count`, with room for all parameters) that change in some directions,
 * each after the parameters that it needs, with the derivatives of their expressions. Returns the new number of leaves;
 * -1: no memory. */
static int lead_parameters(const kmp_tree *tree, int count, kmp_ref *leaf, kmp_ref *direction)
{
    const kempe_model *m = tree->model;
    kmp_derivative *along = kmp_derivative_new(tree->graph, count, leaf, direction);
    bool ok = along;
    for (int i = 0; ok && i < m->led_count; i++) {
        kmp_ref value = kmp_tree_expression(tree, m->parameters[m->led[i]].number.expr);
        ok = kmp_derivative_restart(along, count, leaf, direction);
        direction[count] = ok ? kmp_derivative_of(along, value) : KMP_ZERO;
        leaf[count++] = kmp_input(tree->graph, KMP_IN_PARAMETER, (uint32_t)m->led[i]);
    }
    kmp_derivative_free(along);
    return ok ? count : -1;
}

/* A column of derivatives along the leaves. */
static bool add_direction(gather *g, int leaves)
{
    bool ok = kmp_derivative_restart(g->along, leaves, g->leaf, g->direction);
    for (int i = 0; ok && i < g->of_count; i++)
        kmp_listing_put(&g->list, 0, i, g->x->columns, kmp_derivative_of(g->along, g->of[i]));
    end_column(g);
    return ok;
}

/* The input of a named parameter, or of an input of the model (find_names). */
static kmp_ref leaf_of(kmp_graph *graph, int named)
{
    return named >= 0 ? kmp_input(graph, KMP_IN_PARAMETER, (uint32_t)named)
                      : kmp_input(graph, KMP_IN_TIME, (uint32_t)(-1 - named));
}

/* A column for each parameter. */
static bool add_parameters(gather *g)
{
    bool ok = true;
    for (int p = 0; ok && p < g->s->count; p++) {
        g->leaf[0] = leaf_of(g->eq.graph, g->named[p]);
        g->direction[0] = KMP_ONE;
        int leaves = lead_parameters(&g->eq.tree, 1, g->leaf, g->direction);
        ok = leaves > 0 && add_direction(g, leaves);
    }
    return ok;
}

/* -- the equations ----------------------------------------------------------------------------------- */

enum { SETS_OF_EQUATIONS = KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL };

/* The equations to differentiate: h, J qd + h_t and J qdd + jdqd (m each), M qdd + C - J' lambda (n). */
static void collect_sets(const kmp_equations *eq, kmp_ref *of)
{
    int n = eq->n, m = eq->m;
    for (int i = 0; i < m; i++) {
        of[i] = eq->closures.h[i];
        of[m + i] = eq->closures.hdot[i];
        of[2 * m + i] = kmp_equations_curve(eq, i);
    }
    memcpy(of + 3 * m, eq->dynamics.residual, (size_t)n * sizeof *of);
}

/* The characteristic length: of the offset that is longest with the current values. */
static kmp_ref length(const gather *g)
{
    kmp_graph *graph = g->eq.graph;
    const kmp_length_scale scale = kmp_system_length_scale(g->eq.model);
    kmp_ref square = KMP_ZERO;
    if (scale.body > 0) {
        const kmp_body *body = &g->eq.model->bodies[scale.body];
        return kmp_sqrt(graph, kmp_div(graph, kmp_tree_number(&g->eq.tree, &body->inertia[scale.axis]),
                                       kmp_tree_number(&g->eq.tree, &body->mass)));
    }
    for (int i = 0; i < 3; i++) {
        kmp_ref d =
            kmp_sub(graph, kmp_tree_number(&g->eq.tree, &scale.to[i]), kmp_tree_number(&g->eq.tree, &scale.from[i]));
        square = kmp_add(graph, square, kmp_mul(graph, d, d));
    }
    return scale.length > 0 ? kmp_sqrt(graph, square) : KMP_ONE;
}

/* The column of time, with which inputs of the model change. */
static bool add_time_of_equations(gather *g)
{
    kmp_graph *graph = g->eq.graph;
    int leaves = 0;
    g->leaf[leaves] = kmp_input(graph, KMP_IN_TIME, 0);
    g->direction[leaves++] = KMP_ONE;
    for (int k = 0; k < g->eq.model->input_count; k++)
        for (int d = 0; d + 1 < KMP_TIME_NUMBERS; d++) {
            g->leaf[leaves] = kmp_input(graph, KMP_IN_TIME, kmp_time_index(k, d));
            g->direction[leaves++] = kmp_input(graph, KMP_IN_TIME, kmp_time_index(k, d + 1));
        }
    return add_direction(g, leaves);
}

static bool add_equations(gather *g)
{
    int n = g->s->n, m = g->s->m;
    const kmp_start *start = &g->eq.model->start;
    g->of = KMP_ARENA_NEW(&g->arena, kmp_ref, 3 * m + 3 * n + 1);
    if (!g->of)
        return false;
    collect_sets(&g->eq, g->of);
    for (int i = 0; i < n; i++) {
        g->of[3 * m + n + i] = kmp_tree_number(&g->eq.tree, &start->q[i]);
        g->of[3 * m + 2 * n + i] = kmp_tree_number(&g->eq.tree, &start->qd[i]);
    }
    g->of[3 * m + 3 * n] = length(g);
    g->of_count = 3 * m + 3 * n + 1;
    return add_parameters(g) && (!g->s->timed || add_time_of_equations(g));
}

/* -- the outputs ------------------------------------------------------------------------------------- */

static const kmp_input_kind columns[] = {KMP_IN_TIME, KMP_IN_Q, KMP_IN_QD, KMP_IN_QDD, KMP_IN_LAMBDA};
enum { COLUMN_KINDS = sizeof columns / sizeof *columns };

static int size_of(const kmp_slopes *s, int kind)
{
    return columns[kind] == KMP_IN_TIME ? 1 : columns[kind] == KMP_IN_LAMBDA ? s->m : s->n;
}

static bool add_column(gather *g, kmp_partials *partials, kmp_ref leaf)
{
    const int *which;
    const kmp_ref *value;
    int count = kmp_partials_along(partials, leaf, &which, &value);
    for (int i = 0; i < count; i++)
        kmp_listing_put(&g->list, 0, which[i], g->x->columns, value[i]);
    end_column(g);
    return count >= 0;
}

/* Adds the derivatives along a leaf, times `by`, to `total`. */
static bool add_along(gather *g, kmp_partials *partials, kmp_ref leaf, kmp_ref by, kmp_ref *total)
{
    const int *which;
    const kmp_ref *value;
    int count = kmp_partials_along(partials, leaf, &which, &value);
    for (int i = 0; i < count; i++)
        total[which[i]] = kmp_add(g->eq.graph, total[which[i]], kmp_mul(g->eq.graph, value[i], by));
    return count >= 0;
}

/* The column of time, with which inputs of the model change. */
static bool add_time(gather *g, kmp_partials *partials)
{
    kmp_graph *graph = g->eq.graph;
    kmp_ref *total = KMP_ARENA_NEW(&g->arena, kmp_ref, g->of_count);
    for (int i = 0; total && i < g->of_count; i++)
        total[i] = KMP_ZERO;
    bool ok = total && add_along(g, partials, kmp_input(graph, KMP_IN_TIME, 0), KMP_ONE, total);
    for (int k = 0; k < g->eq.model->input_count; k++)
        for (int d = 0; ok && d + 1 < KMP_TIME_NUMBERS; d++) {
            kmp_ref rate = kmp_input(graph, KMP_IN_TIME, kmp_time_index(k, d + 1));
            ok = add_along(g, partials, kmp_input(graph, KMP_IN_TIME, kmp_time_index(k, d)), rate, total);
        }
    for (int i = 0; ok && i < g->of_count; i++)
        kmp_listing_put(&g->list, 0, i, g->x->columns, total[i]);
    end_column(g);
    return ok;
}

static bool add_state(gather *g)
{
    kmp_graph *graph = g->eq.graph;
    for (int c = 0; c < COLUMN_KINDS; c++)
        for (int k = 0; k < size_of(g->s, c); k++)
            (void)kmp_input(graph, columns[c], (uint32_t)k);
    for (int k = 0; k < KMP_TIME_NUMBERS * g->eq.model->input_count; k++)
        (void)kmp_input(graph, KMP_IN_TIME, (uint32_t)(1 + k));
    kmp_partials *partials = kmp_partials_new(graph, g->of_count, g->of);
    bool ok = partials && add_time(g, partials);
    for (int c = 1; c < COLUMN_KINDS; c++)
        for (int k = 0; ok && k < size_of(g->s, c); k++)
            ok = add_column(g, partials, kmp_input(graph, columns[c], (uint32_t)k));
    kmp_partials_free(partials);
    return ok;
}

/* The values come first. */
static bool add_values(gather *g)
{
    for (int i = 0; g->of && i < g->of_count; i++)
        (void)kmp_listing_add(&g->list, g->of[i]);
    return g->of && add_state(g) && add_parameters(g);
}

/* The friction that sticks, or the contact, of a row of the system; NULL: another closure. */
static const kmp_force *element_of_row(const kempe_system *s, int row)
{
    const kmp_closure *closure = &s->model->closures[s->rows[row].closure];
    return kmp_closure_is_of_modes(closure) ? &s->model->forces[closure->force] : NULL;
}

static int count_elements(const kempe_system *s, int from)
{
    int count = 0;
    for (int r = from; r < s->m; r++)
        count += element_of_row(s, r) != NULL;
    return count;
}

int kmp_slopes_force_of_modes(const kmp_slopes *slopes, int row)
{
    const kempe_system *s = slopes->system;
    return element_of_row(s, row) ? slopes->shown - count_elements(s, row) : -1;
}

/* The outputs of the model, then the forces of elements with modes, in the order of their rows: while friction slips
 * the multiplier of its row is zero, and so it is while the rows of others keep a contact closed. */
static bool add_outputs(gather *g)
{
    const kempe_system *s = g->s->system;
    const int elements = count_elements(s, 0);
    g->s->shown = g->of_count = g->eq.outputs.shown_count + elements;
    g->of = KMP_ARENA_NEW(&g->arena, kmp_ref, g->of_count);
    for (int i = 0; g->of && i < g->eq.outputs.shown_count; i++)
        g->of[i] = g->eq.outputs.shown[i];
    for (int r = 0, i = g->eq.outputs.shown_count; g->of && r < s->m && elements > 0; r++) {
        const kmp_force *force = element_of_row(s, r);
        if (force)
            g->of[i++] = kmp_modes_force(&g->eq.tree, &g->eq.model->forces[force - s->model->forces]);
    }
    return add_values(g);
}

static bool add_events(gather *g)
{
    g->of_count = g->s->system->events.count;
    g->of = KMP_ARENA_NEW(&g->arena, kmp_ref, g->of_count);
    for (int i = 0; g->of && i < g->of_count; i++)
        if (!g->s->system->events.condition[i].ends && !kmp_tree_event(&g->eq.tree, i, &g->of[i]))
            return false;
    return add_values(g);
}

/* In place, as a run evaluates them: conditions have the values of the state. */
static bool add_samples(gather *g)
{
    const kempe_model *model = g->eq.model;
    g->of = KMP_ARENA_NEW(&g->arena, kmp_ref, model->state_count);
    for (int k = 0; g->of && k < model->state_count; k++)
        if (model->states[k].next)
            g->of[g->of_count++] = kmp_tree_expression(&g->eq.tree, model->states[k].next);
    return add_values(g);
}

static int count_delays(const kempe_model *model)
{
    int count = 0;
    for (int k = 0; k < model->state_count; k++)
        count += model->states[k].delayed != NULL;
    return count;
}

/* Adds delayed signals as a run records them (integrators/run/delays.c): their conditions and branches of kinks are
 * taken from the run. */
static bool add_delayed(gather *g)
{
    const kempe_model *model = g->eq.model;
    kmp_tree now = g->eq.tree, early = g->eq.tree;
    const int count = count_delays(model);
    now.conditions.settled = now.conditions.kinks = true;
    early.conditions.events = NULL;
    g->of = KMP_ARENA_NEW(&g->arena, kmp_ref, 3 * count);
    for (int k = 0, i = 0; g->of && k < model->state_count; k++) {
        const kmp_state *state = &model->states[k];
        if (!state->delayed)
            continue;
        g->of[i] = kmp_tree_expression(&now, state->delayed);
        g->of[count + i] = state->before ? kmp_tree_expression(&early, state->before) : KMP_ZERO;
        g->of[2 * count + i++] = kmp_tree_number(&early, &state->delay);
    }
    g->of_count = 3 * count;
    return add_values(g);
}

/* -- programs ---------------------------------------------------------------------------------------- */

static bool make_machine(gather *g, const kmp_backend *backend)
{
    const kmp_listing *list = &g->list;
    kmp_slope_matrix *x = g->x;
    if (kmp_graph_failed(g->eq.graph) || list->failed)
        return false;
    x->count = list->count;
    x->rows = g->of_count;
    x->entry = list->entry;
    g->list.entry = NULL;
    return list->output_count == 0 || kmp_formulas_init(&x->formulas, g->eq.graph, list->output_count, list->output,
                                                        backend, g->s->system->parameters);
}

/* The equations of a system that has met all its conditions: none is added. `events` outlive them. */
static kempe_status derive_for_slopes(kmp_equations *eq, const kempe_system *system, kmp_events *events, unsigned sets)
{
    *events = system->events;
    const kmp_derivation_request scene = {
        .sets = sets, .scheme = KMP_SCHEME_COMPOSITE, .events = events, .charted = true, .friction_in_place = true};
    return kmp_equations_derive(eq, system->model, &scene);
}

static kempe_status derive(kmp_slopes *s, unsigned sets, bool (*add)(gather *g), kmp_slope_matrix *x, const int *named,
                           const kmp_backend *backend)
{
    gather g = {.s = s, .x = x, .named = named};
    const kmp_derivation_request in_place = {.sets = sets, .plain = true, .charted = true};
    kmp_events events;
    KMP_TRY(x == &s->samples ? kmp_equations_derive(&g.eq, s->system->model, &in_place)
                             : derive_for_slopes(&g.eq, s->system, &events, sets));
    int leaves = 1 + g.eq.model->parameter_count + KMP_TIME_NUMBERS * g.eq.model->input_count;
    int width = 1 + 3 * g.s->n + g.s->m + g.s->count;
    g.x->start = KMP_NEW(int, width + 1);
    g.leaf = KMP_ARENA_NEW(&g.arena, kmp_ref, leaves);
    g.direction = KMP_ARENA_NEW(&g.arena, kmp_ref, leaves);
    g.along = g.arena.failed ? NULL : kmp_derivative_new(g.eq.graph, 0, g.leaf, g.direction);
    bool ok = g.along && g.x->start && add(&g) && make_machine(&g, backend);
    kmp_derivative_free(g.along);
    kmp_arena_free(&g.arena);
    kmp_free(g.list.output);
    kmp_free(g.list.entry);
    kmp_equations_free(&g.eq);
    return ok ? KEMPE_OK : kmp_fail_memory(s->system->context);
}

/* -- construction ------------------------------------------------------------------------------------ */

const char *const kmp_derivative_ends[KMP_TIME_NUMBERS] = {"", ".d", ".dd"};

/* The index in KMP_IN_TIME of an input or of its derivative; 0: it is none. */
static int find_given(const kempe_model *m, const char *name)
{
    for (int k = 0; k < m->input_count; k++) {
        if (m->constants && m->constants[k] > 0) /* a parameter is in its place */
            continue;
        size_t length = strlen(m->inputs[k].name);
        for (int d = 0; strncmp(name, m->inputs[k].name, length) == 0 && d < KMP_TIME_NUMBERS; d++)
            if (strcmp(name + length, kmp_derivative_ends[d]) == 0)
                return (int)kmp_time_index(k, d);
    }
    return 0;
}

/* The numbers of the named parameters. KEMPE_E_ARGUMENT: a parameter that is not variable. */
static kempe_status find_parameters(const kempe_system *system, int count, const char *const *names, int *parameter)
{
    const kempe_model *m = system->model;
    for (int p = 0; p < count; p++) {
        int k = kmp_parameter_find(m, names[p]);
        if (k < 0 || !m->parameters[k].varies)
            return kmp_fail(system->context, KEMPE_E_ARGUMENT,
                            "parameter '%s' is not a variable parameter of the equations", names[p]);
        parameter[p] = k;
    }
    return KEMPE_OK;
}

/* Of parameters and inputs (leaf_of). */
static kempe_status find_names(const kempe_system *system, int count, const char *const *names, int *named)
{
    for (int p = 0; p < count; p++) {
        int given = find_given(system->model, names[p]);
        named[p] = -1 - given;
        if (!given)
            KMP_TRY(find_parameters(system, 1, names + p, named + p));
    }
    return KEMPE_OK;
}

static kempe_status fill(kmp_slopes *s, const char *backend, const char *const *names, bool with_outputs)
{
    kempe_context *c = s->system->context;
    const kmp_backend *found = kmp_backend_find(backend);
    if (!found)
        return kmp_fail(c, KEMPE_E_ARGUMENT, "unknown back end '%s'; available: %s", backend, kmp_backend_names());
    int *named = KMP_NEW(int, s->count);
    kempe_status status = named ? find_names(s->system, s->count, names, named) : kmp_fail_memory(c);
    if (status == KEMPE_OK && s->system->events.count > 0) /* all laws and rows: conditions of elements */
        status = derive(s, KMP_SET_CLOSURE | KMP_SET_ENERGY, add_events, &s->events, named, found);
    s->timed = s->system->switches;
    for (int k = 0; k < s->system->events.count && status == KEMPE_OK; k++)
        s->timed = s->timed || kmp_slopes_event_is_late(s, k);
    if (status == KEMPE_OK && s->count > 0)
        status = derive(s, SETS_OF_EQUATIONS, add_equations, &s->equations, named, found);
    if (status == KEMPE_OK && with_outputs)
        status = derive(s, KMP_SET_CLOSURE | KMP_SET_OUTPUT, add_outputs, &s->outputs, named, found);
    if (status == KEMPE_OK && count_delays(s->system->model) > 0)
        status = derive(s, KMP_SET_CLOSURE, add_delayed, &s->delayed, named, found);
    if (status == KEMPE_OK && kmp_model_has_samples(s->system->model))
        status = derive(s, KMP_SET_CLOSURE, add_samples, &s->samples, named, found);
    kmp_free(named);
    return status;
}

kempe_status kmp_slopes_new(const kempe_system *system, const char *backend, int count, const char *const *names,
                            bool with_outputs, kmp_slopes **slopes)
{
    KMP_MAKE(system->context, kmp_slopes, s);
    *s = (kmp_slopes){.system = system, .n = system->n, .m = system->m, .count = count};
    kempe_status status = fill(s, backend, names, with_outputs);
    return KMP_GIVE_OR_FREE(status, slopes, s, kmp_slopes_free);
}

static void free_matrix(kmp_slope_matrix *x)
{
    kmp_formulas_free(&x->formulas);
    kmp_free(x->entry);
    kmp_free(x->start);
}

void kmp_slopes_free(kmp_slopes *slopes)
{
    if (!slopes)
        return;
    free_matrix(&slopes->equations);
    free_matrix(&slopes->outputs);
    free_matrix(&slopes->events);
    free_matrix(&slopes->delayed);
    free_matrix(&slopes->samples);
    kmp_free(slopes);
}

void kmp_slopes_renew_parameters(kmp_slopes *slopes)
{
    kmp_slope_matrix *const of[] = {&slopes->equations, &slopes->outputs, &slopes->events, &slopes->delayed,
                                    &slopes->samples};
    for (size_t k = 0; k < sizeof of / sizeof *of; k++)
        if (of[k]->formulas.machine)
            kmp_formulas_renew(&of[k]->formulas, slopes->system->parameters);
}

/* -- numbers ----------------------------------------------------------------------------------------- */

const double *kmp_slopes_values(kmp_slope_matrix *of, const kmp_instant *at)
{
    if (of->formulas.machine)
        of->value = kmp_formulas_at(&of->formulas, at);
    return of->value;
}

void kmp_slopes_at(kmp_slopes *slopes, const kmp_instant *at)
{
    (void)kmp_slopes_values(&slopes->equations, at);
}

/* Rows first .. first + count - 1 of column k. */
static void take_rows(const kmp_slopes *s, int k, int first, int count, double *out)
{
    const kmp_slope_matrix *x = &s->equations;
    memset(out, 0, (size_t)count * sizeof *out);
    for (int e = x->start[k]; e < x->start[k + 1]; e++)
        if (x->entry[e].row >= first && x->entry[e].row < first + count)
            out[x->entry[e].row - first] = x->value[x->entry[e].source];
}

kmp_change kmp_slopes_change(const kmp_slopes *slopes, int k, double *room)
{
    int m = slopes->m;
    take_rows(slopes, k, 0, 3 * m + slopes->n, room);
    return (kmp_change){.h = room, .rate = room + m, .curve = room + 2 * m, .force = room + 3 * m};
}

double kmp_slopes_of_start(const kmp_slopes *slopes, int k, double *q, double *qd)
{
    int n = slopes->n, first = 3 * slopes->m + n;
    double length;
    take_rows(slopes, k, first, n, q);
    take_rows(slopes, k, first + n, n, qd);
    take_rows(slopes, k, first + 2 * n, 1, &length);
    return length;
}

void kmp_slopes_weighted(const kmp_slopes *slopes, const double *h, const double *rate, const double *curve,
                         const double *force, double *out)
{
    int m = slopes->m;
    const double *part[] = {h, rate, curve};
    for (int e = 0; e < slopes->equations.count; e++) {
        const kmp_tangent *x = &slopes->equations.entry[e];
        if (x->row >= 3 * m + slopes->n || x->col >= slopes->count)
            continue;
        const double *w = x->row < 3 * m ? part[x->row / m] : force;
        int i = x->row < 3 * m ? x->row % m : x->row - 3 * m;
        if (w && w[i] != 0) /* a value without weight may be none */
            out[x->col] += w[i] * slopes->equations.value[x->source];
    }
}

bool kmp_slopes_event_is_late(const kmp_slopes *slopes, int k)
{
    const kmp_slope_matrix *x = &slopes->events;
    const int first = 1 + 2 * slopes->n, end = first + slopes->n + slopes->m;
    bool late = false;
    for (int e = x->rows > 0 ? x->start[first] : 0; x->rows > 0 && e < x->start[end]; e++)
        late = late || x->entry[e].row == k;
    return late;
}

/* The part of a direction for each kind of columns, parameters last. */
static void parts_of(const kmp_direction *d, double *part[COLUMN_KINDS + 1])
{
    double *const all[] = {d->t, d->q, d->qd, d->qdd, d->lambda, d->parameters};
    memcpy(part, all, sizeof all);
}

static int part_size(const kmp_slopes *s, int part)
{
    return part < COLUMN_KINDS ? size_of(s, part) : s->count;
}

void kmp_slopes_along(const kmp_slopes *slopes, const kmp_slope_matrix *of, const kmp_direction *direction, int k,
                      double *out)
{
    double *part[COLUMN_KINDS + 1];
    parts_of(direction, part);
    memset(out, 0, (size_t)of->rows * sizeof *out);
    for (int c = 0, column = 0; of->rows > 0 && c <= COLUMN_KINDS; c++)
        for (int i = 0; i < part_size(slopes, c); i++, column++) {
            double by = part[c] ? part[c][i] : c == COLUMN_KINDS && i == k;
            for (int e = of->start[column]; by != 0 && e < of->start[column + 1]; e++)
                out[of->entry[e].row] += of->value[of->entry[e].source] * by;
        }
}

void kmp_slopes_gradient(const kmp_slopes *slopes, const kmp_slope_matrix *of, const double *w,
                         const kmp_direction *gradient)
{
    double *part[COLUMN_KINDS + 1];
    parts_of(gradient, part);
    for (int c = 0, column = 0; of->rows > 0 && c <= COLUMN_KINDS; c++)
        for (int k = 0; k < part_size(slopes, c); k++, column++)
            for (int e = of->start[column]; part[c] && e < of->start[column + 1]; e++)
                part[c][k] += of->value[of->entry[e].source] * w[of->entry[e].row];
}

/* -- second derivatives: forward differentiation twice, first along a and then along b ---------------------- */

/* Leaves and where each moves. */
typedef struct motion {
    kmp_ref *leaf, *direction;
    int count;
} motion;

static motion motion_of(kmp_arena *arena, int most)
{
    return (motion){KMP_ARENA_NEW(arena, kmp_ref, most), KMP_ARENA_NEW(arena, kmp_ref, most), 0};
}

/* Adds an input to the motion, with another input as its direction. */
static void move(motion *x, kmp_graph *g, kmp_input_kind kind, int index, int along)
{
    x->leaf[x->count] = kmp_input(g, kind, (uint32_t)index);
    x->direction[x->count++] = kmp_input(g, KMP_IN_ALONG, (uint32_t)along);
}

/* q, qd, qdd and lambda along inputs from `at` on. */
static void move_state(motion *x, const kmp_equations *eq, int at)
{
    static const kmp_input_kind kind[] = {KMP_IN_Q, KMP_IN_QD, KMP_IN_QDD, KMP_IN_LAMBDA};
    int n = eq->n;
    for (int k = 0; k < 3 * n + eq->m; k++)
        move(x, eq->graph, kind[k < 3 * n ? k / n : 3], k < 3 * n ? k % n : k - 3 * n, at + k);
}

/* -- the program ------------------------------------------------------------------------------------- */

static bool differentiate(const motion *x, kmp_graph *g, int count, kmp_ref *of)
{
    kmp_derivative *d = kmp_derivative_new(g, x->count, x->leaf, x->direction);
    for (int k = 0; d && k < count; k++)
        of[k] = kmp_derivative_of(d, of[k]);
    kmp_derivative_free(d);
    return d && !kmp_graph_failed(g);
}

/* Parameters go along b as given, and with them the dependent ones. */
static bool derive_twice(kmp_second_derivatives *second, const kmp_equations *eq, const kmp_backend *backend,
                         const int *parameter, const double *values)
{
    int state = 3 * eq->n + eq->m, count = eq->n + 3 * eq->m;
    kmp_arena arena = {0};
    kmp_ref *of = KMP_ARENA_NEW(&arena, kmp_ref, count);
    motion a = motion_of(&arena, state), b = motion_of(&arena, state + eq->model->parameter_count);
    bool ok = !arena.failed;
    if (ok) {
        collect_sets(eq, of);
        move_state(&a, eq, 0);
        move_state(&b, eq, state);
        for (int i = 0; i < second->count; i++)
            move(&b, eq->graph, KMP_IN_PARAMETER, parameter[i], 2 * state + i);
        b.count = lead_parameters(&eq->tree, b.count, b.leaf, b.direction);
        ok = b.count >= 0 && differentiate(&a, eq->graph, count, of) && differentiate(&b, eq->graph, count, of) &&
             kmp_formulas_init(&second->bent, eq->graph, count, of, backend, values);
    }
    kmp_arena_free(&arena);
    return ok;
}

static kempe_status derive_all(kmp_second_derivatives *second, const kempe_system *system, const kmp_backend *backend,
                               const int *parameter)
{
    kmp_equations eq;
    kmp_events events;
    KMP_TRY(derive_for_slopes(&eq, system, &events, SETS_OF_EQUATIONS));
    bool ok = derive_twice(second, &eq, backend, parameter, system->parameters);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(system->context);
}

kempe_status kmp_second_derivatives_init(kmp_second_derivatives *second, const kempe_system *system,
                                         const kmp_backend *backend, int count, const char *const *names)
{
    *second = (kmp_second_derivatives){.n = system->n, .m = system->m, .count = count};
    if (system->force)
        return kmp_fail(
            system->context, KEMPE_E_FAILED,
            "second derivatives are required, but a user-defined force has none: define it as a force of the model");
    int *parameter = KMP_NEW(int, count);
    second->along = KMP_NEW(double, 2 * (3 * system->n + system->m) + count);
    kempe_status status = parameter && second->along ? find_parameters(system, count, names, parameter)
                                                     : kmp_fail_memory(system->context);
    if (status == KEMPE_OK)
        status = derive_all(second, system, backend, parameter);
    kmp_free(parameter);
    if (status != KEMPE_OK)
        kmp_second_derivatives_free(second);
    return status;
}

KMP_CLEARS(kmp_second_derivatives, second, kmp_formulas_free(&second->bent), kmp_free(second->along))

/* -- numbers ----------------------------------------------------------------------------------------- */

static double *put(double *to, int count, const double *from)
{
    kmp_copy_or_zero(count, from, to);
    return to + count;
}

kmp_second_values kmp_second_derivatives_along(kmp_second_derivatives *second, const kmp_variation *a,
                                               const kmp_variation *b, const double *parameter)
{
    const kmp_variation *course[] = {a, b};
    double *to = second->along;
    for (int k = 0; k < 2; k++) {
        to = put(to, second->n, course[k]->q);
        to = put(to, second->n, course[k]->qd);
        to = put(to, second->n, course[k]->qdd);
        to = put(to, second->m, course[k]->lambda);
    }
    (void)put(to, second->count, parameter);
    kmp_machine_set(second->bent.machine, KMP_IN_ALONG, second->along);
    const double *out = kmp_machine_run(second->bent.machine, 1);
    int m = second->m;
    return (kmp_second_values){out + 3 * m, out, out + m, out + 2 * m};
}

/* -- weighted sums: differentiation back from the sum ---------------------------------------------------------- */

/* The weighted sum, whose weights are the inputs from `first` on. */
static kmp_ref weighted_sum(const kmp_equations *eq, int first, int count, const kmp_ref *of)
{
    kmp_ref sum = KMP_ZERO;
    for (int k = 0; k < count; k++)
        sum = kmp_add(eq->graph, sum,
                      kmp_mul(eq->graph, kmp_input(eq->graph, KMP_IN_ALONG, (uint32_t)(first + k)), of[k]));
    return sum;
}

/* The derivatives of a sum by all leaves: the `count` named inputs and the dependent parameters, which go back, the
 * last one first, to the parameters in their expressions. */
static void differentiate_back(const kmp_tree *tree, kmp_ref sum, int count, const kmp_ref *leaf, kmp_ref *slope,
                               kmp_ref *part)
{
    const kempe_model *m = tree->model;
    kmp_graph *graph = tree->graph;
    kmp_gradient_backward(graph, sum, count + m->led_count, leaf, slope);
    for (int i = m->led_count - 1; i >= 0; i--) {
        const kmp_ref by = slope[count + i];
        if (by == KMP_ZERO)
            continue;
        kmp_gradient_backward(graph, kmp_tree_expression(tree, m->parameters[m->led[i]].number.expr), count + i, leaf,
                              part);
        for (int k = 0; k < count + i; k++)
            slope[k] = kmp_add(graph, slope[k], kmp_mul(graph, by, part[k]));
    }
}

static bool derive_sum(kmp_slopes_sum *sum, const kmp_equations *eq, int count, const int *named,
                       const kmp_backend *backend, const double *values)
{
    const kempe_model *m = eq->model;
    const int rows = 3 * eq->m + eq->n, leaves = count + m->led_count;
    kmp_arena arena = {0};
    kmp_ref *of, *leaf, *slope, *part;
    bool ok = KMP_ARENA_MAKE(&arena, KMP_ROOM(kmp_ref, rows, &of), KMP_ROOM(kmp_ref, leaves, &leaf, &slope, &part));
    if (ok) {
        collect_sets(eq, of);
        for (int k = 0; k < count; k++)
            leaf[k] = leaf_of(eq->graph, named[k]);
        for (int i = 0; i < m->led_count; i++)
            leaf[count + i] = kmp_input(eq->graph, KMP_IN_PARAMETER, (uint32_t)m->led[i]);
        differentiate_back(&eq->tree, weighted_sum(eq, 0, rows, of), count, leaf, slope, part);
        for (int k = 0; k < count; k++)
            if (slope[k] != KMP_ZERO) {
                slope[sum->count] = slope[k];
                sum->parameter[sum->count++] = k;
            }
        ok = sum->count == 0 || kmp_formulas_init(&sum->formulas, eq->graph, sum->count, slope, backend, values);
    }
    kmp_arena_free(&arena);
    return ok;
}

kempe_status kmp_slopes_sum_init(kmp_slopes_sum *sum, const kempe_system *system, const kmp_backend *backend, int count,
                                 const char *const *names)
{
    kmp_equations eq;
    kmp_events events;
    *sum = (kmp_slopes_sum){.n = system->n, .m = system->m};
    sum->weight = KMP_NEW(double, 3 * system->m + system->n);
    sum->parameter = KMP_NEW(int, count);
    int *named = KMP_NEW(int, count);
    kempe_status status =
        named && sum->weight && sum->parameter ? find_names(system, count, names, named) : KEMPE_E_MEMORY;
    if (status == KEMPE_OK)
        status = derive_for_slopes(&eq, system, &events, SETS_OF_EQUATIONS);
    if (status == KEMPE_OK) {
        status = derive_sum(sum, &eq, count, named, backend, system->parameters) ? KEMPE_OK : KEMPE_E_MEMORY;
        kmp_equations_free(&eq);
    }
    kmp_free(named);
    if (status != KEMPE_OK)
        kmp_slopes_sum_free(sum);
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(system->context) : status;
}

KMP_CLEARS(kmp_slopes_sum, sum, kmp_formulas_free(&sum->formulas), kmp_free(sum->weight), kmp_free(sum->parameter))

const double *kmp_slopes_sum_at(kmp_slopes_sum *sum, const kmp_instant *at)
{
    if (sum->count == 0)
        return sum->weight;
    kmp_formulas_place(&sum->formulas, at);
    kmp_machine_set(sum->formulas.machine, KMP_IN_ALONG, sum->weight);
    return kmp_machine_run(sum->formulas.machine, 1);
}

/* -- second derivatives of a weighted sum: back from the sum, then forward ------------------------------------- */

static bool derive_curvature(kmp_curvature *c, const kmp_equations *eq, const kmp_backend *backend,
                             const double *values)
{
    const int state = 3 * eq->n + eq->m, equations = eq->n + 3 * eq->m, count = equations + c->shown;
    kmp_arena arena = {0};
    kmp_ref *of, *slope, *change;
    motion a = motion_of(&arena, state);
    bool ok = KMP_ARENA_MAKE(&arena, KMP_ROOM(kmp_ref, count, &of), KMP_ROOM(kmp_ref, state, &slope, &change));
    if (ok) {
        collect_sets(eq, of);
        for (int k = 0; k < c->shown; k++)
            of[equations + k] = eq->outputs.shown[k];
        move_state(&a, eq, 0);
        kmp_gradient_backward(eq->graph, weighted_sum(eq, state, count, of), state, a.leaf, slope);
        memcpy(change, slope, (size_t)state * sizeof *change);
        ok = differentiate(&a, eq->graph, state, change);
    }
    if (ok)
        c->formulas.program =
            kmp_program_new(eq->graph, 2, (const int[]){state, state}, (const kmp_ref *const[]){slope, change});
    ok = ok && kmp_formulas_prepare(&c->formulas, backend, values);
    kmp_arena_free(&arena);
    return ok;
}

kempe_status kmp_curvature_init(kmp_curvature *curvature, const kempe_system *system, const kmp_backend *backend,
                                bool with_outputs)
{
    kmp_equations eq;
    kmp_events events;
    const unsigned sets = SETS_OF_EQUATIONS | (with_outputs ? KMP_SET_OUTPUT : 0u);
    const int state = 3 * system->n + system->m;
    *curvature = (kmp_curvature){.n = system->n, .m = system->m};
    KMP_TRY(derive_for_slopes(&eq, system, &events, sets));
    curvature->shown = with_outputs ? eq.outputs.shown_count : 0;
    curvature->given = KMP_NEW(double, state + system->n + 3 * system->m + curvature->shown);
    curvature->weight = curvature->given ? curvature->given + state : NULL;
    const bool ok = curvature->given && derive_curvature(curvature, &eq, backend, system->parameters);
    kmp_equations_free(&eq);
    if (ok)
        return KEMPE_OK;
    kmp_curvature_free(curvature);
    return kmp_fail_memory(system->context);
}

KMP_CLEARS(kmp_curvature, curvature, kmp_formulas_free(&curvature->formulas), kmp_free(curvature->given))

void kmp_curvature_at(kmp_curvature *curvature, const kmp_instant *at)
{
    kmp_formulas_place(&curvature->formulas, at);
    kmp_machine_set(curvature->formulas.machine, KMP_IN_ALONG, curvature->given);
    (void)kmp_machine_run(curvature->formulas.machine, 1);
}

const double *kmp_curvature_along(kmp_curvature *curvature, const double *direction)
{
    memcpy(curvature->given, direction, (size_t)(3 * curvature->n + curvature->m) * sizeof *direction);
    kmp_machine_set(curvature->formulas.machine, KMP_IN_ALONG, curvature->given);
    return kmp_machine_run(curvature->formulas.machine, 2);
}
