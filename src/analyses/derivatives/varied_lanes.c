/* SPDX-License-Identifier: BSD-3-Clause */
/* States are closed by Newton's method with the Jacobian of each lane. The programs belong to the evaluator, of the
 * tangents and of the derivatives by parameters; the linear algebra between them is kmp_reduction_lanes. */
#include "analyses/derivatives/varied_lanes.h"
#include "backend/encoders.h"
#include "base/clones.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "dynamics/motion.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/formulations/formulation.h"
#include "integrators/steppers/ode.h"
#include "model/data/parameter.h"
#include <math.h>
#include <string.h>

enum { W = KMP_STAGE_LANES, STAGE = 1 /* of tangents and slopes */ };

/* Rows of the matrices at a time: their weights remain in the first cache. */
enum { VECTORS = 8 };

/* Earlier choices that are known again. */
enum { KEPT = 8 };

#define AT(p, k) KMP_EIGHT_AT((p) + (ptrdiff_t)(k)*W)
#define OF(p, k) KMP_EIGHT_CONST((p) + (ptrdiff_t)(k)*W)

/* Larger mechanisms have programs that are not worth lanes. */
enum { MOST_COORDINATES = 512 };

bool kmp_varied_lanes_suit(const kempe_system *system)
{
    bool registers = kmp_code_form_of(8) != 0;
    return registers && !system->force && system->load_row_count == 0 && kmp_model_delay_count(system->model) == 0 &&
           system->n <= MOST_COORDINATES;
}

bool kmp_varied_lanes_can(const kmp_sensitivity_equations *varied)
{
    return kmp_varied_lanes_suit(varied->system) && varied->linear.tangents.tangent.program &&
           (varied->count == 0 || varied->slopes->equations.formulas.program);
}

/* Processor cycles of an entry of a matrix times a vector in lanes, with its transfers. */
#define CYCLES_OF_ENTRY 2.5

/* The loops of linear algebra have about as many operations as in one state. */
static double cycles_by_parts(const kmp_varied_lanes *x)
{
    kmp_counts count = x->count_of_motion;
    count.paper += kmp_reduction_count(&x->v->linear.red).paper;
    return kmp_cycles_of_lanes(count, false);
}

double kmp_varied_lanes_cycles(const kmp_varied_lanes *lanes)
{
    return lanes->fused.program ? lanes->fused.cycles : cycles_by_parts(lanes);
}

double kmp_varied_lanes_matrix_cycles(const kmp_varied_lanes *lanes)
{
    const kmp_sensitivity_equations *v = lanes->v;
    const double entries = v->linear.tangents.start[KMP_TANGENT_BLOCKS] + v->slopes->equations.count;
    return cycles_by_parts(lanes) + lanes->cycles_of_tangents + CYCLES_OF_ENTRY * v->linear.p * entries;
}

/* The derivatives by parameters follow the tangents at the same places. */
static bool borrow_sines(kmp_varied_lanes *x)
{
    kmp_lanes *const of[] = {x->slope.lanes, x->sum.lanes};
    bool ok = true;
    for (size_t k = 0; k < sizeof of / sizeof *of; k++)
        ok = ok && (!of[k] || !x->tangent.lanes || kmp_lanes_borrow_sines(of[k], x->tangent.lanes));
    return ok;
}

