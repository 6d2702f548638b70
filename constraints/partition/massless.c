/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced mass Mr = X' M X in scaled coordinates, by complete pivoting. If its pivots vanish, back substitution
 * gives a motion s with Mr s = 0, and X s gives the coordinates that take part in it. */
#include "constraints/partition/massless.h"
#include "base/memory.h"
#include "constraints/closing/angles.h"
#include "constraints/partition/reduction.h"
#include "linalg/dense/dense.h"
#include "linalg/dot.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* Mr, unfactored, in scales of u: column-major, p x p; mx: n. */
static void reduced_mass(const kmp_reduction *red, double *mx, double *mr)
{
    int n = red->n, p = red->p;
    const double *scale = red->eval->system->scale;
    for (int k = 0; k < p; k++) {
        memset(mx, 0, (size_t)n * sizeof *mx);
        kmp_eval_add_mass_times(red->eval, red->x + k * n, mx);
        for (int i = 0; i < p; i++)
            mr[i + k * p] = kmp_dot(n, red->x + i * n, mx) * scale[red->part->u[i]] * scale[red->part->u[k]];
    }
}

/* The coordinate with the largest scaled change in the motion s of u. */
static int largest(const kmp_reduction *red, const double *s)
{
    const double *scale = red->eval->system->scale;
    int most = 0;
    double size = -1;
    for (int i = 0; i < red->n; i++) {
        double x = 0;
        for (int k = 0; k < red->p; k++)
            x += red->x[i + k * red->n] * s[k] * scale[red->part->u[k]];
        if (fabs(x) / scale[i] > size * (1 + 1e-9)) {
            size = fabs(x) / scale[i];
            most = i;
        }
    }
    return most;
}

static void name(const kmp_reduction *red, const double *s, kmp_text *why)
{
    const kempe_model *model = red->eval->system->model;
    int motion = largest(red, s);
    const kmp_body *body = &model->bodies[model->motions[motion].body];
    kmp_text_printf(why,
                    "the accelerations are not determined: the motion of '%s' moves no mass; give body '%s', or one "
                    "that moves with it, a mass or an inertia",
                    model->motions[motion].name, body->name);
}

/* found: a regular reduced mass is not reported. */
static bool search(kmp_reduction *red, bool found, kmp_text *why)
{
    int n = red->n, p = red->p;
    double *work = KMP_NEW(double, n + p * p + 2 * p);
    int *order = KMP_NEW(int, 2 * p);
    bool made = work && order;
    if (made) {
        double *mr = work + n, *pivot = mr + p * p, *s = pivot + p;
        int rank = 0;
        kmp_reduction_tangent(red);
        reduced_mass(red, work, mr);
        kmp_lu_complete(p, p, mr, NULL, order, order + p, pivot);
        while (rank < p && pivot[rank] > 4 * p * DBL_EPSILON * pivot[0])
            rank++;
        found = found || rank < p;
        rank = rank < p ? rank : p - 1;
        kmp_lu_null_vector(p, p, mr, order + p, rank, rank, s);
        if (found)
            name(red, s, why);
    }
    kmp_free(work);
    kmp_free(order);
    return made && !why->failed;
}

/* Reports angles at a singular position; KEMPE_OK if that is not the cause. */
static kempe_status blame_angles(const kmp_evaluator *eval, const double *q)
{
    kmp_text why = {0};
    kmp_angles_explain(eval->system->model, q, &why);
    kempe_status status =
        why.failed ? kmp_fail_memory(eval->system->context)
        : why.s    ? kmp_fail(eval->system->context, KEMPE_E_FAILED, "the accelerations are not determined%s", why.s)
                   : KEMPE_OK;
    kmp_text_free(&why);
    return status;
}

static kempe_status look(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q, bool found,
                         kmp_text *why)
{
    kmp_reduction red = {0};
    kempe_status status = kmp_reduction_init(&red, eval, part);
    kmp_eval_closure(eval, t, q);
    kmp_eval_mass(eval);
    if (status == KEMPE_OK && !kmp_reduction_factor(&red) && !search(&red, found, why))
        status = kmp_fail_memory(eval->system->context);
    kmp_reduction_free(&red);
    return status;
}

kempe_status kmp_explain_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q)
{
    kmp_text why = {0};
    if (blame_angles(eval, q) != KEMPE_OK)
        return KEMPE_E_FAILED;
    if (part->p == 0)
        return kmp_fail(eval->system->context, KEMPE_E_FAILED, "the closures do not determine the accelerations");
    kempe_status status = look(eval, part, t, q, true, &why);
    if (status == KEMPE_OK)
        status = kmp_fail(eval->system->context, KEMPE_E_FAILED, "%s",
                          why.s ? why.s : "the closures do not determine the accelerations");
    kmp_text_free(&why);
    return status;
}

kempe_status kmp_foresee_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q,
                                  kmp_text *why)
{
    return part->p > 0 ? look(eval, part, t, q, false, why) : KEMPE_OK;
}
