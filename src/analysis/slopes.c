/* SPDX-License-Identifier: BSD-3-Clause */
/* The parameters are inputs of the graph; those that follow from others are inputs of their own, along with which the
 * direction of a named one moves: d(follower) = its expression, differentiated. */
#include "analysis/slopes.h"
#include "base/memory.h"
#include "dynamics/equations.h"
#include "symbolic/derivative.h"
#include "symbolic/partials.h"
#include <string.h>

enum { OF_EQUATIONS, OF_OUTPUTS, OF_EVENTS, PROGRAMS };

/* -- entries ----------------------------------------------------------------------------------------- */

/* Expressions of one program while its entries are found. */
typedef struct gather {
    kmp_slopes *s;
    kmp_equations eq;
    kmp_derivative *along;     /* of one parameter after the other */
    kmp_ref *leaf, *direction; /* room for all parameters */
    const int *named;          /* which parameters the names are */
    kmp_ref *of;               /* what is differentiated */
    int of_count;
    kmp_ref *output;
    int output_count, output_room;
} gather;

static void *grown(void *list, int count, int *room, size_t size)
{
    if (count < *room)
        return list;
    int wanted = 2 * count + 64;
    void *larger = kmp_realloc(list, (size_t)wanted, size);
    if (larger)
        *room = wanted;
    return larger;
}

static bool add_output(gather *g, kmp_ref r)
{
    kmp_ref *output = grown(g->output, g->output_count, &g->output_room, sizeof *output);
    if (!output)
        return false;
    g->output = output;
    g->output[g->output_count++] = r;
    return true;
}

static bool add_entry(gather *g, kmp_slope_matrix *x, int row, kmp_ref r)
{
    if (r == KMP_ZERO)
        return true;
    kmp_slope *entry = grown(x->entry, x->count, &x->room, sizeof *entry);
    if (!entry || !add_output(g, r)) {
        x->entry = entry ? entry : x->entry;
        return false;
    }
    x->entry = entry;
    x->entry[x->count++] = (kmp_slope){row, x->columns, g->output_count - 1};
    return true;
}

static bool begin_matrix(kmp_slope_matrix *x, int most_columns)
{
    x->start = KMP_NEW(int, most_columns + 1);
    return x->start;
}

static void end_column(kmp_slope_matrix *x)
{
    x->start[++x->columns] = x->count;
}

/* -- directions of parameters ------------------------------------------------------------------------ */

static int leaf_of(const gather *g, int count, int parameter)
{
    for (int k = 0; k < count; k++)
        if (g->leaf[k] == kmp_input(g->eq.graph, KMP_IN_PARAMETER, (uint32_t)parameter))
            return k;
    return -1;
}

static bool is_known(const gather *g, const kmp_expr *e, int count, int from)
{
    const kempe_model *m = g->eq.model;
    if (!e)
        return true;
    if (e->kind == KMP_EXPR_PARAMETER)
        return e->index == from || !m->parameters[e->index].varies || !m->parameters[e->index].number.expr ||
               leaf_of(g, count, e->index) >= 0;
    return is_known(g, e->a, count, from) && is_known(g, e->b, count, from) && is_known(g, e->c, count, from);
}

/* The parameters that follow from others, each behind those that it needs, with how they move. A named one follows from
 * nothing (model/variant.h). How many leaves there are; -1: no memory. */
static int lead_on(gather *g, int from)
{
    const kempe_model *m = g->eq.model;
    int count = 0;
    g->leaf[count] = kmp_input(g->eq.graph, KMP_IN_PARAMETER, (uint32_t)from);
    g->direction[count++] = KMP_ONE;
    for (bool grew = true; grew;) {
        grew = false;
        for (int k = 0; k < m->parameter_count; k++) {
            const kmp_expr *e = m->parameters[k].number.expr;
            if (k == from || !e || !m->parameters[k].varies || leaf_of(g, count, k) >= 0 ||
                !is_known(g, e, count, from))
                continue;
            kmp_ref value = kmp_tree_expression(&g->eq.tree, e);
            if (!kmp_derivative_restart(g->along, count, g->leaf, g->direction))
                return -1;
            kmp_ref slope = kmp_derivative_of(g->along, value);
            g->leaf[count] = kmp_input(g->eq.graph, KMP_IN_PARAMETER, (uint32_t)k);
            g->direction[count++] = slope;
            grew = true;
        }
    }
    return count;
}