kempe_status kmp_varied_lanes_init(kmp_varied_lanes *lanes, kmp_sensitivity_equations *varied)
{
    *lanes = (kmp_varied_lanes){.v = varied, .number = -1};
    KMP_TRY(kmp_motion_need(varied->system));
    const kmp_program *motion = varied->system->motion, *tangent = varied->linear.tangents.tangent.program,
                      *slope = varied->sum ? NULL : varied->slopes->equations.formulas.program,
                      *sum = varied->sum ? varied->sum->formulas.program : NULL;
    const kmp_evaluator *eval = varied->linear.eval;
    int n = W * varied->n, m = W * varied->m;
    const bool made = KMP_ARENA_MAKE(&lanes->arena,
                                     KMP_ROOM(double, n, &lanes->q, &lanes->qd, &lanes->qdd, &lanes->force,
                                              &lanes->drift, &lanes->a0, &lanes->u, &lanes->ud, &lanes->udd),
                                     KMP_ROOM(double, m, &lanes->lambda),
                                     KMP_ROOM(int, KEPT *(varied->n + varied->m), &lanes->written),
                                     KMP_ROOM(double, VECTORS *n, &lanes->wq, &lanes->wqd, &lanes->wqdd, &lanes->w),
                                     KMP_ROOM(double, VECTORS *(3 * m + n), &lanes->h)) &&
                      kmp_stage_lanes_init(&lanes->motion, motion, eval) &&
                      kmp_stage_lanes_init(&lanes->tangent, tangent, eval) &&
                      kmp_stage_lanes_init(&lanes->slope, slope, eval) &&
                      kmp_stage_lanes_init(&lanes->sum, sum, eval) && borrow_sines(lanes);
    /* Counts the programs, which takes as long as some evaluations. */
    lanes->count_of_motion = kmp_program_count(motion, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS);
    if (tangent)
        lanes->cycles_of_tangents += kmp_cycles_of_lanes(kmp_program_count(tangent, STAGE, STAGE), false);
    if (slope || sum)
        lanes->cycles_of_tangents += kmp_cycles_of_lanes(kmp_program_count(slope ? slope : sum, STAGE, STAGE), false);
    return kmp_made(varied->system->context, made);
}

KMP_CLEARS(kmp_varied_lanes, lanes, kmp_fused_lanes_free(&lanes->fused), kmp_stage_lanes_free(&lanes->motion),
           kmp_stage_lanes_free(&lanes->tangent), kmp_stage_lanes_free(&lanes->slope),
           kmp_stage_lanes_free(&lanes->sum), kmp_reduction_lanes_free(&lanes->red), kmp_arena_free(&lanes->arena))

kempe_status kmp_varied_lanes_expect(kmp_varied_lanes *lanes, const int *wish, int wish_count)
{
    kmp_sensitivity_equations *v = lanes->v;
    kmp_linear *l = &v->linear;
    kempe_context *context = v->system->context;
    kempe_assembly *start = NULL;
    kmp_partition part;
    const bool quiet = kmp_context_quiet(context, true);
    kempe_status status = kmp_assembly_at_start(v->system, &start);
    if (status == KEMPE_OK) {
        kmp_eval_closure(l->eval, 0, start->q);
        status = kmp_partition_init(&part, v->system, l->eval->jacobian, wish, wish_count);
    }
    if (status == KEMPE_OK)
        status = kmp_sensitivity_equations_take(v, 0, start->q, &part);
    if (status == KEMPE_OK)
        status = kmp_fused_lanes_init(&lanes->fused, &l->red);
    kempe_assembly_free(start);
    (void)kmp_context_quiet(context, quiet);
    if (status != KEMPE_OK && status != KEMPE_E_MEMORY) {
        kmp_context_clear(context); /* the run says why */
        return KEMPE_OK;
    }
    return status;
}

void kmp_varied_lanes_begin(kmp_varied_lanes *lanes)
{
    const kmp_evaluator *eval = lanes->v->linear.eval;
    kmp_stage_lanes_take(&lanes->motion, eval);
    kmp_stage_lanes_take(&lanes->tangent, eval);
    kmp_stage_lanes_take(&lanes->slope, eval);
    kmp_stage_lanes_take(&lanes->sum, eval);
    lanes->number = -1;
    lanes->lasted = KMP_FORMULATION_BRIEF;
    lanes->writings = 0;
    lanes->closed = false;
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
        for (int i = 0; r->full_of[c] >= 0 && i < r->r; i++)
            AT(x->q, r->column[i]) += OF(r->bvu, i * r->full + r->full_of[c]) * du;
        for (int l = 0; l < W; l++)
            size = du[l] > size ? du[l] : -du[l] > size ? -du[l] : size;
        size /= x->v->system->scale[x->v->linear.part.u[c]];
        most = size > most ? size : most;
    }
    return most;
}

