/* SPDX-License-Identifier: BSD-3-Clause */
/* Linearisation about a state by the chain rule: tangents of the equations along each change of u, ud and udd, reduced
 * by N = dq/du (linearized.h). Tangents are evaluated as numbers, and derived as expressions once they are used often.
 */
#include "analyses/derivatives/linearized.h"
#include "analyses/parts/closed_state.h"
#include "analyses/parts/doubted_state.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/few_tangents.h"
#include "linalg/dense/dot.h"
#include "model/data/body.h"
#include "model/data/state.h"
#include "model/read/read_mass.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <string.h>

kempe_status kmp_linear_init(kmp_linear *linear, const kempe_system *system, const char *backend)
{
    *linear = (kmp_linear){.system = system, .n = system->n, .m = system->m};
    linear->eval = kmp_eval_new(system, backend);
    if (!linear->eval)
        return KEMPE_E_MEMORY;
    const int n = linear->n, m = linear->m;
    const bool made = KMP_ARENA_MAKE(
        &linear->arena, KMP_ROOM(double, n, &linear->q, &linear->qd, &linear->qdd, &linear->force, &linear->unit),
        KMP_ROOM(double, m, &linear->lambda), KMP_ROOM(double, KMP_FOLLOW_ROOM(n, m), &linear->work));
    kempe_status status = kmp_made(system->context, made);
    if (status == KEMPE_OK)
        status = kmp_tangents_init_few(&linear->tangents, system, linear->eval->backend);
    if (status != KEMPE_OK)
        kmp_linear_free(linear);
    return status;
}

static void forget_choice(kmp_linear *l)
{
    kmp_arena_free(&l->choice);
    l->inertia = l->pressed = NULL;
    if (l->chosen)
        kmp_reduction_free(&l->red);
    kmp_partition_free(&l->part);
    l->part = (kmp_partition){0};
    l->chosen = false;
}

void kmp_linear_free(kmp_linear *linear)
{
    forget_choice(linear);
    kmp_tangents_free(&linear->tangents);
    kmp_eval_free(linear->eval);
    kmp_arena_free(&linear->arena);
    *linear = (kmp_linear){0};
}

void kmp_linear_renew_parameters(kmp_linear *linear)
{
    kmp_eval_renew_parameters(linear->eval);
    kmp_tangents_renew_parameters(&linear->tangents, linear->system->parameters);
}

kempe_status kmp_linear_vary(kmp_linear *linear, kempe_system *system, kmp_variant *variant, const double *values)
{
    kmp_text why = {0};
    kempe_status status = kmp_variant_set(variant, values, &why);
    if (status == KEMPE_OK && !kmp_system_rescale(system))
        status = kmp_fail_memory(system->context);
    if (status == KEMPE_OK)
        status = kmp_check_masses(kmp_variant_model(variant));
    if (status == KEMPE_E_INPUT)
        status = why.s ? kmp_fail(system->context, KEMPE_E_FAILED, "%s", why.s) : KEMPE_E_FAILED;
    kmp_text_free(&why);
    if (status == KEMPE_OK && linear->eval)
        kmp_linear_renew_parameters(linear);
    return status;
}

kempe_status kmp_linear_choose(kmp_linear *linear, double t, const double *q, const int *wish, int wish_count)
{
    kmp_partition part;
    forget_choice(linear);
    kmp_eval_closure(linear->eval, t, q);
    KMP_TRY(kmp_partition_init(&part, linear->system, linear->eval->jacobian, wish, wish_count));
    return kmp_linear_take(linear, &part);
}

kempe_status kmp_linear_prefer(kmp_linear *linear, double t, const double *q, int count, const int *liked)
{
    const kempe_system *s = linear->system;
    bool *wanted = KMP_NEW(bool, s->n);
    int *u = KMP_NEW(int, s->n), found = -1;
    for (int k = 0; wanted && k < count; k++)
        wanted[liked[k]] = true;
    kmp_eval_closure(linear->eval, t, q);
    if (wanted && u)
        found = kmp_partition_prefer(s, linear->eval->jacobian, wanted, u);
    kempe_status status = found < 0 ? kmp_fail_memory(s->context) : kmp_linear_choose(linear, t, q, u, found);
    kmp_free(wanted);
    kmp_free(u);
    return status;
}