/* A column for each parameter. */
static bool add_parameters(gather *g, kmp_slope_matrix *x)
{
    bool ok = true;
    for (int p = 0; ok && p < g->s->count; p++) {
        int leaves = lead_on(g, g->named[p]);
        ok = leaves > 0 && kmp_derivative_restart(g->along, leaves, g->leaf, g->direction);
        for (int i = 0; ok && i < g->of_count; i++)
            ok = add_entry(g, x, i, kmp_derivative_of(g->along, g->of[i]));
        if (ok)
            end_column(x);
    }
    return ok;
}

/* -- the equations ----------------------------------------------------------------------------------- */

/* J qdd + jdqd */
static kmp_ref curve(const kmp_equations *eq, int row)
{
    kmp_ref sum = eq->jdqd[row];
    for (int k = 0; k < eq->n; k++) {
        kmp_ref qdd = kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k);
        sum = kmp_add(eq->graph, sum, kmp_mul(eq->graph, eq->jacobian[row * eq->n + k], qdd));
    }
    return sum;
}

/* The characteristic length: of the lever that is the longest with the values at hand. */
static kmp_ref length(const gather *g)
{
    kmp_graph *graph = g->eq.graph;
    const kmp_lever lever = kmp_system_lever(g->eq.model);
    kmp_ref square = KMP_ZERO;
    for (int i = 0; i < 3; i++) {
        kmp_ref d =
            kmp_sub(graph, kmp_tree_number(&g->eq.tree, &lever.to[i]), kmp_tree_number(&g->eq.tree, &lever.from[i]));
        square = kmp_add(graph, square, kmp_mul(graph, d, d));
    }
    return lever.length > 0 ? kmp_sqrt(graph, square) : KMP_ONE;
}

static bool add_equations(gather *g)
{
    int n = g->s->n, m = g->s->m;
    const kmp_start *start = &g->eq.model->start;
    g->of = KMP_NEW(kmp_ref, 3 * m + 3 * n + 1);
    if (!g->of || !begin_matrix(&g->s->equations, g->s->count))
        return false;
    for (int i = 0; i < m; i++) {
        g->of[i] = g->eq.h[i];
        g->of[m + i] = g->eq.hdot[i];
        g->of[2 * m + i] = curve(&g->eq, i);
    }
    memcpy(g->of + 3 * m, g->eq.residual, (size_t)n * sizeof *g->of);
    for (int i = 0; i < n; i++) {
        g->of[3 * m + n + i] = kmp_tree_number(&g->eq.tree, &start->q[i]);
        g->of[3 * m + 2 * n + i] = kmp_tree_number(&g->eq.tree, &start->qd[i]);
    }
    g->of[3 * m + 3 * n] = length(g);
    g->of_count = 3 * m + 3 * n + 1;
    return add_parameters(g, &g->s->equations);
}

/* -- the outputs ------------------------------------------------------------------------------------- */

static const kmp_input_kind columns[] = {KMP_IN_TIME, KMP_IN_Q, KMP_IN_QD, KMP_IN_QDD, KMP_IN_LAMBDA};
enum { COLUMN_KINDS = sizeof columns / sizeof *columns };

static int size_of(const kmp_slopes *s, int kind)
{
    return columns[kind] == KMP_IN_TIME ? 1 : columns[kind] == KMP_IN_LAMBDA ? s->m : s->n;
}

static bool add_column(gather *g, kmp_slope_matrix *x, kmp_partials *partials, kmp_ref leaf)
{
    const int *which;
    const kmp_ref *value;
    int count = kmp_partials_along(partials, leaf, &which, &value);
    bool ok = count >= 0;
    for (int i = 0; ok && i < count; i++)
        ok = add_entry(g, x, which[i], value[i]);
    if (ok)
        end_column(x);
    return ok;
}

static bool add_state(gather *g, kmp_slope_matrix *x)
{
    kmp_graph *graph = g->eq.graph;
    for (int c = 0; c < COLUMN_KINDS; c++)
        for (int k = 0; k < size_of(g->s, c); k++)
            (void)kmp_input(graph, columns[c], (uint32_t)k);
    kmp_partials *partials = kmp_partials_new(graph, g->of_count, g->of);
    bool ok = partials;
    for (int c = 0; c < COLUMN_KINDS; c++)
        for (int k = 0; ok && k < size_of(g->s, c); k++)
            ok = add_column(g, x, partials, kmp_input(graph, columns[c], (uint32_t)k));
    kmp_partials_free(partials);
    return ok;
}