/* Takes the order of elimination at the last anchor. */
static bool take_order(kmp_varied_lanes *x)
{
    kmp_linear *l = &x->v->linear;
    const kmp_sensitivity_equations_place *at = &x->v->anchor[0];
    x->closed = false;
    memset(x->a0, 0, (size_t)(x->v->n * W) * sizeof *x->a0); /* they remain zero for u */
    memset(x->drift, 0, (size_t)(x->v->n * W) * sizeof *x->drift);
    kmp_eval_closure(l->eval, at->t, at->q);
    return kmp_reduction_lanes_init(&x->red, &l->red, VECTORS) == KEMPE_OK;
}

/* The place of a choice among the choices whose programs were written in this run, which the system keeps. */
static int *written_at(const kmp_varied_lanes *x, int k)
{
    return x->written + (ptrdiff_t)(k % KEPT) * (x->v->n + x->v->m);
}

static bool was_written(const kmp_varied_lanes *x)
{
    const kmp_partition *part = &x->v->linear.part;
    bool found = false;
    for (int k = 0; k < KEPT && k < x->writings; k++) {
        const int *at = written_at(x, k);
        found = found || (memcmp(at, part->rows, (size_t)part->r * sizeof *at) == 0 &&
                          memcmp(at + part->r, part->u, (size_t)part->p * sizeof *at) == 0);
    }
    return found;
}

/* Takes the present choice of u. A program is due where the choice before has lasted, or this one returns. */
static bool take_choice(kmp_varied_lanes *x)
{
    kmp_fused_lanes_free(&x->fused);
    x->due = x->lasted >= KMP_FORMULATION_BRIEF || was_written(x);
    x->lasted = 0;
    x->number = -1;
    if (!take_order(x))
        return false;
    x->number = x->v->linear.number;
    return true;
}

/* Writes the program where it is due, or its charts are not the present ones. */
static bool renew_fused(kmp_varied_lanes *x)
{
    x->due = x->due || (x->fused.program && !kmp_fused_lanes_applies(&x->fused));
    if (!x->due)
        return true;
    const kmp_sensitivity_equations_place *at = &x->v->anchor[0];
    x->due = x->closed = false;
    kmp_eval_closure(x->v->linear.eval, at->t, at->q);
    kmp_fused_lanes_free(&x->fused);
    if (!was_written(x)) {
        const kmp_partition *part = &x->v->linear.part;
        int *to = written_at(x, x->writings++);
        memcpy(to, part->rows, (size_t)part->r * sizeof *to);
        memcpy(to + part->r, part->u, (size_t)part->p * sizeof *to);
    }
    return kmp_fused_lanes_init(&x->fused, &x->v->linear.red) == KEMPE_OK;
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
        const kmp_closing_move move =
            kmp_fused_lanes_correct(x->red.r, x->red.dv, x->red.column, x->v->system->scale, enough, &last, x->q);
        if (move != KMP_CLOSING_GOES)
            return move == KMP_CLOSING_ENDS ? KMP_GO : KMP_RETRY;
    }
    return KMP_RETRY;
}

/* The correction of v at which sweeps later than the first end, after a change of u. */
static double enough_after(double moved)
{
    return fmax(KMP_CORRECTION_IN_LANES, KMP_CORRECTION_LATER_IN_LANES * moved);
}

static bool is_again(const kmp_varied_lanes *x, const double *t)
{
    return x->closed && memcmp(t, x->t, sizeof x->t) == 0;
}

static int place(kmp_varied_lanes *x, bool once, const double *t, const double *u)
{
    bool again = is_again(x, t) && x->whole;
    x->closed = false;
    const double moved = again ? move_along(x, u) : 0;
    if (!again)
        predict(x, t, u);
    const kmp_partition *part = &x->v->linear.part;
    for (int k = 0; k < part->p; k++)
        AT(x->q, part->u[k]) = OF(u, k);
    return close_lanes(x, t,
                       once    ? KMP_CORRECTION_IN_LANES
                       : again ? enough_after(moved)
                               : KMP_CORRECTION_FIRST_IN_LANES);
}