int kmp_linear_place(const kmp_linear *linear, int coordinate)
{
    for (int k = 0; k < linear->p; k++)
        if (linear->part.u[k] == coordinate)
            return k;
    return -1;
}

void kmp_linear_lend(kmp_linear *linear, kmp_evaluator *eval)
{
    forget_choice(linear);
    linear->eval = eval;
}

kempe_status kmp_linear_take(kmp_linear *linear, kmp_partition *part)
{
    const kempe_system *s = linear->system;
    forget_choice(linear);
    linear->number++;
    linear->part = *part;
    *part = (kmp_partition){0};
    int p = linear->p = linear->part.p;
    kmp_arena *a = &linear->choice;
    if (s->load_row_count > 0)
        KMP_ARENA_MAKE(a, KMP_ROOM(double, p *p, &linear->pressed, &linear->inertia), KMP_ROOM(int, p, &linear->pivot));
    KMP_TRY(kmp_made(s->context,
                     KMP_ARENA_MAKE(a, KMP_ROOM(double, p, &linear->residual),
                                    KMP_ROOM(double, p *p, &linear->mass, &linear->damping, &linear->stiffness))));
    kempe_status status = kmp_reduction_init(&linear->red, linear->eval, &linear->part);
    linear->chosen = status == KEMPE_OK;
    return status;
}

/* -- the state --------------------------------------------------------------------------------------- */

kempe_status kmp_linear_close(kmp_linear *l, double t, const double *q, const double *ud)
{
    kmp_evaluator *eval = l->eval;
    l->t = t;
    memcpy(l->q, q, (size_t)l->n * sizeof *q);
    memset(l->qd, 0, (size_t)l->n * sizeof *l->qd);
    if (!l->held)
        kmp_eval_unfreeze(eval);
    if (kmp_reduction_close(&l->red, t, l->q, NULL, 0))
        return KEMPE_E_FAILED;
    kmp_eval_closure(eval, t, l->q);
    if (!kmp_rounding_closed(eval) || kmp_reduction_factor(&l->red))
        return KEMPE_E_FAILED;
    kmp_reduction_tangent(&l->red);
    memset(l->work, 0, (size_t)l->p * sizeof *l->work);
    kmp_reduction_rates(&l->red, ud ? ud : l->work, l->qd);
    if (!l->held) {
        kmp_eval_freeze(eval, t, l->q, l->qd);
        kmp_eval_closure(eval, t, l->q);
    }
    return KEMPE_OK;
}

/* q closed, qd, M and C there, with the conditions of the state. */
static kempe_status place(kmp_linear *l, double t, const double *q, const double *ud)
{
    KMP_TRY(kmp_linear_close(l, t, q, ud));
    kmp_eval_mass(l->eval);
    kmp_eval_bias(l->eval, l->qd);
    return KEMPE_OK;
}

void kmp_linear_derive(kmp_linear *linear)
{
    kmp_tangents derived;
    if (!linear->tangents.numbers)
        return;
    if (kmp_tangents_init(&derived, linear->system, linear->eval->backend, kmp_tangents_of_runs(linear->system)) !=
        KEMPE_OK) {
        kmp_context_clear(linear->system->context);
        return;
    }
    kmp_tangents_free(&linear->tangents);
    linear->tangents = derived;
}

void kmp_linear_doubt_state(const kmp_linear *l, bool rates)
{
    kmp_eval_doubt_state(l->eval, l->t, l->q, l->qd, l->qdd, l->lambda, true, rates,
                         l->system->use_count > 0 ? kmp_eval_shown(l->eval, l->t, l->q, l->qd, l->qdd, l->lambda)
                                                  : NULL);
}

