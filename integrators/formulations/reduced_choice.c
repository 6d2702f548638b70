/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of u on the reduced formulation. It ends at a dead centre: |Bvu| grows without bound and det Jv changes
 * sign. Both are monitored at every accepted step, because the ODE may pass such a point and continue wrongly without
 * any other sign. Before a dead centre u and v are exchanged, unless u is fixed. */
#include "integrators/formulations/reduced_choice.h"
#include "constraints/tolerances.h"
#include "integrators/decide/coordinate_exchange.h"
#include "integrators/formulations/reduced.h"
#include "integrators/formulations/reduced_programs.h"
#include "model/data/model.h"
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

/* The right-hand side is a function of u alone where v is closed for it. An integrator that restarts at each exchange
 * would lose more than it gains. */
static double exchange_limit(const kmp_reduced *d, bool of_user)
{
    return kmp_exchange_limit(of_user, !d->integrated && !d->start.restarts);
}

void kmp_reduced_judge(kmp_reduced *d)
{
    if (d->r == 0)
        return;
    d->growth = kmp_reduction_growth(&d->red, &d->growth_v, &d->growth_u);
    d->due = !d->start.fixed && d->growth > exchange_limit(d, d->part.user);
}

int kmp_reduced_watch(kmp_reduced *d, double t, const int *signs)
{
    if (d->r == 0)
        return KMP_GO;
    kmp_reduced_judge(d);
    /* A block of Jv that was singular within the step may be an ignored change point, and no dead centre of u, at which
     * |Bvu| grows. */
    bool passed = d->start.margin->ignored && d->growth <= KMP_EXCHANGE_WISH;
    size_t bytes = (size_t)kmp_block_count(d->red.block) * sizeof *signs;
    bool crossed = memcmp(signs, d->signs, bytes) != 0 && !passed;
    if (d->start.fixed && crossed)
        return dead_centre(d, t, "det Jv changed its sign, |dv/du| is largest", d->growth_v, d->growth_u);
    if (d->start.fixed && d->growth > KMP_GROWTH_LIMIT)
        return dead_centre(d, t, "|dv/du| exceeds 1000", d->growth_v, d->growth_u);
    d->crossed = crossed;
    if (!crossed)
        memcpy(d->signs, signs, bytes);
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

/* With many degrees of freedom the sparse saddle system costs less than the reduced mass, which has fewer zeros. */
bool kmp_reduced_try_saddle(kmp_reduced *d)
{
    if (d->p < MANY_FREEDOMS || d->eval->by_bodies)
        return true;
    if (!kmp_saddle_init(&d->saddle, d->eval, &d->part))
        return false;
    double cost = d->saddle.sparse ? kmp_sparse_operations(d->saddle.sparse) : 0,
           count = (double)kmp_reduction_count(&d->red).paper;
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

int kmp_reduced_exchange(kmp_reduced *d, double t, double *y)
{
    kmp_partition before;
    d->due = false;
    if (!kmp_reduced_keep(d) || !kmp_partition_copy(&before, &d->part))
        return KMP_HALT;
    /* The workspace of the new partition, then the state in its unknowns. */
    kmp_reduction red = d->red;
    bool made = kmp_partition_exchange(&d->part, d->s, d->eval->jacobian, exchange_limit(d, false)) == KEMPE_OK &&
                kmp_reduction_init(&d->red, d->eval, &d->part) == KEMPE_OK;
    if (made) {
        d->red.newton = red.newton;
        d->red.factorizations = red.factorizations;
        kmp_reduction_free(&red);
    } else {
        d->red = red;
    }
    int said = KMP_HALT;
    if (made && kmp_reduced_renew_saddle(d)) {
        kmp_reduced_pack(&d->part, d->has_v, d->q, d->qd, y);
        kmp_reduced_set_tolerances(d);
        d->formulation.exchanges++;
        bool worth = d->steps >= KMP_FORMULATION_BRIEF;
        said = kmp_reduced_linearise_at(d, t, y) == KMP_GO ? kmp_reduced_make_program(d, worth) : KMP_HALT;
    }
    if (said == KMP_GO)
        log_exchange(d, t, &before);
    kmp_partition_free(&before);
    return said;
}
