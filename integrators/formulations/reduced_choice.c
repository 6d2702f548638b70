/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of u on the reduced formulation. It ends at a dead centre: |Bvu| grows without bound and det Jv changes
 * sign. Both are monitored at every accepted step, because the ODE may pass such a point and continue wrongly without
 * any other sign. Before a dead centre u and v are exchanged, unless u is fixed. */
#include "constraints/tolerances.h"
#include "integrators/formulations/reduced.h"
#include "linalg/dense/dense.h"
#include <limits.h>
#include <string.h>

/* With fewer degrees of freedom the reduced mass is the cheapest. */
#define MANY_FREEDOMS 12
/* Cost of an operation of a reduced mass with zeros, relative to one without. */
#define BY_LISTS 2

/* -- monitoring ---------------------------------------------------------------------------------------- */

static const char *name_of(const kmp_reduced *d, int k)
{
    return k >= 0 ? d->s->model->motions[k].name : "?";
}

static int dead_centre(kmp_reduced *d, double t, const char *sign, int v, int u)
{
    kmp_text_printf(
        &d->formulation.reason,
        "independent coordinate '%s' reached a dead centre at t = %.9g: %s for dependent '%s'; beyond it '%s' no "
        "longer determines the mechanism. Choose another with --independent, or use the projected formulation",
        name_of(d, u), t, sign, name_of(d, v), name_of(d, u));
    return KMP_HALT;
}

static double exchange_growth(const kmp_reduced *d)
{
    return d->integrated || d->start.restarts ? KMP_EXCHANGE_GROWTH : KMP_EXCHANGE_CLOSED;
}

void kmp_reduced_judge(kmp_reduced *d)
{
    if (d->r == 0)
        return;
    d->growth = kmp_reduction_growth(&d->red, &d->growth_v, &d->growth_u);
    d->due = !d->start.fixed && d->growth > (d->part.user ? KMP_EXCHANGE_WISH : exchange_growth(d));
}

/* True if a block of Jv that was singular within the step is an ignored change point, and no dead centre of u, at which
 * |Bvu| grows. */
static bool is_passed(const kmp_reduced *d)
{
    return d->start.margin->ignored && d->growth <= KMP_EXCHANGE_WISH;
}

static bool same_signs(const kmp_reduced *d, const int *signs)
{
    return memcmp(signs, d->signs, (size_t)kmp_block_count(d->red.block) * sizeof *signs) == 0;
}

int kmp_reduced_watch(kmp_reduced *d, double t, const int *signs)
{
    if (d->r == 0)
        return KMP_GO;
    kmp_reduced_judge(d);
    bool crossed = !same_signs(d, signs) && !is_passed(d);
    if (d->start.fixed && crossed)
        return dead_centre(d, t, "det Jv changed its sign, |dv/du| is largest", d->growth_v, d->growth_u);
    if (d->start.fixed && d->growth > KMP_GROWTH_LIMIT)
        return dead_centre(d, t, "|dv/du| exceeds 1000", d->growth_v, d->growth_u);
    d->crossed = crossed;
    if (!crossed)
        memcpy(d->signs, signs, (size_t)kmp_block_count(d->red.block) * sizeof *signs);
    return crossed ? KMP_RETRY : KMP_GO;
}

void kmp_reduced_explain(kmp_formulation *formulation)
{
    kmp_reduced *d = (kmp_reduced *)formulation;
    kmp_text what = {0};
    if (d->growth >= KMP_GROWTH_EXPLAINS) {
        kmp_text_printf(&what, "the loops cannot be closed beyond it, |dv/du| has grown to %.3g", d->growth);
        (void)dead_centre(d, d->t, what.s ? what.s : "", d->growth_v, d->growth_u);
        kmp_text_free(&what);
    } else if (d->crossed) {
        kmp_text_printf(&formulation->reason,
                        "the closures lose a row at t = %.9g: det Jv changes its sign while |dv/du| remains %.3g, so "
                        "two branches of the mechanism meet there and the motion may continue on either; change the "
                        "start or the lengths, or use the projected formulation",
                        d->t, d->growth);
    }
}

/* -- evaluators --------------------------------------------------------------------------------------- */

/* True if a fused program is possible. Without a reduced mass there is nothing to write out. The power of a drive needs
 * multipliers, and so do forces that depend on them, by iteration. */
static bool can_fuse(const kmp_reduced *d)
{
    bool explicit = !d->start.implicit && !d->start.dae;
    return (d->integrated || explicit) && !d->by_saddle && !(d->has_work && d->s->rheonomic) &&
           d->s->load_row_count == 0;
}

double kmp_reduced_operations(const kmp_reduced *d)
{
    const kmp_program *program = d->eval->by_bodies ? d->s->articulated : d->s->motion;
    double sum = (double)kmp_program_count(program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS).paper;
    double reduction = KMP_LOOPS_COST * (double)kmp_reduction_count(&d->red).paper;
    return sum + (d->by_saddle ? kmp_saddle_cost(&d->saddle) : reduction);
}

/* With many degrees of freedom the saddle system written out costs less than the reduced mass, from some number of
 * evaluations on, or `at_once`. */
static int wait_for_solved(kmp_reduced *d, bool at_once)
{
    long wait = d->integrated ? kmp_solved_wait(d->eval, &d->part, kmp_reduced_operations(d)) : LONG_MAX;
    if (wait >= 0)
        d->due_solved = wait < LONG_MAX - d->evaluations ? d->evaluations + (at_once ? 0 : wait) : LONG_MAX;
    return wait < 0 ? KMP_HALT : KMP_GO;
}

