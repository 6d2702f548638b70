/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/bend.h"
#include "analysis/slopes.h"
#include "base/memory.h"
#include "linalg/dot.h"
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

/* Those given along inputs, and with them those that follow. */
static bool move_parameters(motion *x, const kmp_tree *tree, int count, const int *parameter, int at)
{
    for (int i = 0; i < count; i++)
        move(x, KMP_IN_PARAMETER, parameter[i], kmp_input(x->g, KMP_IN_ALONG, (uint32_t)(at + i)));
    x->count = kmp_slopes_lead(tree, x->count, x->leaf, x->direction);
    return x->count >= 0;
}

/* -- the program ------------------------------------------------------------------------------------- */

static bool differentiate(const motion *x, int count, kmp_ref *of)
{
    kmp_derivative *d = kmp_derivative_new(x->g, x->count, x->leaf, x->direction);
    for (int k = 0; d && k < count; k++)
        of[k] = kmp_derivative_of(d, of[k]);
    kmp_derivative_free(d);
    return d && !kmp_graph_failed(x->g);
}

static bool derive(kmp_bend *bend, const kmp_equations *eq, const kmp_backend *backend, const int *parameter,
                   const double *values)
{
    int n = eq->n, m = eq->m, state = 3 * n + m, count = n + 3 * m;
    kmp_ref *of = KMP_NEW(kmp_ref, count);
    motion a, b;
    bool begun = begin(&a, eq->graph, state);
    begun = begin(&b, eq->graph, state + eq->model->parameter_count) && begun && of;
    if (begun) {
        kmp_slopes_collect(eq, of);
        move_state(&a, n, m, 0);
        move_state(&b, n, m, state);
        begun = move_parameters(&b, &eq->tree, bend->count, parameter, 2 * state) && differentiate(&a, count, of) &&
                differentiate(&b, count, of) && kmp_formulas_init(&bend->bent, eq->graph, count, of, backend, values);
    }
    end(&a);
    end(&b);
    kmp_free(of);
    return begun;
}

static kempe_status derive_all(kmp_bend *bend, const kempe_system *system, const kmp_backend *backend,
                               const int *parameter)
{
    kmp_equations eq;
    kmp_events events;
    kempe_status status = kmp_slopes_equations(&eq, system, &events, KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL);
    if (status != KEMPE_OK)
        return status;
    bool ok = derive(bend, &eq, backend, parameter, system->parameters);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(system->context);
}

kempe_status kmp_bend_init(kmp_bend *bend, const kempe_system *system, const kmp_backend *backend, int count,
                           const char *const *names)
{
    *bend = (kmp_bend){.n = system->n, .m = system->m, .count = count};
    if (system->force)
        return kmp_fail(system->context, KEMPE_E_FAILED,
                        "second derivatives are wanted, and the force of the caller's own has none that are known: "
                        "write it as a force of the model");
    int *parameter = KMP_NEW(int, count);
    bend->along = KMP_NEW(double, 2 * (3 * system->n + system->m) + count);
    kempe_status status =
        parameter && bend->along ? kmp_slopes_find(system, count, names, parameter) : kmp_fail_memory(system->context);
    if (status == KEMPE_OK)
        status = derive_all(bend, system, backend, parameter);
    kmp_free(parameter);
    if (status != KEMPE_OK)
        kmp_bend_free(bend);
    return status;
}

void kmp_bend_free(kmp_bend *bend)
{
    kmp_formulas_free(&bend->bent);
    kmp_free(bend->along);
    *bend = (kmp_bend){0};
}

/* -- numbers ----------------------------------------------------------------------------------------- */

void kmp_bend_at(kmp_bend *bend, const kmp_instant *at)
{
    kmp_formulas_place(&bend->bent, at);
}

static double *put(double *to, int count, const double *from)
{
    kmp_copy_or_zero(count, from, to);
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
    kmp_machine_set(bend->bent.machine, KMP_IN_ALONG, bend->along);
    const double *out = kmp_machine_run(bend->bent.machine, 1);
    int m = bend->m;
    return (kmp_bent){out + 3 * m, out, out + m, out + 2 * m};
}
