/* SPDX-License-Identifier: BSD-3-Clause */
/* States are closed by Newton's method with the Jacobian of each lane. The programs are those of the evaluator, of the
 * tangents and of the derivatives by parameters; the linear algebra between them is kmp_reduction_lanes. */
#include "analyses/derivatives/varied_lanes.h"
#include "backend/x86/x86.h"
#include "base/clones.h"
#include "base/simd4.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "dynamics/motion.h"
#include "integrators/decide/closing.h"
#include "integrators/steppers/ode.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

enum { W = KMP_STAGE_LANES, STAGE = 1 /* of tangents and slopes */ };

#define AT(p, k) KMP_EIGHT_AT((p) + (ptrdiff_t)(k)*W)
#define OF(p, k) KMP_EIGHT_CONST((p) + (ptrdiff_t)(k)*W)

/* Larger mechanisms have programs that are not worth lanes. */
enum { MOST_COORDINATES = 512 };

bool kmp_varied_lanes_suit(const kempe_system *system)
{
    bool registers = kmp_x86_runs(KMP_X86_FOUR) || kmp_x86_runs(KMP_X86_EIGHT);
    return registers && !system->force && system->load_row_count == 0 && system->model->delay_count == 0 &&
           system->n <= MOST_COORDINATES;
}

bool kmp_varied_lanes_can(const kmp_sensitivity_equations *varied)
{
    return kmp_varied_lanes_suit(varied->system) && varied->linear.tangents.tangent.program &&
           (varied->count == 0 || varied->slopes->equations.formulas.program);
}

static bool make_stages(kmp_varied_lanes *x, const kmp_sensitivity_equations *v)
{
    const kmp_evaluator *eval = v->linear.eval;
    return kmp_stage_lanes_init(&x->motion, v->system->motion, eval) &&
           kmp_stage_lanes_init(&x->tangent, v->linear.tangents.tangent.program, eval) &&
           kmp_stage_lanes_init(&x->slope, v->slopes->equations.formulas.program, eval);
}

static void free_stages(kmp_varied_lanes *x)
{
    kmp_stage_lanes_free(&x->motion);
    kmp_stage_lanes_free(&x->tangent);
    kmp_stage_lanes_free(&x->slope);
}

kempe_status kmp_varied_lanes_prepare(const kmp_sensitivity_equations *varied)
{
    kmp_varied_lanes x = {0};
    KMP_TRY(kmp_motion_need(varied->system));
    bool made = make_stages(&x, varied);
    free_stages(&x);
    return kmp_made(varied->system->context, made);
}

kempe_status kmp_varied_lanes_begin(kmp_varied_lanes *lanes, kmp_sensitivity_equations *varied)
{
    kmp_varied_lanes_free(lanes);
    *lanes = (kmp_varied_lanes){.v = varied, .number = -1};
    KMP_TRY(kmp_motion_need(varied->system));
    int n = W * varied->n, m = W * varied->m;
    const bool made = KMP_ARENA_MAKE(&lanes->arena,
                                     KMP_ROOM(double, n, &lanes->q, &lanes->qd, &lanes->qdd, &lanes->force, &lanes->a0,
                                              &lanes->wq, &lanes->wqd, &lanes->wqdd, &lanes->u, &lanes->udd, &lanes->w),
                                     KMP_ROOM(double, m, &lanes->lambda, &lanes->h, &lanes->rate, &lanes->curve)) &&
                      make_stages(lanes, varied);
    if (!made)
        kmp_varied_lanes_free(lanes);
    return kmp_made(varied->system->context, made);
}

void kmp_varied_lanes_free(kmp_varied_lanes *lanes)
{
    free_stages(lanes);
    kmp_reduction_lanes_free(&lanes->red);
    kmp_arena_free(&lanes->arena);
    *lanes = (kmp_varied_lanes){0};
}

/* -- closing ------------------------------------------------------------------------------------------- */