/* The values come first. */
static bool add_values(gather *g, kmp_slope_matrix *x)
{
    bool ok = g->of && begin_matrix(x, 1 + 3 * g->s->n + g->s->m + g->s->count);
    for (int i = 0; ok && i < g->of_count; i++)
        ok = add_output(g, g->of[i]);
    return ok && add_state(g, x) && add_parameters(g, x);
}

static bool add_outputs(gather *g)
{
    g->s->shown = g->of_count = g->eq.shown_count;
    g->of = KMP_NEW(kmp_ref, g->of_count);
    for (int i = 0; g->of && i < g->of_count; i++)
        g->of[i] = g->eq.shown[i];
    return add_values(g, &g->s->outputs);
}

static bool add_events(gather *g)
{
    g->of_count = g->s->system->events.count;
    g->of = KMP_NEW(kmp_ref, g->of_count);
    for (int i = 0; g->of && i < g->of_count; i++)
        if (!g->s->system->events.condition[i].ends && !kmp_tree_event(&g->eq.tree, i, &g->of[i]))
            return false;
    return add_values(g, &g->s->events);
}

/* -- programs ---------------------------------------------------------------------------------------- */

static bool make_machine(gather *g, int which, const kmp_backend *backend)
{
    kmp_slopes *s = g->s;
    const kmp_ref *output = g->output;
    if (kmp_graph_failed(g->eq.graph))
        return false;
    if (g->output_count == 0)
        return true;
    s->program[which] = kmp_program_new(g->eq.graph, 1, &g->output_count, &output);
    s->machine[which] = s->program[which] ? kmp_machine_new(s->program[which], backend) : NULL;
    return s->machine[which];
}

static bool make_room(gather *g)
{
    int parameters = g->eq.model->parameter_count;
    g->leaf = KMP_NEW(kmp_ref, parameters + 1);
    g->direction = KMP_NEW(kmp_ref, parameters + 1);
    g->along = kmp_derivative_new(g->eq.graph, 0, g->leaf, g->direction);
    return g->leaf && g->direction && g->along;
}

static void clear(gather *g)
{
    kmp_derivative_free(g->along);
    kmp_free(g->leaf);
    kmp_free(g->direction);
    kmp_free(g->of);
    kmp_free(g->output);
}

static const struct {
    unsigned sets;
    bool (*add)(gather *g);
} parts[PROGRAMS] = {
    [OF_EQUATIONS] = {KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL, add_equations},
    [OF_OUTPUTS] = {KMP_SET_CLOSURE | KMP_SET_OUTPUT, add_outputs},
    [OF_EVENTS] = {KMP_SET_CLOSURE | KMP_SET_ENERGY, add_events}, /* all laws and rows: conditions of elements */
};

static kempe_status derive(kmp_slopes *s, int which, const int *named, const kmp_backend *backend)
{
    gather g = {.s = s, .named = named};
    kmp_events events = s->system->events; /* the system has met all conditions: none is added */
    const kmp_scene scene = {
        .sets = parts[which].sets, .scheme = KMP_SCHEME_COMPOSITE, .events = &events, .charted = true};
    kempe_status status = kmp_equations_derive(&g.eq, s->system->model, &scene);
    if (status != KEMPE_OK)
        return status;
    bool ok = make_room(&g) && parts[which].add(&g) && make_machine(&g, which, backend);
    clear(&g);
    kmp_equations_free(&g.eq);
    return ok ? KEMPE_OK : kmp_fail_memory(s->system->context);
}

/* -- making one -------------------------------------------------------------------------------------- */

static kempe_status find_names(const kempe_system *system, int count, const char *const *names, int *named)
{
    const kempe_model *m = system->model;
    for (int p = 0; p < count; p++) {
        named[p] = -1;
        for (int k = 0; named[p] < 0 && k < m->parameter_count; k++)
            if (m->parameters[k].varies && strcmp(m->parameters[k].name, names[p]) == 0)
                named[p] = k;
        if (named[p] < 0)
            return kmp_fail(system->context, KEMPE_E_ARGUMENT,
                            "parameter '%s' is not among those that the equations keep open", names[p]);
    }
    return KEMPE_OK;
}

