/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations of dependent coordinates and of drives follow from the closures. */
#include "constraints/closing/deformation_rows.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/few_tangents.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/partition/small_change.h"
#include "model/data/body.h"
#include "model/data/flexible.h"
#include "model/data/start.h"
#include "model/data/state.h"
#include <math.h>
#include <string.h>

int kmp_deformation_rows_coordinate(const kmp_deformation_rows *x, int k)
{
    return x->part.u[x->in_u[k]];
}

bool kmp_deformation_rows_at(kmp_deformation_rows *x, double *q, double *rows)
{
    if (x->part.r > 0 && kmp_reduction_close(&x->red, x->t, q, NULL, 0) != 0)
        return false;
    kmp_eval_closure(x->eval, x->t, q);
    if (kmp_reduction_factor(&x->red) != 0)
        return false;
    kmp_reduction_tangent(&x->red);
    if (x->rests) { /* rates of states are their values */
        const kempe_model *model = x->s->model;
        memset(x->qd, 0, (size_t)x->s->n * sizeof *x->qd);
        for (int k = kmp_model_coordinates(model); k < x->s->n; k++)
            x->qd[k] = kmp_model_start(model)->qd[k].value;
    } else {
        kmp_reduction_rates(&x->red, x->ud, x->qd);
    }
    kmp_eval_mass(x->eval);
    kmp_load_forget(x->eval);
    kmp_eval_bias(x->eval, x->qd);
    if (x->rests)
        kmp_reduction_project(&x->red, x->eval->bias, x->all);
    else
        kmp_reduction_residual(&x->red, x->udd, x->all);
    bool finite = true;
    for (int k = 0; k < x->count; k++) {
        rows[k] = x->rests ? -x->all[x->in_u[k]] : x->all[x->in_u[k]];
        finite = finite && isfinite(rows[k]);
    }
    return finite;
}

/* The change of all rows by the k-th deformation. */
static void follow(kmp_deformation_rows *x, int k)
{
    if (x->rests) {
        double *force = x->room;
        memset(force, 0, (size_t)x->s->n * sizeof *force);
        kmp_tangents_add(&x->tangents, KMP_R_Q, x->d, -1, x->red.x + (ptrdiff_t)x->s->n * x->in_u[k], force);
        kmp_reduction_project(&x->red, force, x->all);
        return;
    }
    x->unit[x->in_u[k]] = 1;
    kmp_follow(&x->red, &x->tangents, x->d, false, &(kmp_change){.u = x->unit}, &(kmp_response){.residual = x->all},
               x->room);
    x->unit[x->in_u[k]] = 0;
}

bool kmp_deformation_rows_slope(kmp_deformation_rows *x)
{
    if (x->count == 0)
        return true;
    kmp_deformation_rows_loads(x, x->qdd, x->lambda);
    (void)kmp_reduction_load_factor(&x->red, false);
    const kmp_instant at = kmp_instant_of(x->eval, x->t, x->q, x->qd, x->qdd, x->lambda);
    x->d = kmp_tangents_derivatives(&x->tangents, &at);
    bool finite = true;
    for (int k = 0; k < x->count; k++) {
        follow(x, k);
        for (int i = 0; i < x->count; i++) {
            x->slope[i + x->count * k] = x->all[x->in_u[i]];
            finite = finite && isfinite(x->all[x->in_u[i]]);
        }
    }
    return finite;
}

/* Independent coordinates into `u`: as many as possible of the deformations and of the ones that are liked, or hold,
 * and then of coordinates with a given start, as far as these do not take the place of one before. Their number, -1: no
 * memory.
 */
static int order_wishes(const kempe_system *s, const kmp_deformation_choice *c, const double *jacobian, bool *liked,
                        int *u, int *other)
{
    const kmp_start *start = kmp_model_start(s->model);
    for (int k = 0; k < s->n; k++)
        liked[k] = c->moves[k] || (c->liked ? c->liked[k] : start->hold[k]);
    const int count = kmp_partition_prefer(s, jacobian, liked, u);
    if (c->liked || count < 0)
        return count;
    for (int k = 0; k < s->n; k++)
        liked[k] = start->q_given[k];
    int kept = 0, again = 0;
    for (int i = 0; i < count; i++)
        if (c->moves[u[i]] || start->hold[u[i]]) {
            liked[u[i]] = true;
            kept++;
        }
    if (kmp_partition_prefer(s, jacobian, liked, other) < 0)
        return -1;
    for (int i = 0; i < count; i++)
        again += c->moves[other[i]] || start->hold[other[i]];
    if (again == kept)
        memcpy(u, other, (size_t)count * sizeof *u);
    return count;
}