/* q where closing begins: along the tangent and curvature of the last anchor. */
static void predict(kmp_varied_lanes *x, const double *t, const double *u)
{
    const kmp_sensitivity_equations *v = x->v;
    const kmp_sensitivity_equations_place *at = &v->anchor[0];
    const kmp_partition *part = &v->linear.part;
    const double *curve = at->drift + v->n, *tangent = curve + v->n;
    const kmp_eight tau = KMP_EIGHT_CONST(t) - at->t;
    for (int i = 0; i < v->n; i++)
        AT(x->q, i) = at->q[i] + tau * (at->drift[i] + 0.5 * tau * curve[i]);
    for (int k = 0; k < part->p; k++) {
        const kmp_eight du = OF(u, k) - at->q[part->u[k]];
        for (int i = 0; i < v->n; i++)
            if (tangent[i + k * v->n] != 0)
                AT(x->q, i) += tangent[i + k * v->n] * du;
    }
}

/* The same from these lanes, which are closed at other u: along their own tangents. Returns the largest change of u,
 * scaled. */
static double move_along(kmp_varied_lanes *x, const double *u)
{
    const kmp_reduction_lanes *r = &x->red;
    double most = 0;
    for (int c = 0; c < r->p; c++) {
        double size = 0;
        const kmp_eight du = OF(u, c) - OF(x->u, c);
        for (int i = 0; r->full[c] && i < r->r; i++)
            AT(x->q, r->column[i]) += OF(r->bvu, c * r->r + i) * du;
        for (int l = 0; l < W; l++)
            size = du[l] > size ? du[l] : -du[l] > size ? -du[l] : size;
        size /= x->v->system->scale[x->v->linear.part.u[c]];
        most = size > most ? size : most;
    }
    return most;
}

static void put_independent(kmp_varied_lanes *x, const double *u)
{
    const kmp_partition *part = &x->v->linear.part;
    for (int k = 0; k < part->p; k++)
        AT(x->q, part->u[k]) = OF(u, k);
    memcpy(x->u, u, (size_t)(part->p * W) * sizeof *u);
}

/* The largest component of the last correction, scaled; infinite if one is not finite. */
static double correction_size(const kmp_varied_lanes *x)
{
    const kmp_reduction_lanes *r = &x->red;
    double most = 0;
    if (!kmp_stage_lanes_finite(r->r, r->dv))
        return INFINITY;
    for (int i = 0; i < r->r; i++) {
        double size = 0, by = 1 / x->v->system->scale[r->column[i]];
        for (int l = 0; l < W; l++) {
            double of = fabs(r->dv[i * W + l]);
            size = of > size ? of : size;
        }
        most = by * size > most ? by * size : most;
    }
    return most;
}

/* Takes the order of elimination at the last anchor. */
static bool take_choice(kmp_varied_lanes *x)
{
    kmp_linear *l = &x->v->linear;
    const kmp_sensitivity_equations_place *at = &x->v->anchor[0];
    x->number = -1;
    x->closed = false;
    memset(x->a0, 0, (size_t)(x->v->n * W) * sizeof *x->a0); /* it remains zero for u */
    kmp_eval_closure(l->eval, at->t, at->q);
    if (kmp_reduction_lanes_init(&x->red, &l->red) != KEMPE_OK)
        return false;
    x->number = l->number;
    return true;
}

/* Closes v at the placed u, up to a correction of size `enough`. The Jacobian that is then factored is that before this
 * correction, and so are M and C. */
static int close_lanes(kmp_varied_lanes *x, const double *t, double enough)
{
    double last = INFINITY;
    for (int pass = 0; pass < KMP_CLOSING_PASSES; pass++) {
        const double *h = kmp_stage_lanes_run(&x->motion, KMP_STAGE_CLOSURE, t, x->q, NULL);
        x->jacobian = h + x->v->m * W;
        if (x->red.r == 0)
            return KMP_GO;
        if (!kmp_reduction_lanes_factor(&x->red, x->jacobian))
            return KMP_APART;
        kmp_reduction_lanes_solve(&x->red, h);
        double size = correction_size(x);
        bool done = size <= enough, stalled = !done && !kmp_closing_contracts(size, last);
        if (stalled && size > KMP_CLOSED_ENOUGH)
            return KMP_RETRY;
        for (int i = 0; i < x->red.r; i++)
            AT(x->q, x->red.column[i]) += OF(x->red.dv, i);
        if (done || stalled)
            return KMP_GO;
        last = size;
    }
    return KMP_RETRY;
}