/* -- the motion ------------------------------------------------------------------------------------------ */

/* By the program. */
static int run_fused(kmp_varied_lanes *x, const double *t, const double *u, const double *ud, double *udd)
{
    bool again = is_again(x, t) && !x->whole;
    x->closed = false;
    const double moved = again ? kmp_fused_lanes_move(&x->fused, u, x->q) : 0;
    if (!again)
        predict(x, t, u);
    return kmp_fused_lanes_run(&x->fused, again ? enough_after(moved) : KMP_CORRECTION_FIRST_IN_LANES, t, u, ud, x->q,
                               udd);
}

/* By parts, at the closed q. */
static int accelerate(kmp_varied_lanes *x, const double *ud, double *udd)
{
    kmp_sensitivity_equations *v = x->v;
    kmp_reduction_lanes *r = &x->red;
    const int n = v->n;
    kmp_reduction_lanes_tangent(r, x->jacobian);
    kmp_reduction_lanes_spread(r, 1, ud, x->qd);
    if (v->system->rheonomic)
        kmp_reduction_lanes_solve(r, x->jacobian + v->system->jacobian.count * W);
    for (int i = 0; v->system->rheonomic && i < r->r; i++) {
        AT(x->drift, r->column[i]) = OF(r->dv, i);
        AT(x->qd, r->column[i]) += OF(r->dv, i);
    }
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
    kmp_reduction_lanes_project(r, 1, x->force, udd);
    for (int k = 0; k < r->p; k++)
        AT(udd, k) = -OF(udd, k);
    kmp_reduction_lanes_solve_mass(r, 1, udd);
    return positive && kmp_stage_lanes_finite(r->p, udd) ? KMP_GO : KMP_RETRY;
}

static int run_by_parts(kmp_varied_lanes *x, bool once, const double *t, const double *u, const double *ud, double *udd)
{
    int said = place(x, once, t, u);
    if (said == KMP_APART) /* the order of elimination is bad here */
        said = take_order(x) ? place(x, once, t, u) : KMP_HALT;
    return said == KMP_GO ? accelerate(x, ud, udd) : said == KMP_HALT ? KMP_HALT : KMP_RETRY;
}

int kmp_varied_lanes_run(kmp_varied_lanes *x, bool once, const double *t, const double *u, const double *ud,
                         double *udd)
{
    if (x->number != x->v->linear.number && !take_choice(x))
        return KMP_HALT;
    if (!once && !renew_fused(x))
        return KMP_HALT;
    x->lasted += !is_again(x, t);
    int said = !once && x->fused.program ? run_fused(x, t, u, ud, udd) : KMP_APART;
    x->whole = said == KMP_APART;
    if (said == KMP_APART)
        said = run_by_parts(x, once, t, u, ud, udd);
    if (said != KMP_GO)
        return said;
    size_t half = (size_t)(x->red.p * W) * sizeof *u;
    memcpy(x->u, u, half);
    memcpy(x->ud, ud, half);
    memcpy(x->udd, udd, half);
    memcpy(x->t, t, sizeof x->t);
    x->closed = true;
    return KMP_GO;
}

/* Finds what the program leaves out, at the places of the last run, which it has closed. */
static int complete(kmp_varied_lanes *x)
{
    if (x->whole)
        return KMP_GO;
    int said = close_lanes(x, x->t, KMP_CORRECTION_FIRST_IN_LANES);
    if (said == KMP_GO)
        said = accelerate(x, x->ud, x->udd);
    else if (said == KMP_APART)
        said = run_by_parts(x, false, x->t, x->u, x->ud, x->udd);
    x->whole = x->closed = said == KMP_GO;
    return said == KMP_APART ? KMP_RETRY : said;
}

bool kmp_varied_lanes_last(const kmp_varied_lanes *x, double t, double *q)
{
    enum { LAST = W - 1 };
    if (!x->closed || x->number != x->v->linear.number || t < x->t[LAST] || t > x->t[LAST])
        return false;
    for (int i = 0; i < x->v->n; i++)
        q[i] = x->q[i * W + LAST];
    return true;
}