/* Lanes of a program of states, if the integrator uses them. */
static int prepare_stages(kmp_reduced *d, const kmp_program *program)
{
    int states = 2 * d->p + d->r;
    if (!d->start.lanes || kmp_stage_lanes_init(&d->stages, program, d->eval, states, kmp_lanes_best()))
        return KMP_GO;
    (void)kmp_fail_memory(d->s->context);
    return KMP_HALT;
}

int kmp_reduced_solve(kmp_reduced *d, double t)
{
    if (d->fuses_late && d->steps >= KMP_FORMULATION_BRIEF)
        return kmp_reduced_fuse(d, true);
    if (d->evaluations < d->due_solved)
        return KMP_GO;
    d->due_solved = LONG_MAX;
    kmp_eval_closure(d->eval, t, d->q);
    if (kmp_reduction_factor(&d->red))
        return KMP_GO;
    if (kmp_solved_new_reduced(&d->solved, &d->red) != KEMPE_OK)
        return KMP_HALT;
    return prepare_stages(d, d->solved ? kmp_solved_program(d->solved) : NULL);
}

static void forget_programs(kmp_reduced *d)
{
    kmp_stage_lanes_free(&d->stages);
    kmp_fused_free(d->fused);
    kmp_solved_free(d->solved);
    d->fused = NULL;
    d->solved = NULL;
    d->by_solved = false;
    d->apart = false;
    d->steps = 0;
}

int kmp_reduced_fuse(kmp_reduced *d, bool worth)
{
    bool at_once = worth && (d->solved || d->start.lanes);
    forget_programs(d);
    d->fuses_late = !worth && can_fuse(d);
    if (worth && can_fuse(d) && kmp_fused_new(&d->fused, &d->red, !d->integrated) != KEMPE_OK)
        return KMP_HALT;
    if (!d->fused)
        return wait_for_solved(d, at_once);
    d->due_solved = LONG_MAX;
    return prepare_stages(d, kmp_fused_program(d->fused));
}

bool kmp_reduced_is_stale(kmp_reduced *d)
{
    return (d->fused && kmp_fused_is_stale(d->fused)) || (d->solved && kmp_solved_is_stale(d->solved));
}

/* With many degrees of freedom the sparse saddle system costs less than the reduced mass, which has fewer zeros. */
bool kmp_reduced_try_saddle(kmp_reduced *d)
{
    if (d->p < MANY_FREEDOMS || d->eval->by_bodies)
        return true;
    if (!kmp_saddle_init(&d->saddle, d->eval, &d->part))
        return false;
    double cost = kmp_saddle_operations(&d->saddle), count = (double)kmp_reduction_count(&d->red).paper;
    count *= d->red.zeros ? BY_LISTS : 1;
    d->by_saddle = cost > 0 && KMP_SPARSE_COST * cost < count;
    if (!d->by_saddle)
        kmp_saddle_free(&d->saddle);
    return true;
}

/* The evaluator already uses the formulation's dynamics. */
bool kmp_reduced_renew_saddle(kmp_reduced *d)
{
    long factorizations = d->saddle.factorizations;
    kmp_saddle_free(&d->saddle);
    bool made = !d->by_saddle || kmp_saddle_init(&d->saddle, d->eval, &d->part);
    d->saddle.factorizations = factorizations;
    return made;
}

/* -- exchanges --------------------------------------------------------------------------------------- */

static bool is_among(const int *list, int count, int k)
{
    for (int i = 0; i < count; i++)
        if (list[i] == k)
            return true;
    return false;
}

static void log_exchange(const kmp_reduced *d, double t, const kmp_partition *before)
{
    kmp_text out = {0}, in = {0};
    for (int k = 0; k < d->p; k++) {
        if (!is_among(d->part.u, d->p, before->u[k]))
            kmp_text_printf(&out, "%s'%s'", out.length ? ", " : "", name_of(d, before->u[k]));
        if (!is_among(before->u, d->p, d->part.u[k]))
            kmp_text_printf(&in, "%s'%s'", in.length ? ", " : "", name_of(d, d->part.u[k]));
    }
    kmp_run_log_add(d->start.log, "exchange", t, d->growth, d->part.max_b,
                    "%s instead of %s as independent coordinate: |dv/du| %.3g -> %.3g", in.s ? in.s : "",
                    out.s ? out.s : "", d->growth, d->part.max_b);
    kmp_text_free(&out);
    kmp_text_free(&in);
}

/* Makes the workspace of the new partition, and the state in its unknowns. */
static int take_over(kmp_reduced *d, double t, double *y)
{
    kmp_reduction before = d->red;
    if (kmp_reduction_init(&d->red, d->eval, &d->part) != KEMPE_OK) {
        d->red = before;
        return KMP_HALT;
    }
    d->red.newton = before.newton;
    d->red.factorizations = before.factorizations;
    kmp_reduction_free(&before);
    if (!kmp_reduced_renew_saddle(d))
        return KMP_HALT;
    kmp_reduced_pack(&d->part, d->integrated, d->q, d->qd, y);
    kmp_reduced_set_tolerances(d);
    d->formulation.exchanges++;
    bool worth = d->steps >= KMP_FORMULATION_BRIEF;
    return kmp_reduced_settle(d, t, y) == KMP_GO ? kmp_reduced_fuse(d, worth) : KMP_HALT;
}

int kmp_reduced_exchange(kmp_reduced *d, double t, double *y)
{
    kmp_partition before;
    d->due = false;
    if (!kmp_partition_copy(&before, &d->part))
        return KMP_HALT;
    int said = kmp_partition_exchange(&d->part, d->s, d->eval->jacobian, exchange_growth(d)) == KEMPE_OK
                   ? take_over(d, t, y)
                   : KMP_HALT;
    if (said == KMP_GO)
        log_exchange(d, t, &before);
    kmp_partition_free(&before);
    return said;
}