static int place(kmp_varied_lanes *x, bool once, const double *t, const double *u)
{
    bool again = x->closed && memcmp(t, x->t, sizeof x->t) == 0;
    double enough = once ? KMP_CORRECTION_IN_LANES : KMP_CORRECTION_FIRST_IN_LANES;
    x->closed = false;
    if (again)
        enough = fmax(KMP_CORRECTION_IN_LANES, KMP_CORRECTION_LATER_IN_LANES * move_along(x, u));
    else
        predict(x, t, u);
    put_independent(x, u);
    return close_lanes(x, t, enough);
}

/* -- the motion ------------------------------------------------------------------------------------------ */

int kmp_varied_lanes_run(kmp_varied_lanes *x, bool once, const double *t, const double *u, const double *ud,
                         double *udd)
{
    kmp_sensitivity_equations *v = x->v;
    kmp_reduction_lanes *r = &x->red;
    int n = v->n, said = KMP_APART;
    if (x->number != v->linear.number && !take_choice(x))
        return KMP_HALT;
    for (int pass = 0; said == KMP_APART && pass < 2;
         pass++) { /* with the order of elimination here, where it is bad */
        if (pass > 0 && !take_choice(x))
            return KMP_HALT;
        said = place(x, once, t, u);
    }
    if (said != KMP_GO)
        return KMP_RETRY;
    kmp_reduction_lanes_tangent(r, x->jacobian);
    if (v->system->rheonomic)
        kmp_reduction_lanes_solve(r, x->jacobian + v->system->jacobian.count * W);
    kmp_reduction_lanes_spread(r, ud, v->system->rheonomic, x->qd);
    kmp_lanes_set(x->motion.lanes, KMP_IN_QD, x->qd);
    x->mass = kmp_lanes_run(x->motion.lanes, KMP_STAGE_MASS);
    const double *bias = kmp_lanes_run(x->motion.lanes, KMP_STAGE_BIAS);
    /* a0, C + M a0, and the accelerations that leave X' (M qdd + C) = 0. */
    kmp_reduction_lanes_solve(r, bias + n * W);
    for (int i = 0; i < r->r; i++)
        AT(x->a0, r->column[i]) = OF(r->dv, i);
    memcpy(x->force, bias, (size_t)(n * W) * sizeof *bias);
    kmp_reduction_lanes_add_mass_times(r, x->mass, x->a0, x->force);
    bool positive = kmp_reduction_lanes_reduce(r, x->mass);
    kmp_reduction_lanes_project(r, x->force, udd);
    for (int k = 0; k < r->p; k++)
        AT(udd, k) = -OF(udd, k);
    kmp_reduction_lanes_solve_mass(r, udd);
    if (!positive || !kmp_stage_lanes_finite(r->p, udd))
        return KMP_RETRY;
    memcpy(x->udd, udd, (size_t)(r->p * W) * sizeof *udd);
    memcpy(x->t, t, sizeof x->t);
    x->closed = true;
    return KMP_GO;
}

/* -- the linear equations ---------------------------------------------------------------------------------- */

/* out += block' x, at the derivatives d. */
static KMP_CLONES void add_transposed(int count, const kmp_tangent *entry, const double *d, const double *x,
                                      double *out)
{
    for (int k = 0; k < count; k++)
        AT(out, entry[k].col) += OF(d, entry[k].source) * OF(x, entry[k].row);
}

static void add_block(const kmp_varied_lanes *x, kmp_tangent_block block, const double *d, const double *from,
                      double *out)
{
    const kmp_tangents *t = &x->v->linear.tangents;
    add_transposed(t->start[block + 1] - t->start[block], t->entry + t->start[block], d, from, out);
}

/* Weights on X du - (0; Jv^-1 rows) as those on du, if requested, and on rows. */
static void gather(kmp_varied_lanes *x, const double *w, double *du, double *rows)
{
    if (du)
        kmp_reduction_lanes_project(&x->red, w, du);
    kmp_reduction_lanes_pull(&x->red, w, rows);
    for (int i = 0; i < x->v->m; i++)
        AT(rows, i) = -OF(rows, i);
}