static kempe_status fill(kmp_slopes *s, const char *backend, const char *const *names, bool with_outputs)
{
    kempe_context *c = s->system->context;
    const kmp_backend *found = kmp_backend_find(backend);
    if (!found)
        return kmp_fail(c, KEMPE_E_ARGUMENT, "there is no back end '%s': there are %s", backend, kmp_backend_names());
    int *named = KMP_NEW(int, s->count);
    kempe_status status = named ? find_names(s->system, s->count, names, named) : kmp_fail_memory(c);
    if (status == KEMPE_OK)
        status = derive(s, OF_EQUATIONS, named, found);
    if (status == KEMPE_OK && with_outputs)
        status = derive(s, OF_OUTPUTS, named, found);
    if (status == KEMPE_OK && s->system->events.count > 0)
        status = derive(s, OF_EVENTS, named, found);
    kmp_free(named);
    return status;
}

kempe_status kmp_slopes_new(const kempe_system *system, const char *backend, int count, const char *const *names,
                            bool with_outputs, kmp_slopes **slopes)
{
    kmp_slopes *s = KMP_NEW(kmp_slopes, 1);
    if (!s)
        return kmp_fail_memory(system->context);
    *s = (kmp_slopes){.system = system, .n = system->n, .m = system->m, .count = count};
    kempe_status status = fill(s, backend, names, with_outputs);
    if (status != KEMPE_OK) {
        kmp_slopes_free(s);
        return status;
    }
    kmp_slopes_renew_parameters(s);
    *slopes = s;
    return KEMPE_OK;
}

static void free_matrix(kmp_slope_matrix *x)
{
    kmp_free(x->entry);
    kmp_free(x->start);
}

void kmp_slopes_free(kmp_slopes *slopes)
{
    if (!slopes)
        return;
    for (int k = 0; k < PROGRAMS; k++) {
        kmp_machine_free(slopes->machine[k]);
        kmp_program_free(slopes->program[k]);
    }
    free_matrix(&slopes->equations);
    free_matrix(&slopes->outputs);
    free_matrix(&slopes->events);
    kmp_free(slopes);
}

void kmp_slopes_renew_parameters(kmp_slopes *slopes)
{
    for (int k = 0; k < PROGRAMS; k++) {
        if (slopes->machine[k])
            kmp_machine_set(slopes->machine[k], KMP_IN_PARAMETER, slopes->system->parameters);
        slopes->charts[k] = -1; /* stage 0 runs when the charts are known */
    }
}

/* -- numbers ----------------------------------------------------------------------------------------- */

static void run(kmp_slopes *s, int which, const kmp_instant *at)
{
    kmp_machine *machine = s->machine[which];
    if (!machine)
        return;
    if (s->charts[which] != at->chart_version) {
        kmp_machine_set(machine, KMP_IN_CHART, at->chart);
        (void)kmp_machine_run(machine, 0);
        s->charts[which] = at->chart_version;
    }
    kmp_machine_set(machine, KMP_IN_TIME, &at->t);
    kmp_machine_set(machine, KMP_IN_Q, at->q);
    kmp_machine_set(machine, KMP_IN_QD, at->qd);
    kmp_machine_set(machine, KMP_IN_QDD, at->qdd);
    kmp_machine_set(machine, KMP_IN_LAMBDA, at->lambda);
    if (at->mode)
        kmp_machine_set(machine, KMP_IN_MODE, at->mode);
    s->value[which] = kmp_machine_run(machine, 1);
}

void kmp_slopes_at(kmp_slopes *slopes, const kmp_instant *at)
{
    run(slopes, OF_EQUATIONS, at);
}

void kmp_slopes_of_parameter(const kmp_slopes *slopes, int k, double *h, double *rate, double *curve, double *force)
{
    int n = slopes->n, m = slopes->m;
    const kmp_slope_matrix *x = &slopes->equations;
    double *part[] = {h, rate, curve};
    for (int i = 0; i < 3; i++)
        memset(part[i], 0, (size_t)m * sizeof(double));
    memset(force, 0, (size_t)n * sizeof *force);
    for (int e = x->start[k]; e < x->start[k + 1]; e++) {
        int row = x->entry[e].row;
        double value = slopes->value[OF_EQUATIONS][x->entry[e].source];
        if (row < 3 * m)
            part[row / m][row % m] = value;
        else if (row < 3 * m + n)
            force[row - 3 * m] = value;
    }
}

