/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/bend.h"
#include "base/memory.h"
#include "symbolic/derivative.h"
#include <string.h>

/* Leaves and where each moves. */
typedef struct motion {
    kmp_graph *g;
    kmp_ref *leaf, *direction;
    int count;
} motion;

static bool begin(motion *x, kmp_graph *g, int most)
{
    *x = (motion){.g = g, .leaf = KMP_NEW(kmp_ref, most), .direction = KMP_NEW(kmp_ref, most)};
    return x->leaf && x->direction;
}

static void end(motion *x)
{
    kmp_free(x->leaf);
    kmp_free(x->direction);
}

static void move(motion *x, kmp_input_kind kind, int index, kmp_ref direction)
{
    x->leaf[x->count] = kmp_input(x->g, kind, (uint32_t)index);
    x->direction[x->count++] = direction;
}

/* q, qd, qdd and lambda along inputs from `at` on. */
static void move_state(motion *x, int n, int m, int at)
{
    static const kmp_input_kind kind[] = {KMP_IN_Q, KMP_IN_QD, KMP_IN_QDD, KMP_IN_LAMBDA};
    for (int k = 0; k < 3 * n + m; k++)
        move(x, kind[k < 3 * n ? k / n : 3], k < 3 * n ? k % n : k - 3 * n,
             kmp_input(x->g, KMP_IN_ALONG, (uint32_t)(at + k)));
}

/* -- parameters -------------------------------------------------------------------------------------- */

static bool is_given(int count, const int *parameter, int k)
{
    for (int i = 0; i < count; i++)
        if (parameter[i] == k)
            return true;
    return false;
}

static bool waits(const bool *known, const kmp_expr *e)
{
    if (!e)
        return false;
    if (e->kind == KMP_EXPR_PARAMETER)
        return !known[e->index];
    return waits(known, e->a) || waits(known, e->b) || waits(known, e->c);
}

/* A parameter that follows from others moves as its expression does. */
static bool move_follower(motion *x, const kmp_tree *tree, int k)
{
    kmp_ref value = kmp_tree_expression(tree, tree->model->parameters[k].number.expr);
    kmp_derivative *d = kmp_derivative_new(x->g, x->count, x->leaf, x->direction);
    if (d)
        move(x, KMP_IN_PARAMETER, k, kmp_derivative_of(d, value));
    kmp_derivative_free(d);
    return d;
}

static bool move_parameters(motion *x, const kmp_tree *tree, int count, const int *parameter, int at)
{
    const kempe_model *model = tree->model;
    bool *known = KMP_NEW(bool, model->parameter_count), ok = known;
    for (int k = 0; ok && k < model->parameter_count; k++)
        known[k] = !model->parameters[k].varies || is_given(count, parameter, k);
    for (int i = 0; ok && i < count; i++)
        move(x, KMP_IN_PARAMETER, parameter[i], kmp_input(x->g, KMP_IN_ALONG, (uint32_t)(at + i)));
    for (bool grew = true; ok && grew;) {
        grew = false;
        for (int k = 0; ok && k < model->parameter_count; k++)
            if (!known[k] && !waits(known, model->parameters[k].number.expr)) {
                ok = move_follower(x, tree, k);
                known[k] = grew = true;
            }
    }
    kmp_free(known);
    return ok;
}

/* -- the program ------------------------------------------------------------------------------------- */

/* J qdd + jdqd */
static kmp_ref curve(const kmp_equations *eq, int row)
{
    kmp_ref sum = eq->jdqd[row];
    for (int k = 0; k < eq->n; k++)
        sum = kmp_add(eq->graph, sum,
                      kmp_mul(eq->graph, eq->jacobian[row * eq->n + k], kmp_input(eq->graph, KMP_IN_QDD, (uint32_t)k)));
    return sum;
}

static void collect(const kmp_equations *eq, kmp_ref *of)
{
    int n = eq->n, m = eq->m;
    memcpy(of, eq->residual, (size_t)n * sizeof *of);
    for (int r = 0; r < m; r++) {
        of[n + r] = eq->h[r];
        of[n + m + r] = eq->hdot[r];
        of[n + 2 * m + r] = curve(eq, r);
    }
}

static bool differentiate(const motion *x, int count, kmp_ref *of)
{
    kmp_derivative *d = kmp_derivative_new(x->g, x->count, x->leaf, x->direction);
    for (int k = 0; d && k < count; k++)
        of[k] = kmp_derivative_of(d, of[k]);
    kmp_derivative_free(d);
    return d && !kmp_graph_failed(x->g);
}

static bool derive(kmp_bend *bend, const kmp_equations *eq, const int *parameter)
{
    int n = eq->n, m = eq->m, state = 3 * n + m, count = n + 3 * m;
    kmp_ref *of = KMP_NEW(kmp_ref, count);
    const kmp_ref *group = of;
    motion a, b;
    bool begun = begin(&a, eq->graph, state);
    begun = begin(&b, eq->graph, state + eq->model->parameter_count) && begun && of;
    if (begun) {
        collect(eq, of);
        move_state(&a, n, m, 0);
        move_state(&b, n, m, state);
        if (move_parameters(&b, &eq->tree, bend->count, parameter, 2 * state) && differentiate(&a, count, of) &&
            differentiate(&b, count, of))
            bend->program = kmp_program_new(eq->graph, 1, &count, &group);
    }
    end(&a);
    end(&b);
    kmp_free(of);
    return bend->program;
}

