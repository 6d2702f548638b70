/* SPDX-License-Identifier: BSD-3-Clause */
/* Near a rank loss of J the formulation uses all coordinates and their sensitivities in place of u, with the integrator
 * that steps over such places (integrators/steppers/singular_step.h). There u and all smooth quantities continue
 * straight. A parameter that moves the closures there makes this impossible; where one is present nothing is stepped
 * over. */
#include "constraints/tolerances.h"
#include "studies/sensitivity/forward_inside.h"
#include <math.h>
#include <string.h>

/* Largest distance of a step's end from its prediction (rad, characteristic lengths): positions within it are found
 * from there.
 */
#define FARTHEST 0.3
/* Finer tolerances are impossible near a singular position. */
#define ZONE_RTOL 1e-9

/* The rows of u among the unknowns from `block` on; `room`: for p. */
static const double *rows_of(const kmp_forward_formulation *f, const double *block, double *room)
{
    if (!f->zone)
        return block;
    for (int i = 0; i < f->p; i++)
        room[i] = block[f->v->linear.part.u[i]];
    return room;
}

static const double *position_of(const kmp_forward_formulation *f, const double *y, int k)
{
    return rows_of(f, y + (k + 1) * f->width, f->su);
}

static const double *rate_of(const kmp_forward_formulation *f, const double *y, int k)
{
    return rows_of(f, y + kmp_forward_blocks(f) + (k + 1) * f->width, f->sud);
}

int kmp_forward_come_to(kmp_forward_formulation *f, double t, const double *y)
{
    const double *ud = rows_of(f, y + kmp_forward_blocks(f), f->ud);
    return f->zone ? kmp_varied_near(f->v, t, y, ud) : kmp_varied_at(f->v, t, y, ud);
}

void kmp_forward_follow(kmp_forward_formulation *f, const double *y, int k, double *dq, double *dqd, double *dqdd,
                        double *dlambda)
{
    kmp_varied_follow(f->v, k, position_of(f, y, k), rate_of(f, y, k), dq, dqd, dqdd, dlambda);
}

/* -- the ODE ----------------------------------------------------------------------------------------- */

static void integrate_outputs(kmp_forward_formulation *f, const double *y, double *dy)
{
    kmp_varied *v = f->v;
    const kmp_forward_target *target = f->options->integrand;
    dy[0] = kmp_target_value(target, v);
    for (int k = 0; k < f->count; k++) {
        kmp_forward_follow(f, y, k, f->dq, f->dqd, f->dqdd, f->dlambda);
        if (target->shown)
            kmp_slopes_along(v->slopes, &v->slopes->outputs,
                             &(kmp_direction){NULL, f->dq, f->dqd, f->dqdd, f->dlambda, NULL}, k, v->shown);
        const kmp_varied_row along = {
            .q = f->dq, .qd = f->dqd, .qdd = f->dqdd, .lambda = f->dlambda, .shown = v->shown};
        dy[1 + k] = kmp_target_of_row(target, v, &along);
    }
}

/* dy at the last state, which is that of y. */
static void give(kmp_forward_formulation *f, const double *y, double *dy)
{
    kmp_varied *v = f->v;
    int w = f->width, half = kmp_forward_blocks(f);
    memcpy(dy, y + half, (size_t)half * sizeof *dy);
    for (int i = 0; i < w; i++)
        dy[half + i] = v->linear.qdd[kmp_forward_unknowns(f)[i]];
    for (int k = 0; k < f->count; k++) {
        const double *su = position_of(f, y, k), *sud = rate_of(f, y, k);
        if (f->zone)
            kmp_varied_follow(v, k, su, sud, f->dq, f->dqd, dy + half + (k + 1) * w, f->dlambda);
        else
            kmp_varied_accelerate(v, k, su, sud, dy + half + (k + 1) * w);
        kmp_forward_delays_rates(f, y, k, dy + half + (k + 1) * w);
    }
    if (f->integrals)
        integrate_outputs(f, y, dy + 2 * half);
}

static int rhs(void *self, double t, const double *y, double *dy)
{
    kmp_forward_formulation *f = self;
    if (kmp_forward_come_to(f, t, y) != KMP_GO)
        return KMP_RETRY;
    give(f, y, dy);
    return KMP_GO;
}

/* df/dy of (u, ud) is also the Jacobian of the sensitivities by their own values. Its change with u, which Newton's
 * method does not need, is left out. */
