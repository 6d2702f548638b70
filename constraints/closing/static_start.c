/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of the deformations without accelerations are solved by Newton's method. */
#include "constraints/closing/static_start.h"
#include "base/context.h"
#include "constraints/closing/deformation_rows.h"
#include "constraints/tolerances.h"
#include "linalg/dense/factors.h"
#include "model/data/model.h"
#include "model/data/start.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 60, MOST_HALVES = 12 };

typedef struct settling {
    kmp_deformation_rows rows;
    int *pivots;
    double *step, *next; /* count */
} settling;

static double scale_of(const settling *x, int k)
{
    return x->rows.s->scale[kmp_deformation_rows_coordinate(&x->rows, k)];
}

/* The length of the rows as works along one scale of each coordinate. */
static double size_of(const settling *x, const double *rows)
{
    double sum = 0;
    for (int k = 0; k < x->rows.count; k++)
        sum = hypot(sum, rows[k] * scale_of(x, k));
    return sum;
}

/* A step of Newton, halved while the rows would grow; its length in scales of the coordinates. Negative: there is
 * none. */
static double move_on(settling *x)
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

/* The symmetric part of the stiffness at the end: not positive beyond the load at which a body buckles. */
static bool is_stable(kmp_deformation_rows *x)
{
    if (!kmp_deformation_rows_slope(x))
        return false;
    for (int i = 0; i < x->count; i++)
        for (int k = 0; k < i; k++) {
            const double mean = (x->slope[i + x->count * k] + x->slope[k + x->count * i]) / 2;
            x->slope[i + x->count * k] = x->slope[k + x->count * i] = mean;
        }
    return kmp_cholesky_factor(x->count, x->slope) == 0;
}

static kempe_status settle(settling *x, bool *stable)
{
    kmp_deformation_rows *r = &x->rows;
    double last = INFINITY, length = kmp_deformation_rows_at(r, r->q, r->rest) ? INFINITY : -1;
    for (int k = 0; k < MOST_STEPS && length > KMP_STATIC_STEP && !(length <= KMP_STATIC_ROUNDED && length >= last);
         k++) {
        last = length;
        length = move_on(x);
    }
    if (!(length >= 0 && length <= KMP_STATIC_ROUNDED))
        return kmp_fail(r->s->context, KEMPE_E_FAILED,
                        "start: the flexible bodies find no balance with the loads of the start near their given "
                        "deformations: the loads may be more than those at which one of them buckles; take 'elastic: "
                        "held', or other deformations (start: q)");
    *stable = is_stable(r);
    if (!*stable)
        kmp_doubt(r->s->context,
                  "start: the deformations are in balance with the loads of the start, but not in a stable one: a "
                  "flexible body buckles under less than these");
    return KEMPE_OK;
}

kempe_status kmp_static_start(const kempe_system *s, kempe_assembly *a)
{
    settling x = {.pivots = NULL};
    bool stable = true;
    kmp_deformation_rows *r = &x.rows;
    if (!s->model->start.statics || !a->closed)
        return KEMPE_OK;
    if (a->inner_q)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "start: 'elastic: static' is not possible where a spherical joint is near its singular "
                        "position; give it other axes");
    kempe_status status = kmp_deformation_rows_init(r, s, s->model->start.undeformed, a->q, a->qd);
    if (status == KEMPE_OK)
        status = kmp_made(s->context, KMP_ARENA_MAKE(&r->arena, KMP_ROOM(int, r->count, &x.pivots),
                                                     KMP_ROOM(double, r->count, &x.step),
                                                     KMP_ROOM(double, r->count + s->n, &x.next)));
    if (status == KEMPE_OK && r->count > 0)
        status = settle(&x, &stable);
    if (status == KEMPE_OK && r->count > 0)
        status = kmp_made(s->context, KMP_ARENA_MAKE(&a->arena, KMP_ROOM(double, s->n, &a->held_q, &a->held_qd)));
    for (int k = 0; status == KEMPE_OK && r->count > 0 && k < s->n; k++) {
        a->moved[k] += r->q[k] - a->q[k];
        a->held_q[k] = a->q[k];
        a->held_qd[k] = a->qd[k];
        a->q[k] = r->q[k];
        a->qd[k] = r->qd[k];
    }
    a->unstable = !stable;
    kmp_deformation_rows_free(r);
    return status;
}