/* As kmp_fused_lanes_place, by parts. */
static void place_by_parts(const kmp_varied_lanes *x, int lane, double *drift, double *curve, double *tangent)
{
    const kmp_reduction_lanes *r = &x->red;
    const int n = x->v->n;
    for (int i = 0; i < n; i++) {
        drift[i] = x->drift[i * W + lane];
        curve[i] = x->a0[i * W + lane];
    }
    memset(tangent, 0, (size_t)(n * r->p) * sizeof *tangent);
    for (int c = 0; c < r->p; c++) {
        tangent[x->v->linear.part.u[c] + c * n] = 1;
        for (int i = 0; r->full_of[c] >= 0 && i < r->r; i++)
            tangent[r->column[i] + c * n] = r->bvu[(i * r->full + r->full_of[c]) * W + lane];
    }
}

void kmp_varied_lanes_anchor(const kmp_varied_lanes *x, int lane)
{
    const int n = x->v->n;
    kmp_sensitivity_equations_place *at = kmp_sensitivity_equations_next_anchor(x->v);
    at->t = x->t[lane];
    for (int i = 0; i < n; i++)
        at->q[i] = x->q[i * W + lane];
    if (x->whole)
        place_by_parts(x, lane, at->drift, at->drift + n, at->drift + 2 * n);
    else
        kmp_fused_lanes_place(&x->fused, lane, at->drift, at->drift + n, at->drift + 2 * n);
}

/* -- the linear equations ---------------------------------------------------------------------------------- */

/* out += block' x, at the derivatives d, of `count` vectors side by side. */
static KMP_CLONES void add_transposed(int entries, const kmp_tangent *entry, const double *d, int count,
                                      const double *x, double *out)
{
    for (int e = 0; e < entries; e++) {
        const kmp_eight by = OF(d, entry[e].source);
        const double *from = x + (ptrdiff_t)(entry[e].row * count) * W;
        double *to = out + (ptrdiff_t)(entry[e].col * count) * W;
        for (int c = 0; c < count; c++)
            AT(to, c) += by * OF(from, c);
    }
}

static void add_block(const kmp_varied_lanes *x, kmp_tangent_block block, const double *d, int count,
                      const double *from, double *out)
{
    const kmp_tangents *t = &x->v->linear.tangents;
    add_transposed(t->start[block + 1] - t->start[block], t->entry + t->start[block], d, count, from, out);
}

/* b = the derivatives by parameters, weighted, in the rows from `row` on. */
static KMP_CLONES void put_parameters(const kmp_varied_lanes *x, int row, int count, double *b)
{
    const kmp_slope_matrix *of = &x->v->slopes->equations;
    const int p = x->red.p, rows = 3 * x->v->m + x->v->n; /* x->h, rate, curve and weights are one after the other */
    for (int k = 0; k < x->v->count; k++)
        for (int c = 0; c < count; c++) {
            kmp_eight sum = {0};
            for (int e = of->start[k]; e < of->start[k + 1]; e++)
                if (of->entry[e].row < rows)
                    sum += OF(x->h, of->entry[e].row * count + c) * OF(x->by, of->entry[e].source);
            AT(b, k * p + row + c) = sum;
        }
}

/* A program at the places of the last run. */
static const double *run_there(kmp_varied_lanes *x, kmp_stage_lanes *program)
{
    kmp_lanes_set(program->lanes, KMP_IN_QDD, x->qdd);
    kmp_lanes_set(program->lanes, KMP_IN_LAMBDA, x->lambda);
    return kmp_stage_lanes_run(program, STAGE, x->t, x->q, x->qd);
}

/* Puts weights on columns of a (p) in rows from `row` on, of `count` vectors. */
static void put_rows(const kmp_varied_lanes *x, int row, int count, double *a)
{
    for (int c = 0; c < x->red.p; c++)
        memcpy(a + (ptrdiff_t)(c * x->red.p + row) * W, x->w + (ptrdiff_t)(c * count) * W,
               (size_t)(count * W) * sizeof *a);
}