kmp_instant kmp_linear_instant(const kmp_linear *l)
{
    return kmp_instant_of(l->eval, l->t, l->q, l->qd, l->qdd, l->lambda);
}

/* Deriving the tangents takes as long as some hundred evaluations number by number. */
enum { WORTH = 200 };

/* Quantities that follow from qdd, and the tangents. */
static void complete(kmp_linear *l)
{
    kmp_reduction_multipliers(&l->red, l->qdd, l->lambda);
    memcpy(l->force, l->red.force, (size_t)l->n * sizeof *l->force);
    if (l->plain)
        return;
    if (++l->looks == WORTH)
        kmp_linear_derive(l);
    (void)kmp_reduction_load_factor(&l->red, false); /* the state was reached with this factorisation */
    kmp_instant at = kmp_linear_instant(l);
    l->d = kmp_tangents_derivatives(&l->tangents, &at);
    l->factored = false;
}

kempe_status kmp_linear_at(kmp_linear *linear, double t, const double *q, const double *ud, const double *udd)
{
    KMP_TRY(place(linear, t, q, ud));
    double *rest = linear->work; /* set to zero, if requested */
    memset(rest, 0, (size_t)linear->p * sizeof *rest);
    kmp_reduction_residual(&linear->red, udd ? udd : rest, linear->residual);
    kmp_reduction_accelerations(&linear->red, udd ? udd : rest, linear->qdd);
    complete(linear);
    return KEMPE_OK;
}

kempe_status kmp_linear_residual_at(kmp_linear *linear, double t, const double *q, const double *ud)
{
    const bool plain = linear->plain;
    linear->plain = true;
    kempe_status status = kmp_linear_at(linear, t, q, ud, NULL);
    linear->plain = plain;
    return status;
}

kempe_status kmp_linear_at_motion(kmp_linear *linear, double t, const double *q, const double *ud)
{
    KMP_TRY(place(linear, t, q, ud));
    if (kmp_reduction_accelerate(&linear->red, linear->residual))
        return KEMPE_E_FAILED;
    kmp_reduction_accelerations(&linear->red, linear->residual, linear->qdd);
    memset(linear->residual, 0, (size_t)linear->p * sizeof *linear->residual);
    complete(linear);
    return KEMPE_OK;
}

kempe_status kmp_linear_at_rates(kmp_linear *linear, double t, const double *q, const double *qd, bool motion)
{
    double *ud = linear->unit;
    for (int k = 0; k < linear->p; k++)
        ud[k] = qd[linear->part.u[k]];
    return motion ? kmp_linear_at_motion(linear, t, q, ud) : kmp_linear_at(linear, t, q, ud, NULL);
}

/* -- small changes ----------------------------------------------------------------------------------- */

void kmp_linear_follow(kmp_linear *linear, const kmp_change *change, const kmp_response *response)
{
    kmp_follow(&linear->red, &linear->tangents, linear->d, false, change, response, linear->work);
}

/* Factors of Mr, including the response of the multipliers to accelerations. */
static void factor_pressed(kmp_linear *linear)
{
    const int p = linear->p;
    if (!linear->pressed || linear->factored)
        return;
    memset(linear->unit, 0, (size_t)linear->n * sizeof *linear->unit);
    for (int k = 0; k < p; k++) {
        linear->unit[k] = 1;
        kmp_linear_follow(linear, &(kmp_change){.udd = linear->unit},
                          &(kmp_response){.residual = linear->pressed + k * p});
        linear->unit[k] = 0;
    }
    if (kmp_lu_factor(p, linear->pressed, linear->pivot)) /* such a state has no accelerations */
        for (int k = 0; k < p; k++)
            linear->pivot[k] = k;
    linear->factored = true;
}

