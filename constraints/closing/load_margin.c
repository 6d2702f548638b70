/* SPDX-License-Identifier: BSD-3-Clause */
/* With K the stiffness of the material and T the derivatives of the rows of deformations, K - T is what the loads take
 * (T = K + geometric stiffness): the largest eigenvalue of (K - T) x = part K x. Joints that are independent hold. */
#include "constraints/closing/load_margin.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/deformation_rows.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/lapack.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

struct kmp_load_margin {
    kmp_deformation_rows rows;
    int *own;                         /* count: rows of one body */
    double *stiffness, *lost, *value; /* room: count x count, count x count, count */
};

kempe_status kmp_load_margin_new(const kempe_system *s, const double *q, const double *qd, kmp_load_margin **margin)
{
    *margin = NULL;
    if (s->model->flexible_count == 0 || kmp_load_margin_has_creep(s))
        return KEMPE_OK;
    KMP_MAKE(s->context, kmp_load_margin, m);
    const kempe_status status = kmp_deformation_rows_of_shapes(&m->rows, s, q, qd);
    if (status != KEMPE_OK) {
        kmp_free(m);
        return status == KEMPE_E_MEMORY ? status : KEMPE_OK;
    }
    const int count = m->rows.count;
    *margin = m;
    if (KMP_ARENA_MAKE(&m->rows.arena, KMP_ROOM(int, count, &m->own),
                       KMP_ROOM(double, count *count, &m->stiffness, &m->lost), KMP_ROOM(double, count, &m->value)))
        return KEMPE_OK;
    kmp_load_margin_free(m);
    *margin = NULL;
    return kmp_fail_memory(s->context);
}

void kmp_load_margin_free(kmp_load_margin *m)
{
    if (m)
        kmp_deformation_rows_free(&m->rows);
    kmp_free(m);
}

/* Column k of X, of the k-th deformation. */
static const double *motion_of(const kmp_load_margin *m, int k)
{
    return m->rows.red.x + (ptrdiff_t)m->rows.s->n * m->rows.in_u[k];
}

/* The stiffness of the material between two deformations, with the deflections that depend on them. */
static double stiffness_between(const kmp_load_margin *m, int i, int k)
{
    const kempe_model *model = m->rows.s->model;
    const double *x = motion_of(m, i), *y = motion_of(m, k);
    double sum = 0;
    for (int b = 0; b < model->flexible_count; b++) {
        const kmp_flexible *f = &model->flexibles[b];
        for (int e = 0; e < f->count; e++)
            for (int l = 0; l < f->count; l++)
                sum += x[f->first + e] * f->stiffness[f->count * e + l].value * y[f->first + l];
    }
    return sum;
}

/* The part that is taken from one body, whose `count` rows are in m->own. */
static double part_of(kmp_load_margin *m, int count)
{
    const kmp_deformation_rows *r = &m->rows;
    double *stiffness = m->stiffness, *lost = m->lost;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < count; k++) {
            const int row = m->own[i], column = m->own[k];
            const double tangent = (r->slope[row + r->count * column] + r->slope[column + r->count * row]) / 2;
            stiffness[i + count * k] = stiffness_between(m, row, column);
            lost[i + count * k] = stiffness[i + count * k] - tangent;
        }
    if (count == 0 || kmp_cholesky_factor(count, stiffness) != 0)
        return NAN;
    kmp_cholesky_congruence(count, stiffness, lost);
    return kmp_symmetric_eigen(count, lost, m->value) == 0 ? m->value[count - 1] : NAN;
}

void kmp_load_margin_at(kmp_load_margin *m, double t, const double *q, const double *qd, const double *qdd,
                        double *taken)
{
    kmp_deformation_rows *r = &m->rows;
    const kempe_model *model = r->s->model;
    r->t = t;
    memcpy(r->q, q, (size_t)r->s->n * sizeof *q);
    for (int k = 0; k < r->part.p; k++) {
        r->ud[k] = qd[r->part.u[k]];
        r->udd[k] = qdd ? qdd[r->part.u[k]] : 0;
    }
    const bool known = kmp_deformation_rows_at(r, r->q, r->rest) && kmp_deformation_rows_slope(r);
    for (int b = 0; b < model->flexible_count; b++) {
        int count = 0;
        for (int k = 0; k < r->count; k++)
            if (model->motions[kmp_deformation_rows_coordinate(r, k)].body == model->flexibles[b].body)
                m->own[count++] = k;
        taken[b] = known ? part_of(m, count) : NAN;
    }
}

bool kmp_load_margin_has_springs(const kempe_system *s)
{
    bool found = false;
    for (int k = 0; k < s->model->force_count; k++) {
        const kmp_force_kind kind = s->model->forces[k].kind;
        found = found || (kind != KMP_FORCE_JOINT && kind != KMP_FORCE_POINT && kind != KMP_FORCE_BODY &&
                          kind != KMP_FORCE_FRICTION && kind != KMP_FORCE_STATE);
    }
    return found;
}

bool kmp_load_margin_has_creep(const kempe_system *s)
{
    bool creep = false;
    for (int k = 0; k < s->model->wheel_count; k++)
        creep = creep || s->model->wheels[k].law != KMP_CREEP_NONE;
    return creep;
}