static int jacobian(void *self, double t, const double *y, double *j)
{
    kmp_forward_formulation *f = self;
    kmp_linear *l = &f->v->linear;
    bool plain = l->plain;
    int p = f->p, half = kmp_forward_blocks(f), size = f->formulation.size;
    l->plain = false;
    int said = kmp_forward_come_to(f, t, y);
    l->plain = plain;
    if (said != KMP_GO)
        return KMP_RETRY;
    kmp_varied_matrix(f->v, f->matrix);
    for (int i = 0; i < half; i++)
        j[i + (half + i) * size] = 1;
    for (int b = 0; b < half; b += p)
        for (int k = 0; k < 2 * p; k++)
            memcpy(j + half + b + (b + k % p + (k < p ? 0 : half)) * size, f->matrix + k * p, (size_t)p * sizeof *j);
    return KMP_GO;
}

/* -- the place --------------------------------------------------------------------------------------- */

int kmp_forward_stand_at(kmp_forward_formulation *f, double t, const double *y, bool whole)
{
    kmp_linear *l = &f->v->linear;
    l->plain = f->count == 0 || !whole;
    int said = kmp_forward_come_to(f, t, y);
    l->plain = f->count == 0;
    if (said != KMP_GO && f->formulation.reason.length == 0)
        kmp_text_printf(&f->formulation.reason, "the loops do not close at t = %.9g", t);
    return said == KMP_GO ? KMP_GO : KMP_HALT;
}

void kmp_forward_pack(kmp_forward_formulation *f, double *y)
{
    const int *of = kmp_forward_unknowns(f);
    int half = kmp_forward_blocks(f), w = f->width;
    for (int i = 0; i < w; i++) {
        y[i] = f->q[of[i]];
        y[half + i] = f->qd[of[i]];
        for (int k = 0; k < f->count; k++) {
            y[(k + 1) * w + i] = f->dq[k * f->n + of[i]];
            y[half + (k + 1) * w + i] = f->dqd[k * f->n + of[i]];
        }
    }
}

void kmp_forward_settle(kmp_forward_formulation *f)
{
    kmp_linear *l = &f->v->linear;
    int row, column;
    memcpy(f->mode, l->eval->mode, kmp_forward_mode_bytes(f));
    kmp_varied_anchor(f->v);
    f->crossed = false;
    if (l->red.r == 0)
        return;
    kmp_block_take_signs(l->red.block, f->signs);
    f->growth = kmp_reduction_growth(&l->red, &row, &column);
    f->due = !f->start.fixed && !f->zone && f->growth > KMP_EXCHANGE_VARIED;
}

int kmp_forward_take_up(kmp_forward_formulation *f, double t, double *y)
{
    kmp_forward_pack(f, y);
    int half = kmp_forward_blocks(f), w = f->width;
    double *atol = f->formulation.atol;
    for (int b = 0; b <= f->count; b++)
        for (int i = 0; i < w; i++) {
            int k = kmp_forward_unknowns(f)[i];
            double of = f->start.atol * f->system->scale[k] / (b ? f->sizes[b - 1] : 1);
            kmp_formulation_tolerances(f->system, k, of, f->start.rate_scale, &atol[b * w + i],
                                       &atol[half + b * w + i]);
        }
    for (int b = 0; b < f->integrals; b++)
        atol[2 * half + b] = f->start.atol * f->options->spec->t_end / (b ? f->sizes[b - 1] : 1);
    if (kmp_forward_stand_at(f, t, y, false) != KMP_GO)
        return KMP_HALT;
    kmp_forward_settle(f);
    return KMP_GO;
}

/* -- a zone ------------------------------------------------------------------------------------------ */

/* Puts the last state, complete, into the unknowns that led to it. */
static void put_closed(kmp_forward_formulation *f, double *y)
{
    const kmp_linear *l = &f->v->linear;
    int n = f->n, half = kmp_forward_blocks(f);
    for (int k = 0; k < f->count; k++)
        kmp_forward_follow(f, y, k, y + (k + 1) * n, y + half + (k + 1) * n, NULL, NULL);
    memcpy(y, l->q, (size_t)n * sizeof *y);
    memcpy(y + half, l->qd, (size_t)n * sizeof *y);
}

