/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of the deformations without accelerations are solved by Newton's method. */
#include "constraints/closing/static_start.h"
#include "base/context.h"
#include "constraints/closing/load_margin.h"
#include "constraints/tolerances.h"
#include "linalg/dense/factors.h"
#include "model/data/start.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 60, MOST_HALVES = 12 };

static double scale_of(const kmp_settling *x, int k)
{
    return x->rows.s->scale[kmp_deformation_rows_coordinate(&x->rows, k)];
}

/* The length of the rows as works along one scale of each coordinate. */
static double size_of(const kmp_settling *x, const double *rows)
{
    double sum = 0;
    for (int k = 0; k < x->rows.count; k++)
        sum = hypot(sum, rows[k] * scale_of(x, k));
    return sum;
}

/* A step of Newton, halved while the rows would grow; its length in scales of the coordinates. Negative: there is
 * none. */
static double move_on(kmp_settling *x)
{
    kmp_deformation_rows *r = &x->rows;
    const size_t n = (size_t)r->s->n;
    double length = 0, *trial = x->next + r->count;
    if (!kmp_deformation_rows_slope(r) || kmp_lu_factor(r->count, r->slope, x->pivots) != 0)
        return -1;
    for (int k = 0; k < r->count; k++)
        x->step[k] = -r->rest[k];
    kmp_lu_solve(r->count, r->slope, x->pivots, 1, x->step);
    for (int k = 0; k < r->count; k++)
        length = fmax(length, fabs(x->step[k]) / scale_of(x, k));
    const double before = size_of(x, r->rest);
    for (int half = 0; half < MOST_HALVES; half++, length /= 2) {
        memcpy(trial, r->q, n * sizeof *trial);
        for (int k = 0; k < r->count; k++)
            trial[kmp_deformation_rows_coordinate(r, k)] += ldexp(x->step[k], -half);
        if (kmp_deformation_rows_at(r, trial, x->next) &&
            (size_of(x, x->next) < before || length <= KMP_STATIC_ROUNDED)) {
            memcpy(r->q, trial, n * sizeof *trial);
            memcpy(r->rest, x->next, (size_t)r->count * sizeof *x->next);
            return length;
        }
    }
    return -1;
}

kempe_status kmp_settling_init(kmp_settling *x, const kempe_system *s, const kmp_deformation_choice *choice)
{
    kmp_deformation_rows *r = &x->rows;
    *x = (kmp_settling){.pivots = NULL};
    KMP_TRY(kmp_deformation_rows_init(r, s, choice));
    return kmp_made(s->context,
                    KMP_ARENA_MAKE(&r->arena, KMP_ROOM(int, r->count, &x->pivots), KMP_ROOM(double, r->count, &x->step),
                                   KMP_ROOM(double, r->count + s->n, &x->next),
                                   KMP_ROOM(double, r->count * r->count, &x->even)));
}

void kmp_settling_free(kmp_settling *x)
{
    kmp_deformation_rows_free(&x->rows);
}

bool kmp_settle(kmp_settling *x)
{
    kmp_deformation_rows *r = &x->rows;
    double last = INFINITY, length = kmp_deformation_rows_at(r, r->q, r->rest) ? INFINITY : -1;
    for (int k = 0; k < MOST_STEPS && length > KMP_STATIC_STEP && !(length <= KMP_STATIC_ROUNDED && length >= last);
         k++) {
        last = length;
        length = move_on(x);
    }
    return length >= 0 && length <= KMP_STATIC_ROUNDED && kmp_deformation_rows_slope(r);
}

/* The symmetric part of the stiffness is not positive beyond the load at which a body buckles. */
bool kmp_settling_is_stable(kmp_settling *x)
{
    const int count = x->rows.count;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < count; k++)
            x->even[i + count * k] = (x->rows.slope[i + count * k] + x->rows.slope[k + count * i]) / 2;
    return kmp_cholesky_factor(count, x->even) == 0;
}

static kempe_status settle(kmp_settling *x, kempe_assembly *a)
{
    kempe_context *context = x->rows.s->context;
    if (x->rows.count == 0)
        return KEMPE_OK;
    if (!kmp_settle(x))
        return kmp_fail(context, KEMPE_E_FAILED,
                        "start: the flexible bodies find no balance with the loads near their given deformations: one "
                        "of them may buckle; take 'elastic: held', or other deformations (start: q)");
    a->unstable = !kmp_load_margin_has_creep(x->rows.s) && !kmp_settling_is_stable(x); /* as of kmp_load_margin_new */
    if (a->unstable)
        kmp_doubt(context,
                  "start: the deformations are in balance with the loads of the start, but not in a stable one: a "
                  "flexible body buckles under less than these");
    /* Into the assembly. */
    const kmp_deformation_rows *r = &x->rows;
    const int n = r->s->n;
    KMP_TRY(kmp_made(r->s->context, KMP_ARENA_MAKE(&a->arena, KMP_ROOM(double, n, &a->held_q, &a->held_qd),
                                                   KMP_ROOM(bool, n, &a->stays))));
    for (int k = 0; k < r->part.p; k++)
        a->stays[r->part.u[k]] = !kmp_model_start(r->s->model)->undeformed[r->part.u[k]];
    for (int k = 0; k < n; k++) {
        a->moved[k] += r->q[k] - a->q[k];
        a->held_q[k] = a->q[k];
        a->held_qd[k] = a->qd[k];
        a->q[k] = r->q[k];
        a->qd[k] = r->qd[k];
    }
    return KEMPE_OK;
}

kempe_status kmp_static_start(const kempe_system *s, kempe_assembly *a)
{
    if (!kmp_model_start(s->model)->statics || !a->closed)
        return KEMPE_OK;
    if (a->inner_q)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "start: 'elastic: static' is not possible where a spherical joint is near its singular "
                        "position; give it other axes");
    kmp_settling x;
    const kmp_deformation_choice choice = {.moves = kmp_model_start(s->model)->undeformed, .q = a->q, .qd = a->qd};
    kempe_status status = kmp_settling_init(&x, s, &choice);
    if (status == KEMPE_OK)
        status = settle(&x, a);
    kmp_settling_free(&x);
    return status;
}