static kempe_status find_names(const kempe_system *system, int count, const char *const *names, int *parameter)
{
    const kempe_model *m = system->model;
    for (int i = 0; i < count; i++) {
        int k = 0;
        while (k < m->parameter_count && (!m->parameters[k].varies || strcmp(m->parameters[k].name, names[i]) != 0))
            k++;
        if (k == m->parameter_count)
            return kmp_fail(system->context, KEMPE_E_ARGUMENT,
                            "parameter '%s' is not among those that the equations keep open", names[i]);
        parameter[i] = k;
    }
    return KEMPE_OK;
}

static kempe_status derive_all(kmp_bend *bend, const kempe_system *system, const int *parameter)
{
    kmp_events events = system->events; /* the system has met all conditions: none is added */
    const kmp_scene scene = {.sets = KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL,
                             .scheme = KMP_SCHEME_COMPOSITE,
                             .events = &events,
                             .charted = true};
    kmp_equations eq;
    kempe_status status = kmp_equations_derive(&eq, system->model, &scene);
    if (status != KEMPE_OK)
        return status;
    bool ok = derive(bend, &eq, parameter);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(system->context);
}

kempe_status kmp_bend_init(kmp_bend *bend, const kempe_system *system, const kmp_backend *backend, int count,
                           const char *const *names)
{
    *bend = (kmp_bend){.n = system->n, .m = system->m, .count = count, .chart_version = -1};
    if (system->force)
        return kmp_fail(system->context, KEMPE_E_FAILED,
                        "second derivatives are wanted, and the force of the caller's own has none that are known: "
                        "write it as a force of the model");
    int *parameter = KMP_NEW(int, count);
    kempe_status status = parameter ? find_names(system, count, names, parameter) : kmp_fail_memory(system->context);
    if (status == KEMPE_OK)
        status = derive_all(bend, system, parameter);
    kmp_free(parameter);
    if (status == KEMPE_OK) {
        bend->along = KMP_NEW(double, 2 * (3 * system->n + system->m) + count);
        bend->machine = bend->along ? kmp_machine_new(bend->program, backend) : NULL;
        status = bend->machine ? KEMPE_OK : kmp_fail_memory(system->context);
    }
    if (status == KEMPE_OK)
        kmp_bend_renew_parameters(bend, system->parameters);
    else
        kmp_bend_free(bend);
    return status;
}

void kmp_bend_free(kmp_bend *bend)
{
    kmp_machine_free(bend->machine);
    kmp_program_free(bend->program);
    kmp_free(bend->along);
    *bend = (kmp_bend){0};
}

/* -- numbers ----------------------------------------------------------------------------------------- */

void kmp_bend_renew_parameters(kmp_bend *bend, const double *parameters)
{
    kmp_machine_set(bend->machine, KMP_IN_PARAMETER, parameters);
    bend->chart_version = -1; /* stage 0 runs when the charts are known */
}

void kmp_bend_at(kmp_bend *bend, const kmp_instant *at)
{
    if (bend->chart_version != at->chart_version) {
        kmp_machine_set(bend->machine, KMP_IN_CHART, at->chart);
        (void)kmp_machine_run(bend->machine, 0);
        bend->chart_version = at->chart_version;
    }
    kmp_machine_set(bend->machine, KMP_IN_TIME, &at->t);
    kmp_machine_set(bend->machine, KMP_IN_Q, at->q);
    kmp_machine_set(bend->machine, KMP_IN_QD, at->qd);
    kmp_machine_set(bend->machine, KMP_IN_QDD, at->qdd);
    kmp_machine_set(bend->machine, KMP_IN_LAMBDA, at->lambda);
    if (at->mode)
        kmp_machine_set(bend->machine, KMP_IN_MODE, at->mode);
}

static double *put(double *to, int count, const double *from)
{
    if (from)
        memcpy(to, from, (size_t)count * sizeof *to);
    else
        memset(to, 0, (size_t)count * sizeof *to);
    return to + count;
}

static double *put_direction(const kmp_bend *bend, double *to, const kmp_course *x)
{
    to = put(to, bend->n, x->q);
    to = put(to, bend->n, x->qd);
    to = put(to, bend->n, x->qdd);
    return put(to, bend->m, x->lambda);
}

kmp_bent kmp_bend_along(kmp_bend *bend, const kmp_course *a, const kmp_course *b, const double *parameter)
{
    double *to = put_direction(bend, bend->along, a);
    to = put_direction(bend, to, b);
    (void)put(to, bend->count, parameter);
    kmp_machine_set(bend->machine, KMP_IN_ALONG, bend->along);
    const double *out = kmp_machine_run(bend->machine, 1);
    int n = bend->n, m = bend->m;
    return (kmp_bent){out, out + n, out + n + m, out + n + 2 * m};
}