void kmp_slopes_of_start(const kmp_slopes *slopes, int k, double *q, double *qd)
{
    int n = slopes->n, first = 3 * slopes->m + n;
    const kmp_slope_matrix *x = &slopes->equations;
    memset(q, 0, (size_t)n * sizeof *q);
    memset(qd, 0, (size_t)n * sizeof *qd);
    for (int e = x->start[k]; e < x->start[k + 1]; e++) {
        int i = x->entry[e].row - first;
        if (i >= 0 && i < 2 * n)
            (i < n ? q : qd)[i % n] = slopes->value[OF_EQUATIONS][x->entry[e].source];
    }
}

double kmp_slopes_of_length(const kmp_slopes *slopes, int k)
{
    const kmp_slope_matrix *x = &slopes->equations;
    for (int e = x->start[k]; e < x->start[k + 1]; e++)
        if (x->entry[e].row == 3 * slopes->m + 3 * slopes->n)
            return slopes->value[OF_EQUATIONS][x->entry[e].source];
    return 0;
}

void kmp_slopes_weighted(const kmp_slopes *slopes, const double *h, const double *rate, const double *curve,
                         const double *force, double *out)
{
    int m = slopes->m;
    const double *part[] = {h, rate, curve};
    for (int e = 0; e < slopes->equations.count; e++) {
        const kmp_slope *x = &slopes->equations.entry[e];
        if (x->row >= 3 * m + slopes->n)
            continue;
        const double *w = x->row < 3 * m ? part[x->row / m] : force;
        int i = x->row < 3 * m ? x->row % m : x->row - 3 * m;
        out[x->col] += w ? w[i] * slopes->value[OF_EQUATIONS][x->source] : 0;
    }
}

const double *kmp_slopes_outputs(kmp_slopes *slopes, const kmp_instant *at)
{
    run(slopes, OF_OUTPUTS, at);
    return slopes->value[OF_OUTPUTS];
}

/* A part of a direction for each kind of columns, parameters behind them. */
static void parts_of(const kmp_direction *d, double *part[COLUMN_KINDS + 1])
{
    double *const all[] = {d->t, d->q, d->qd, d->qdd, d->lambda, d->parameters};
    memcpy(part, all, sizeof all);
}

static int part_size(const kmp_slopes *s, int part)
{
    return part < COLUMN_KINDS ? size_of(s, part) : s->count;
}

static void add_along(const kmp_slopes *s, const kmp_slope_matrix *x, const double *value,
                      const kmp_direction *direction, double *out)
{
    double *part[COLUMN_KINDS + 1];
    parts_of(direction, part);
    for (int c = 0, column = 0; c <= COLUMN_KINDS; c++)
        for (int k = 0; k < part_size(s, c); k++, column++)
            for (int e = x->start[column]; part[c] && e < x->start[column + 1]; e++)
                out[x->entry[e].row] += value[x->entry[e].source] * part[c][k];
}

static void add_gradient(const kmp_slopes *s, const kmp_slope_matrix *x, const double *value, const double *w,
                         const kmp_direction *gradient)
{
    double *part[COLUMN_KINDS + 1];
    parts_of(gradient, part);
    for (int c = 0, column = 0; c <= COLUMN_KINDS; c++)
        for (int k = 0; k < part_size(s, c); k++, column++)
            for (int e = x->start[column]; part[c] && e < x->start[column + 1]; e++)
                part[c][k] += value[x->entry[e].source] * w[x->entry[e].row];
}

void kmp_slopes_outputs_along(const kmp_slopes *slopes, const kmp_direction *direction, double *out)
{
    memset(out, 0, (size_t)slopes->shown * sizeof *out);
    add_along(slopes, &slopes->outputs, slopes->value[OF_OUTPUTS], direction, out);
}

void kmp_slopes_outputs_gradient(const kmp_slopes *slopes, const double *w, const kmp_direction *gradient)
{
    add_gradient(slopes, &slopes->outputs, slopes->value[OF_OUTPUTS], w, gradient);
}

const double *kmp_slopes_events(kmp_slopes *slopes, const kmp_instant *at)
{
    run(slopes, OF_EVENTS, at);
    return slopes->value[OF_EVENTS];
}

void kmp_slopes_events_along(const kmp_slopes *slopes, const kmp_direction *direction, double *out)
{
    memset(out, 0, (size_t)slopes->system->events.count * sizeof *out);
    add_along(slopes, &slopes->events, slopes->value[OF_EVENTS], direction, out);
}

void kmp_slopes_events_gradient(const kmp_slopes *slopes, const double *w, const kmp_direction *gradient)
{
    add_gradient(slopes, &slopes->events, slopes->value[OF_EVENTS], w, gradient);
}
