/* SPDX-License-Identifier: BSD-3-Clause */
/* Second derivatives along two directions: forward differentiation applied twice in the graph, first along a and then
 * along b, so that one program gives them for any directions. */
#include "analyses/derivatives/second_derivatives.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "base/arena.h"
#include "base/memory.h"
#include "dynamics/equations.h"
#include "linalg/dense/dot.h"
#include "model/data/model.h"
#include "symbolic/derivative.h"

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

/* Parameters go along b as given, and with them those that follow. */
static bool derive(kmp_second_derivatives *second, const kmp_equations *eq, const kmp_backend *backend,
                   const int *parameter, const double *values)
{
    int state = 3 * eq->n + eq->m, count = eq->n + 3 * eq->m;
    kmp_arena arena = {0};
    kmp_ref *of = KMP_ARENA_NEW(&arena, kmp_ref, count);
    motion a = motion_of(&arena, state), b = motion_of(&arena, state + eq->model->parameter_count);
    bool ok = !arena.failed;
    if (ok) {
        kmp_slopes_collect(eq, of);
        move_state(&a, eq, 0);
        move_state(&b, eq, state);
        for (int i = 0; i < second->count; i++)
            move(&b, eq->graph, KMP_IN_PARAMETER, parameter[i], 2 * state + i);
        b.count = kmp_slopes_lead(&eq->tree, b.count, b.leaf, b.direction);
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
    KMP_TRY(kmp_slopes_equations(&eq, system, &events, KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL));
    bool ok = derive(second, &eq, backend, parameter, system->parameters);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(system->context);
}

kempe_status kmp_second_derivatives_init(kmp_second_derivatives *second, const kempe_system *system,
                                         const kmp_backend *backend, int count, const char *const *names)
{
    *second = (kmp_second_derivatives){.n = system->n, .m = system->m, .count = count};
    if (system->force)
        return kmp_fail(system->context, KEMPE_E_FAILED,
                        "second derivatives are required, and those of a user-defined force are unknown: define it as "
                        "a force of the model");
    int *parameter = KMP_NEW(int, count);
    second->along = KMP_NEW(double, 2 * (3 * system->n + system->m) + count);
    kempe_status status = parameter && second->along ? kmp_slopes_find(system, count, names, parameter)
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