static int closed(void *self, double t, double *y, bool as_it_is, double *dy, double *distance)
{
    kmp_forward_formulation *f = self;
    if (!dy)
        kmp_eval_closure(kmp_forward_eval(f), t, y);
    else if (kmp_forward_come_to(f, t, y) != KMP_GO)
        return KMP_RETRY;
    if (dy && !as_it_is)
        put_closed(f, y);
    if (dy)
        give(f, y, dy);
    if (distance)
        *distance = kmp_margin_at(f->start.margin, kmp_forward_eval(f));
    return KMP_GO;
}

static void say_change_point(kmp_forward_formulation *f, double t)
{
    kmp_text_printf(&f->formulation.reason,
                    "the mechanism reaches a change point near t = %.9g, where branches meet: %s", t,
                    f->options->alone ? "the adjoint method cannot cross it, but the forward method may"
                                      : "parameters of its closures have no derivative beyond it");
}

/* -- the end of a step ------------------------------------------------------------------------------- */

/* Accepts a step: it must not have jumped over a dead centre of u; evaluated last. */
static int accept(void *self, double t, double *y, const double *dy, const double *w)
{
    kmp_forward_formulation *f = self;
    const kmp_linear *l = &f->v->linear;
    const char *joint = f->own_angles ? kmp_varied_singular(f->v) : NULL;
    (void)dy, (void)w;
    if (joint) {
        kmp_text_printf(&f->formulation.reason,
                        "the angles of spherical joint '%s' approach their singular position at t = %.9g: integrals of "
                        "these angles end there; use rows instead of integrals, or give the joint other axes",
                        joint, t);
        return KMP_HALT;
    }
    if (f->zone) {
        put_closed(f, y);
        kmp_varied_anchor(f->v);
        return KMP_GO;
    }
    if (l->red.r > 0) {
        kmp_block_take_signs(l->red.block, f->signs_now);
        size_t count = (size_t)kmp_block_count(l->red.block);
        bool crosses = memcmp(f->signs, f->signs_now, count * sizeof *f->signs) != 0;
        f->crossed = f->crossed || crosses;
        if (crosses || kmp_varied_miss(f->v, y) > FARTHEST)
            return KMP_RETRY;
    }
    if (f->options->alone && l->red.r > 0 && kmp_margin_at(f->start.margin, l->eval) < KMP_MARGIN_ENDS) {
        say_change_point(f, t);
        return KMP_HALT;
    }
    int said = kmp_redundant_check(l->eval, &l->part, t, f->start.atol + f->start.rtol, &f->formulation.reason);
    if (said == KMP_GO && kmp_margin_refuses(f->start.margin, l->eval, t))
        said = KMP_RETRY;
    if (said == KMP_GO)
        kmp_forward_settle(f);
    return said;
}

void kmp_forward_explain(kmp_formulation *formulation)
{
    kmp_forward_formulation *f = (kmp_forward_formulation *)formulation;
    double t = f->v->anchor[0].t;
    kmp_eval_closure(kmp_forward_eval(f), t, f->v->anchor[0].q);
    if (f->zone || f->crossed ||
        (f->growth < KMP_GROWTH_EXPLAINS && kmp_margin_at(f->start.margin, kmp_forward_eval(f)) < KMP_MARGIN_EXPLAINS))
        say_change_point(f, t);
    else if (f->growth >= KMP_GROWTH_EXPLAINS)
        kmp_text_printf(&formulation->reason,
                        "the independent coordinates reach a dead centre at t = %.9g: |dv/du| has grown to %.3g", t,
                        f->growth);
}

/* -- construction ------------------------------------------------------------------------------------ */

bool kmp_forward_make_unknowns(kmp_forward_formulation *f)
{
    kmp_formulation *formulation = &f->formulation;
    f->width = f->zone ? f->n : f->p;
    formulation->rtol = f->zone ? fmax(f->start.rtol, ZONE_RTOL) : 0;
    kmp_formulation_make_unknowns(formulation, 2 * kmp_forward_blocks(f) + f->integrals, false);
    formulation->ode = (kmp_ode){.n = formulation->size,
                                 .self = f,
                                 .rhs = rhs,
                                 .accept = accept,
                                 .jacobian = jacobian,
                                 .closed = closed,
                                 .positions = kmp_forward_blocks(f),
                                 .quadratures = f->integrals};
    return !formulation->arena.failed;
}