/* b += the derivatives by parameters, weighted; row i of p. */
static KMP_CLONES void add_parameters(const kmp_varied_lanes *x, const double *value, int row, double *b)
{
    const kmp_slope_matrix *of = &x->v->slopes->equations;
    int m = x->v->m, n = x->v->n, p = x->red.p;
    const double *part[] = {x->h, x->rate, x->curve};
    for (int e = 0; e < of->count; e++) {
        const kmp_tangent *y = &of->entry[e];
        if (y->row >= 3 * m + n)
            continue;
        const double *w = y->row < 3 * m ? part[y->row / m] + (ptrdiff_t)(y->row % m) * W
                                         : x->force + (ptrdiff_t)(y->row - 3 * m) * W;
        AT(b, y->col * p + row) += OF(w, 0) * OF(value, y->source);
    }
}

/* qdd and the multipliers of the last run, then the tangents and the derivatives by parameters there. */
static void differentiate(kmp_varied_lanes *x, const double **d, const double **by)
{
    const kmp_sensitivity_equations *v = x->v;
    size_t n = (size_t)(v->n * W);
    kmp_reduction_lanes_spread(&x->red, x->udd, false, x->qdd);
    for (int i = 0; i < x->red.r; i++)
        AT(x->qdd, x->red.column[i]) += OF(x->a0, x->red.column[i]);
    /* M (qdd - a0) + C + M a0 */
    memcpy(x->wq, x->qdd, n * sizeof *x->qdd);
    for (int i = 0; i < x->red.r; i++)
        AT(x->wq, x->red.column[i]) -= OF(x->a0, x->red.column[i]);
    kmp_reduction_lanes_add_mass_times(&x->red, x->mass, x->wq, x->force);
    kmp_reduction_lanes_pull(&x->red, x->force, x->lambda);
    kmp_lanes_set(x->tangent.lanes, KMP_IN_QDD, x->qdd);
    kmp_lanes_set(x->tangent.lanes, KMP_IN_LAMBDA, x->lambda);
    *d = kmp_stage_lanes_run(&x->tangent, STAGE, x->t, x->q, x->qd);
    *by = NULL;
    if (!x->slope.lanes)
        return;
    kmp_lanes_set(x->slope.lanes, KMP_IN_QDD, x->qdd);
    kmp_lanes_set(x->slope.lanes, KMP_IN_LAMBDA, x->lambda);
    *by = kmp_stage_lanes_run(&x->slope, STAGE, x->t, x->q, x->qd);
}

void kmp_varied_lanes_matrices(kmp_varied_lanes *x, double *a, double *b)
{
    const kmp_sensitivity_equations *v = x->v;
    int p = x->red.p;
    size_t n = (size_t)(v->n * W) * sizeof(double);
    const double *d, *by;
    differentiate(x, &d, &by);
    memset(b, 0, (size_t)(p * v->count * W) * sizeof *b);
    for (int k = 0; k < p; k++) {
        /* Weights on the force: -X Mr^-1 e_k. Then as kmp_linear_back. */
        memset(x->w, 0, (size_t)(p * W) * sizeof *x->w);
        AT(x->w, k) -= 1;
        kmp_reduction_lanes_solve_mass(&x->red, x->w);
        kmp_reduction_lanes_spread(&x->red, x->w, false, x->force);
        memset(x->wq, 0, n);
        memset(x->wqd, 0, n);
        memset(x->wqdd, 0, n);
        add_block(x, KMP_M, d, x->force, x->wqdd);
        add_block(x, KMP_R_QD, d, x->force, x->wqd);
        add_block(x, KMP_R_Q, d, x->force, x->wq);
        gather(x, x->wqdd, NULL, x->curve);
        add_block(x, KMP_CURVE_QD, d, x->curve, x->wqd);
        add_block(x, KMP_CURVE_Q, d, x->curve, x->wq);
        gather(x, x->wqd, x->w, x->rate);
        for (int c = 0; c < p; c++)
            AT(a, (p + c) * p + k) = OF(x->w, c);
        add_block(x, KMP_RATE_Q, d, x->rate, x->wq);
        gather(x, x->wq, x->w, x->h);
        for (int c = 0; c < p; c++)
            AT(a, c * p + k) = OF(x->w, c);
        if (by)
            add_parameters(x, by, k, b);
    }
}