void kmp_linear_accelerate_back(kmp_linear *linear, const double *udd, double *residual)
{
    if (!linear->pressed) { /* Mr is symmetric */
        kmp_linear_accelerate(linear, udd, residual);
        return;
    }
    factor_pressed(linear);
    for (int k = 0; k < linear->p; k++)
        residual[k] = -udd[k];
    kmp_lu_solve_transposed(linear->p, linear->pressed, linear->pivot, residual);
}

void kmp_linear_accelerate(kmp_linear *linear, const double *residual, double *udd)
{
    factor_pressed(linear);
    for (int k = 0; k < linear->p; k++)
        udd[k] = -residual[k];
    if (linear->pressed)
        kmp_lu_solve(linear->p, linear->pressed, linear->pivot, 1, udd);
    else
        kmp_reduction_solve_mass(&linear->red, udd);
}

/* -- backwards --------------------------------------------------------------------------------------- */

/* Weights on out = X du - (0; Jv^-1 rows), as effects on du and rows (all m, of which others are zero). */
static void gather(kmp_linear *l, const double *w, double *du, double *rows)
{
    kmp_reduction *red = &l->red;
    for (int k = 0; k < l->p; k++)
        du[k] = kmp_dot(l->n, red->x + k * l->n, w);
    kmp_reduction_pull(red, w, rows);
    for (int r = 0; r < l->m; r++)
        rows[r] = -rows[r];
}

/* out += block' * x, for the derivatives `d` last evaluated. */
static void add_transposed(const kmp_tangents *tangents, kmp_tangent_block block, const double *d, const double *x,
                           double *out)
{
    for (int k = tangents->start[block]; k < tangents->start[block + 1]; k++) {
        const kmp_tangent *e = &tangents->entry[k];
        if (x[e->row] != 0) /* a derivative without weight may be none */
            out[e->col] += d[e->source] * x[e->row];
    }
}

void kmp_linear_back(kmp_linear *linear, const kmp_weights *weights, const kmp_changes_weight *back)
{
    int n = linear->n;
    const kmp_tangents *t = &linear->tangents;
    const double *d = linear->d;
    double *q = linear->work + n, *qd = linear->work + 2 * n, *qdd = linear->work + 3 * n;
    kmp_copy_or_zero(n, weights->q, q);
    kmp_copy_or_zero(n, weights->qd, qd);
    kmp_copy_or_zero(n, weights->qdd, qdd);
    /* On the force M qdd + C - J' lambda, from effects on R = X' force and on lambda = Jv'^-1 force_v. */
    kmp_reduction *red = &linear->red;
    memset(back->force, 0, (size_t)linear->n * sizeof *back->force);
    for (int k = 0; weights->residual && k < linear->p; k++)
        for (int i = 0; i < linear->n; i++)
            back->force[i] += red->x[i + k * linear->n] * weights->residual[k];
    if (weights->lambda)
        kmp_reduction_push_in(red, 1, weights->lambda, red->room, back->force);
    kmp_reduction_load_change_back(red, back->h, back->force);
    add_transposed(t, KMP_M, d, back->force, qdd);
    add_transposed(t, KMP_R_QD, d, back->force, qd);
    add_transposed(t, KMP_R_Q, d, back->force, q);
    gather(linear, qdd, back->udd, back->curve);
    add_transposed(t, KMP_CURVE_QD, d, back->curve, qd);
    add_transposed(t, KMP_CURVE_Q, d, back->curve, q);
    gather(linear, qd, back->ud, back->rate);
    add_transposed(t, KMP_RATE_Q, d, back->rate, q);
    gather(linear, q, back->u, back->h);
}

void kmp_linear_inertia(kmp_linear *l)
{
    int n = l->n, p = l->p;
    for (int k = 0; l->inertia && k < p; k++) {
        memset(l->work, 0, (size_t)n * sizeof *l->work);
        kmp_tangents_add(&l->tangents, KMP_M, l->d, 1, l->red.x + k * n, l->work);
        /* X' work as sums over the entries of `work` that are not zero: few where parts share no inertia. */
        double *column = l->inertia + (ptrdiff_t)k * p;
        memset(column, 0, (size_t)p * sizeof *column);
        for (int j = 0; j < n; j++)
            for (int i = 0; l->work[j] != 0 && i < p; i++)
                column[i] += l->red.x[j + (ptrdiff_t)i * n] * l->work[j];
    }
}

