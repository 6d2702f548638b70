/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice between M and C and articulated bodies, made when articulated bodies are first asked for.
 *
 * The cost of a right-hand side is counted as in the reduced formulation: the program, and the solves with its values.
 * By M and C these are the mass of n - m independent coordinates and its Cholesky factors, or the sparse saddle system
 * where that costs less. By articulated bodies it is the m x m system of the multipliers, and none on a tree. The work
 * common to both, Jv and its tangent, is left out. bench/bench_articulated.c measures the size from which articulated
 * bodies are faster. */
#include "dynamics/motion_choice.h"
#include "base/memory.h"
#include "constraints/kinds/kind.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/load_dependent.h"
#include "dynamics/motion.h"
#include "dynamics/system_record.h"
#include "linalg/dense/dense.h"
#include "linalg/sparse.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include <math.h>

/* M and C cost fewer operations with fewer independent coordinates than this; nothing else is tried. */
#define FEW 12
/* A lower bound of the operations per coordinate by articulated bodies, in the plane, and per entry of M^-1 J'. If M
 * and C take fewer, articulated bodies are not tried. */
#define LEAST_OF_COORDINATE 15
#define LEAST_OF_ENTRY      8
/* Nodes of their graph, as a multiple of the operations by M and C, about. The graph of a large mechanism, which is
 * searched little, has room for those of the passes too, if these run. */
#define NODES       3
#define NODES_LARGE 6
/* M^-1 J' has at most so many entries. */
#define MOST_ENTRIES 250000

/* -- the choice -------------------------------------------------------------------------------------- */

static double operations(kmp_flops f)
{
    return (double)f.add + (double)f.mul + (double)f.div;
}