/* From weights x->w on -udd the weights on changes of the equations, as kmp_linear_back has them from weights X Mr^-1 w
 * on the force, and rows of a (NULL: not requested). */
static void go_back(kmp_varied_lanes *x, int row, int count, double *a)
{
    const kmp_sensitivity_equations *v = x->v;
    const double *d = x->d;
    int p = x->red.p;
    size_t n = (size_t)(v->n * count * W) * sizeof(double);
    const ptrdiff_t m = (ptrdiff_t)v->m * count * W;
    x->rate = x->h + m;
    x->curve = x->rate + m;
    x->weights = x->curve + m;
    kmp_reduction_lanes_solve_mass(&x->red, count, x->w);
    kmp_reduction_lanes_spread(&x->red, count, x->w, x->weights);
    memset(x->wq, 0, n);
    memset(x->wqd, 0, n);
    memset(x->wqdd, 0, n);
    add_block(x, KMP_M, d, count, x->weights, x->wqdd);
    add_block(x, KMP_R_QD, d, count, x->weights, x->wqd);
    add_block(x, KMP_R_Q, d, count, x->weights, x->wq);
    kmp_reduction_lanes_pull(&x->red, count, -1, x->wqdd, x->curve);
    add_block(x, KMP_CURVE_QD, d, count, x->curve, x->wqd);
    add_block(x, KMP_CURVE_Q, d, count, x->curve, x->wq);
    if (a) {
        kmp_reduction_lanes_project(&x->red, count, x->wqd, x->w);
        put_rows(x, row, count, a + (ptrdiff_t)(p * p) * W);
    }
    kmp_reduction_lanes_pull(&x->red, count, -1, x->wqd, x->rate);
    add_block(x, KMP_RATE_Q, d, count, x->rate, x->wq);
    if (a) {
        kmp_reduction_lanes_project(&x->red, count, x->wq, x->w);
        put_rows(x, row, count, a);
    }
    kmp_reduction_lanes_pull(&x->red, count, -1, x->wq, x->h);
}

static void find_rows(kmp_varied_lanes *x, int row, int count, double *a, double *b)
{
    int p = x->red.p;
    memset(x->w, 0, (size_t)(p * count * W) * sizeof *x->w);
    for (int k = 0; k < count; k++)
        AT(x->w, (row + k) * count + k) -= 1;
    go_back(x, row, count, a);
    if (x->by && b)
        put_parameters(x, row, count, b);
}

int kmp_varied_lanes_matrices(kmp_varied_lanes *x, double *a, double *b)
{
    int p = x->red.p, said = complete(x);
    if (said != KMP_GO)
        return said;
    /* qdd and the multipliers of the last run, then the tangents and the derivatives by parameters there. */
    /* M X udd + C + M a0 */
    kmp_reduction_lanes_spread(&x->red, 1, x->udd, x->qdd);
    kmp_reduction_lanes_add_mass_times(&x->red, x->mass, x->qdd, x->force);
    kmp_reduction_lanes_pull(&x->red, 1, 1, x->force, x->lambda);
    for (int i = 0; i < x->red.r; i++)
        AT(x->qdd, x->red.column[i]) += OF(x->a0, x->red.column[i]);
    x->d = run_there(x, &x->tangent);
    x->by = x->slope.lanes ? run_there(x, &x->slope) : NULL;
    if (b && !x->by)
        memset(b, 0, (size_t)(p * x->v->count * W) * sizeof *b);
    for (int row = 0; row < p; row += VECTORS)
        find_rows(x, row, p - row < VECTORS ? p - row : VECTORS, a, b);
    return KMP_GO;
}

void kmp_varied_lanes_weigh(kmp_varied_lanes *x, const double *weights, double *out)
{
    for (int k = 0; k < x->red.p; k++)
        AT(x->w, k) = -OF(weights, k);
    go_back(x, 0, 1, NULL);
    if (!x->sum.lanes)
        return;
    kmp_lanes_set(x->sum.lanes, KMP_IN_ALONG, x->h); /* and the other weights, which follow it */
    memcpy(out, run_there(x, &x->sum), (size_t)(x->v->sum->count * W) * sizeof *out);
}