void kmp_linear_matrices(kmp_linear *linear)
{
    int p = linear->p;
    double *unit = linear->unit;
    memset(unit, 0, (size_t)linear->n * sizeof *unit);
    for (int k = 0; k < p; k++) {
        unit[k] = 1;
        kmp_linear_follow(linear, &(kmp_change){.u = unit}, &(kmp_response){.residual = linear->stiffness + k * p});
        kmp_linear_follow(linear, &(kmp_change){.ud = unit}, &(kmp_response){.residual = linear->damping + k * p});
        kmp_linear_follow(linear, &(kmp_change){.udd = unit}, &(kmp_response){.residual = linear->mass + k * p});
        unit[k] = 0;
    }
    kmp_linear_inertia(linear);
}

/* The column of a spectrum of zeros that is the integral of a state; -1: none. */
static int find_integral(const kmp_spectrum *s, int place)
{
    for (int c = 0; c < s->zeros; c++) {
        bool alone = s->x_re[place + c * s->p] != 0;
        for (int i = 0; alone && i < s->p; i++)
            alone = i == place || s->x_re[i + c * s->p] == 0;
        if (alone)
            return c;
    }
    return -1;
}

static void remove_column(kmp_spectrum *s, int c)
{
    size_t p = (size_t)s->p, at = (size_t)c, after = (size_t)(s->count - 1 - c);
    double *const values[] = {s->re, s->im}, *const vectors[] = {s->x_re, s->x_im, s->y_re, s->y_im};
    for (size_t k = 0; k < sizeof values / sizeof *values; k++)
        memmove(values[k] + at, values[k] + at + 1, after * sizeof(double));
    for (size_t k = 0; k < sizeof vectors / sizeof *vectors; k++)
        memmove(vectors[k] + at * p, vectors[k] + (at + 1) * p, after * p * sizeof(double));
    s->still -= c < s->still;
    s->zeros--;
    s->count--;
    if (s->zeros > 0 && s->still == 0)
        s->still = 1; /* a repeated one takes its place */
}

int kmp_linear_moving(const kmp_linear *linear, int *place)
{
    int count = 0;
    for (int k = 0; k < linear->p; k++) {
        const kmp_state *state = kmp_state_of(linear->system->model, linear->part.u[k]);
        if (state && state->held)
            continue;
        if (place)
            place[count] = k;
        count++;
    }
    return count;
}

void kmp_linear_squeeze(int rows, int row_count, const int *row, int column_count, const int *column,
                        const double *from, double *to)
{
    for (int j = 0; j < column_count; j++)
        for (int i = 0; i < row_count; i++)
            *to++ = from[(row ? row[i] : i) + (ptrdiff_t)(column ? column[j] : j) * rows];
}

int kmp_linear_entries(const kmp_linear *l, int *place)
{
    int width = 0;
    for (int k = 0; k < 2 * l->p; k++) {
        const kmp_state *state = kmp_state_of(l->system->model, l->part.u[k % l->p]);
        if (!state || (k >= l->p && !state->held))
            place[width++] = k;
    }
    return width;
}