static double operations_of(const kmp_program *program)
{
    return (double)kmp_program_count(program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
}

/* Factors of a symmetric k x k matrix, and one solution. */
static double cholesky(int k)
{
    return operations(kmp_cholesky_factor_flops(k)) + operations(kmp_cholesky_solve_flops(k));
}

static int independent(const kempe_system *s)
{
    return s->n > s->m ? s->n - s->m : 0;
}

/* Entry k of [M -J'; J 0], of M with both its triangles; false after the last. */
static bool saddle_entry(const kempe_system *s, int k, int *row, int *col)
{
    int side = k % 2, e = k / 2 - s->mass.count;
    const kmp_pattern *pattern = e < 0 ? &s->mass : &s->jacobian;
    if (e >= s->jacobian.count)
        return false;
    int i = e < 0 ? pattern->row[k / 2] : s->n + pattern->row[e], j = pattern->col[e < 0 ? k / 2 : e];
    *row = side ? j : i;
    *col = side ? i : j;
    return true;
}

/* Cost of the saddle system's sparse factors, in operations of dense ones; infinite when there is no memory or no
 * pattern.
 */
static double cost_of_saddle(const kempe_system *s)
{
    int most = 2 * (s->mass.count + s->jacobian.count), count = 0;
    int *row = KMP_NEW(int, most), *col = KMP_NEW(int, most);
    for (int k = 0; row && col && saddle_entry(s, k, &row[count], &col[count]); k++)
        count += k % 2 == 0 || row[count] != col[count];
    kmp_sparse *sparse = row && col ? kmp_sparse_new(s->n + s->m, count, row, col, true) : NULL;
    double cost = sparse ? KMP_SPARSE_COST * kmp_sparse_operations(sparse) : INFINITY;
    kmp_sparse_free(sparse);
    kmp_free(row);
    kmp_free(col);
    return cost;
}

/* Cost of M a0, M X, X' force and X' M X, then the factors; on a tree X is 1. With many coordinates and loops, where X'
 * M X is dense, the saddle system. */
static double cost_of_solves(const kempe_system *s)
{
    double n = s->n, p = independent(s), mass = 2.0 * s->mass.count;
    double products = s->m > 0 ? mass * (p + 1) + p * n + p * (p + 1) / 2 * n : 0;
    double dense = 2 * products + cholesky(independent(s));
    return s->m > 0 ? fmin(dense, cost_of_saddle(s)) : dense;
}

static double cost_by_mass(const kempe_system *s)
{
    return operations_of(s->motion) + cost_of_solves(s);
}

/* The multipliers, and M^-1 J' lambda. */
static double cost_of_multipliers(const kempe_system *s, double entries)
{
    return cholesky(s->m) + 2 * entries;
}

/* Finds whether articulated bodies may cost less, as far as this is visible before they are derived. */
static kempe_status look_ahead(const kempe_system *s, bool *may_pay)
{
    *may_pay = false;
    if (independent(s) < FEW || (double)s->m * s->n > MOST_ENTRIES)
        return KEMPE_OK;
    int *room = KMP_NEW(int, 2 * s->n);
    KMP_TRY(kmp_made(s->context, room));
    /* Entries of M^-1 J': all coordinates coupled by M to those of a row. Each part of the tree that is attached to the
     * ground separately is identified by the first coordinate that M couples. `of`, `size`: n. */
    int *size = room + s->n;
    const kmp_pattern *mass = &s->mass, *jacobian = &s->jacobian;
    double entries = 0;
    for (int k = 0; k < mass->count; k++) /* row by row */
        if (k == 0 || mass->row[k] != mass->row[k - 1]) {
            room[mass->row[k]] = mass->col[k] < mass->row[k] ? room[mass->col[k]] : mass->row[k];
            size[room[mass->row[k]]]++;
        }
    for (int k = 0; k < jacobian->count; k++) {
        bool again = false;
        for (int j = k - 1; j >= 0 && jacobian->row[j] == jacobian->row[k] && !again; j--)
            again = room[jacobian->col[j]] == room[jacobian->col[k]];
        entries += again ? 0 : size[room[jacobian->col[k]]];
    }
    kmp_free(room);
    double least = LEAST_OF_COORDINATE * (double)s->n + LEAST_OF_ENTRY * entries + cost_of_multipliers(s, entries);
    if (s->late && least < cost_of_solves(s)) {
        *may_pay = true;
        return KEMPE_OK;
    }
    KMP_TRY(kmp_motion_need(s));
    *may_pay = least < cost_by_mass(s);
    return KEMPE_OK;
}

/* M and C need not be counted if articulated bodies cost less than the solves with M and C alone. */
static kempe_status compare(const kempe_system *s, const kmp_bodies *bodies, bool *pay)
{
    double cost = operations_of(bodies->program) + cost_of_multipliers(s, bodies->compliance.count);
    *pay = s->late && cost < cost_of_solves(s);
    if (*pay)
        return KEMPE_OK;
    KMP_TRY(kmp_motion_need(s));
    *pay = cost < cost_by_mass(s);
    return KEMPE_OK;
}

/* Without iteration runs may write out the solution by M and C, which they would need soon. */
bool kmp_motion_may_wait(const kempe_system *s)
{
    const kempe_model *model = s->model;
    int rows = kmp_closure_all_rows(model), n = model->motion_count;
    bool bodies = s->dynamics == KMP_DYNAMICS_AUTO || s->dynamics == KMP_DYNAMICS_ARTICULATED;
    bool pressed = kmp_model_has_loads(model), iterates = model->wheel_count > 0; /* wheels, and points on curves */
    for (int c = 0; c < model->closure_count; c++)
        iterates = iterates || model->closures[c].curve_count > 0;
    for (int k = 0; k < model->force_count; k++)
        pressed = pressed || kmp_force_has_load(&model->forces[k]);
    return bodies && !pressed && iterates && kmp_equations_are_large(model) && n - rows >= FEW &&
           (double)rows * n <= MOST_ENTRIES;
}

/* -- the derivation ---------------------------------------------------------------------------------- */

static kempe_status derive_bodies(const kempe_system *s, kmp_bodies *bodies)
{
    enum { QUARTERS = 4 }; /* operations of closures and M are a quarter of those by M and C, about */
    bool passes = kmp_equations_are_large(s->model) && !s->late;
    const kmp_program *p = s->late ? s->late->weighing : s->motion;
    const uint32_t nodes = (uint32_t)(s->late ? QUARTERS * p->code[p->stages] : p->code[p->stages]);
    kmp_events events = s->events; /* the system has recorded all conditions: none is added */
    const kmp_derivation_request request = {.sets =
                                                KMP_SET_ACCELERATION | KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_POWER,
                                            .efforts = true,
                                            .nodes = (passes ? NODES_LARGE : NODES) * nodes,
                                            .first = &bodies->first,
                                            .quick = true,
                                            .events = &events,
                                            .frictionless = s->frictionless,
                                            .charted = true};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive(&eq, s->model, &request));
    bool made = kmp_motion_make_bodies(s, bodies, &eq);
    kmp_equations_free(&eq);
    return made ? KEMPE_OK : kmp_fail_memory(s->context);
}