kempe_status kmp_deformation_rows_choose(kmp_partition *part, kmp_evaluator *eval, const kmp_deformation_choice *c)
{
    const kempe_system *s = eval->system;
    const kmp_pattern *pattern = &s->jacobian;
    bool *liked = KMP_NEW(bool, s->n);
    int *wish = KMP_NEW(int, 2 * s->n), count = -1;
    double *jacobian = KMP_NEW(double, pattern->count);
    kmp_eval_closure(eval, c->t, c->q);
    for (int e = 0; jacobian && e < pattern->count; e++)
        jacobian[e] = c->left_out && c->left_out[pattern->row[e]] ? 0 : eval->jacobian[e];
    if (liked && wish && jacobian)
        count = order_wishes(s, c, jacobian, liked, wish, wish + s->n);
    const kempe_status status =
        count < 0 ? kmp_fail_memory(s->context) : kmp_partition_init(part, s, jacobian, wish, count);
    kmp_free(jacobian);
    kmp_free(liked);
    kmp_free(wish);
    return status;
}

kempe_status kmp_deformation_rows_init(kmp_deformation_rows *x, const kempe_system *s, const kmp_deformation_choice *c)
{
    *x = (kmp_deformation_rows){.s = s, .eval = kmp_eval_new(s, "tape"), .rests = c->rests, .t = c->t};
    KMP_TRY(kmp_made(s->context, x->eval));
    x->eval->unmet.left_out = c->left_out;
    KMP_TRY(kmp_deformation_rows_choose(&x->part, x->eval, c));
    KMP_TRY(kmp_reduction_init(&x->red, x->eval, &x->part));
    const int n = s->n, p = x->part.p;
    if (!KMP_ARENA_MAKE(&x->arena, KMP_ROOM(int, p, &x->in_u), KMP_ROOM(double, n, &x->q, &x->qd, &x->qdd),
                        KMP_ROOM(double, p, &x->ud, &x->udd, &x->all, &x->unit, &x->rest),
                        KMP_ROOM(double, s->m, &x->lambda), KMP_ROOM(double, KMP_FOLLOW_ROOM(n, s->m), &x->room),
                        KMP_ROOM(double, p *p, &x->slope)))
        return kmp_fail_memory(s->context);
    for (int k = 0; k < p; k++) {
        x->ud[k] = c->qd[x->part.u[k]];
        if (c->moves[x->part.u[k]])
            x->in_u[x->count++] = k;
    }
    memcpy(x->q, c->q, (size_t)n * sizeof *x->q);
    return x->count > 0 ? kmp_tangents_init_few(&x->tangents, s, x->eval->backend) : KEMPE_OK;
}

kempe_status kmp_deformation_rows_of_shapes(kmp_deformation_rows *x, const kempe_system *s, const double *q,
                                            const double *qd)
{
    if (kmp_model_flexible_count(s->model) == 0)
        return KEMPE_E_FAILED;
    const bool quiet = kmp_context_quiet(s->context, true);
    char *said = kmp_strdup(kempe_context_message(s->context));
    bool *moves = KMP_NEW(bool, s->n);
    for (int k = 0; moves && k < s->n; k++)
        moves[k] = kmp_model_motion(s->model, k)->elastic;
    const kmp_deformation_choice choice = {.moves = moves, .q = q, .qd = qd};
    const kempe_status status = moves ? kmp_deformation_rows_init(x, s, &choice) : KEMPE_E_MEMORY;
    (void)kmp_context_quiet(s->context, quiet);
    if (moves && status != KEMPE_OK)
        kmp_deformation_rows_free(x);
    kmp_free(moves);
    if (status == KEMPE_E_MEMORY || !said) {
        kmp_free(said);
        if (status == KEMPE_OK)
            kmp_deformation_rows_free(x);
        return kmp_fail_memory(s->context);
    }
    if (status != KEMPE_OK) { /* the message of this attempt is dropped, the message of a failed run before it stays */
        kmp_context_clear(s->context);
        if (said && *said)
            (void)kmp_fail(s->context, KEMPE_E_FAILED, "%s", said);
    }
    kmp_free(said);
    return status == KEMPE_OK ? status : KEMPE_E_FAILED;
}

void kmp_deformation_rows_loads(kmp_deformation_rows *x, double *qdd, double *lambda)
{
    if (x->rests)
        memset(qdd, 0, (size_t)x->s->n * sizeof *qdd);
    else
        kmp_reduction_accelerations(&x->red, x->udd, qdd);
    kmp_reduction_multipliers(&x->red, qdd, lambda);
}

void kmp_deformation_rows_free(kmp_deformation_rows *x)
{
    kmp_tangents_free(&x->tangents);
    kmp_reduction_free(&x->red);
    kmp_partition_free(&x->part);
    kmp_eval_free(x->eval);
    kmp_arena_free(&x->arena);
}