int kmp_linear_first_order(const kmp_linear *l, int width, const int *place, double *a)
{
    const int p = l->p;
    double *lu = KMP_NEW(double, (ptrdiff_t)p *p), *work = KMP_NEW(double, p);
    int *pivot = KMP_NEW(int, p), failed = lu && work && pivot ? 0 : -1;
    if (failed == 0)
        failed = kmp_lu_factor(p, memcpy(lu, l->mass, (size_t)p * (size_t)p * sizeof *lu), pivot) ? -3 : 0;
    for (int j = 0; failed == 0 && j < width; j++) {
        const int from = place[j];
        const double *column = from < p ? l->stiffness + (ptrdiff_t)from * p : l->damping + (ptrdiff_t)(from - p) * p;
        for (int i = 0; i < p; i++)
            work[i] = -column[i];
        kmp_lu_solve(p, lu, pivot, 1, work);
        for (int i = 0; i < width; i++)
            a[i + (ptrdiff_t)j * width] = place[i] >= p ? work[place[i] - p] : place[i] + p == from;
    }
    kmp_free(lu);
    kmp_free(work);
    kmp_free(pivot);
    return failed;
}

/* Vectors of the unknowns at `place` as vectors of all. False: no memory. */
static bool spread(kmp_spectrum *s, int p, const int *place)
{
    double **const vectors[] = {&s->x_re, &s->x_im, &s->y_re, &s->y_im};
    for (size_t v = 0; v < sizeof vectors / sizeof *vectors; v++) {
        const double *from = *vectors[v];
        double *to = *vectors[v] = KMP_ARENA_NEW(&s->arena, double, (ptrdiff_t)p * s->count);
        for (int c = 0; to && c < s->count; c++)
            for (int k = 0; k < s->p; k++)
                to[place[k] + (ptrdiff_t)c * p] = from[k + (ptrdiff_t)c * s->p];
    }
    s->p = p;
    return !s->arena.failed;
}

/* The spectrum of the unknowns that move: Mr, Gr and Kr have no entry by which these move a held one. */
static int find_spectrum(const kmp_linear *l, kmp_arena *scratch, kmp_spectrum *spectrum, int *place)
{
    const double *of[] = {l->inertia ? l->inertia : l->mass, l->inertia ? l->mass : NULL, l->damping, l->stiffness};
    const int count = kmp_linear_moving(l, place);
    for (int k = 0; k < 4 && count < l->p; k++) {
        double *to = of[k] ? KMP_ARENA_NEW(scratch, double, (ptrdiff_t)count *count) : NULL;
        if (scratch->failed)
            return -1;
        if (of[k])
            kmp_linear_squeeze(l->p, count, place, count, place, of[k], to);
        of[k] = to;
    }
    int info = kmp_spectrum_init(spectrum, count, of[0], of[1], of[2], of[3], false);
    if (info == 0 && count < l->p && !spread(spectrum, l->p, place)) {
        kmp_spectrum_free(spectrum);
        return -1;
    }
    return info > 0 ? 1 + place[info - 1] : info;
}

kempe_status kmp_linear_spectrum(const kmp_linear *l, kmp_spectrum *spectrum)
{
    kempe_context *context = l->system->context;
    unsigned long failures = kmp_memory_failures();
    kmp_arena scratch = {0};
    int *place = KMP_ARENA_NEW(&scratch, int, l->p);
    int info = place ? find_spectrum(l, &scratch, spectrum, place) : -1;
    kmp_arena_free(&scratch);
    if (info == 0) {
        /* Each state has one zero for its integral, which is not a state of the motion. */
        for (int k = 0; k < l->p; k++) {
            int c = kmp_state_of(l->system->model, l->part.u[k]) ? find_integral(spectrum, k) : -1;
            if (c >= 0)
                remove_column(spectrum, c);
        }
        return KEMPE_OK;
    }
    if (kmp_memory_failures() != failures)
        return kmp_fail_memory(context);
    if (info > 0)
        return kmp_fail(context, KEMPE_E_FAILED,
                        "the reduced mass is not positive for '%s': a body that moves along it has no mass",
                        kmp_model_motion(l->system->model, l->part.u[info - 1])->name);
    return kmp_fail(context, KEMPE_E_FAILED,
                    info == -2 ? "no modes exist at this state, because the accelerations are not unique: forces that "
                                 "depend on multipliers cancel the inertia of some motion"
                               : "the iteration for the eigenvalues does not converge");
}