/* Derives articulated bodies. A coordinate that moves no mass is no error unless they were requested. */
static kempe_status try_them(const kempe_system *s, kmp_bodies *bodies)
{
    bool may_pay;
    kempe_status status = look_ahead(s, &may_pay);
    if (status != KEMPE_OK || !may_pay)
        return status;
    bool pay = true;
    status = derive_bodies(s, bodies);
    if (status == KEMPE_OK)
        status = compare(s, bodies, &pay);
    if (status == KEMPE_OK && !pay)
        kmp_bodies_forget(bodies);
    if (status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(s->context);
    return KEMPE_OK;
}

static kempe_status make_bodies(const kempe_system *s, kmp_bodies *bodies)
{
    bool pressed = s->load_row_count > 0;
    if (s->dynamics == KMP_DYNAMICS_AUTO)
        return pressed ? KEMPE_OK : try_them(s, bodies);
    if (s->dynamics != KMP_DYNAMICS_ARTICULATED)
        return KEMPE_OK;
    if (pressed) {
        /* Their recursion has the forces in it. */
        int row = s->load_rows[0];
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "algorithm articulated: force '%s' depends on the multiplier of closure row '%s', which this "
                        "algorithm does not support; use the algorithm composite",
                        kmp_load_dependent_force(s, row), s->row_names[row]);
    }
    if ((double)s->m * s->n > MOST_ENTRIES)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "algorithm articulated: the forces of %d closure rows on %d coordinates exceed the limit of "
                        "%d; use the algorithm composite",
                        s->m, s->n, MOST_ENTRIES);
    return derive_bodies(s, bodies);
}

/* -- the store --------------------------------------------------------------------------------------- */

kmp_bodies *kmp_bodies_new(void)
{
    kmp_bodies *bodies = KMP_NEW(kmp_bodies, 1);
    if (bodies && pthread_mutex_init(&bodies->lock, NULL) != 0) {
        kmp_free(bodies);
        return NULL;
    }
    return bodies;
}

void kmp_bodies_forget(kmp_bodies *bodies)
{
    kmp_program_free(bodies->program);
    bodies->program = NULL;
    bodies->compliance = bodies->mobility = (kmp_pattern){0};
    kmp_arena_free(&bodies->arena);
}

void kmp_bodies_free(kmp_bodies *bodies)
{
    if (!bodies)
        return;
    kmp_bodies_forget(bodies);
    kmp_savings_free(&bodies->first);
    pthread_mutex_destroy(&bodies->lock);
    kmp_free(bodies);
}

kempe_status kmp_motion_need_bodies(const kempe_system *s)
{
    kmp_bodies *bodies = s->bodies;
    kempe_status status = KEMPE_OK;
    if (atomic_load(&bodies->made))
        return KEMPE_OK;
    pthread_mutex_lock(&bodies->lock);
    if (!atomic_load(&bodies->made)) {
        bool recalled = kmp_bodies_recall(s);
        status = recalled ? KEMPE_OK : make_bodies(s, bodies);
        if (status == KEMPE_OK && !recalled)
            kmp_bodies_keep(s);
        if (status != KEMPE_OK)
            kmp_bodies_forget(bodies);
        atomic_store(&bodies->made, status == KEMPE_OK);
    }
    pthread_mutex_unlock(&bodies->lock);
    return status;
}
