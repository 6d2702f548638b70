/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/assembly/flexible_check.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/lapack.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

bool kmp_flexible_bends(const kmp_flexible *f, int c)
{
    bool bends = false;
    for (int s = 0; s < f->station_count; s++)
        for (int k = 0; k < f->count; k++)
            bends = bends || f->stations[s].strained[f->count * c + k].value != 0 ||
                    f->stations[s].turn[f->count * c + k].value != 0;
    for (int k = 0; k < f->count; k++) {
        const kmp_number *t = f->by_field + 9 * ((ptrdiff_t)(f->count + f->quadratic_count) * k + k);
        bends = bends || (c > 0 && t[4 * (3 - c)].value != 0);
    }
    return bends;
}

double kmp_flexible_rigid_part(const kmp_flexible *f)
{
    const double mass = f->mass->value, spread = f->second[0].value + f->second[1].value + f->second[2].value;
    double most = 0;
    for (int k = 0; k < f->count; k++) {
        const kmp_number *t = f->by_field + 9 * ((ptrdiff_t)(f->count + f->quadratic_count) * k + k);
        const kmp_number *z = f->by_place + (ptrdiff_t)9 * k;
        const double own = t[0].value + t[4].value + t[8].value;
        for (int a = 0; a < 3; a++) {
            const double spin = z[3 * ((a + 2) % 3) + (a + 1) % 3].value - z[3 * ((a + 1) % 3) + (a + 2) % 3].value;
            most = fmax(most, fabs(f->field[3 * k + a].value) / sqrt(mass * own));
            most = fmax(most, fabs(spin) / sqrt(spread * own));
        }
    }
    return most;
}

/* -- the rigid mechanism ----------------------------------------------------------------------------- */

/* Columns of the coordinates of joints, scaled, one after the other; marks the flexible bodies of others. */
static int take_rigid(const kempe_system *s, const double *jacobian, double *rigid, bool *loads)
{
    const kempe_model *model = s->model;
    int count = 0;
    for (int k = 0; k < s->n; k++) {
        const double *column = jacobian + (ptrdiff_t)k * s->m;
        if (!model->motions[k].elastic) {
            for (int r = 0; r < s->m; r++)
                rigid[r + (ptrdiff_t)count * s->m] = column[r] * s->scale[k] / s->row_scale[r];
            count++;
            continue;
        }
        for (int r = 0; r < s->m; r++)
            if (column[r] != 0)
                loads[model->bodies[model->motions[k].body].flexible - 1] = true;
    }
    return count;
}

bool kmp_rigid_mobility_find(const kempe_system *s, const double *q, kmp_rigid_mobility *found)
{
    const int most = s->m > s->n ? s->m : s->n;
    kmp_evaluator *eval = kmp_eval_new_of_closures(s);
    double *jacobian = KMP_NEW(double, s->m * s->n), *rigid = KMP_NEW(double, s->m * s->n);
    double *pivots = KMP_NEW(double, most + 1);
    int *order = KMP_NEW(int, 2 * most + 2);
    *found = (kmp_rigid_mobility){.loads = KMP_NEW(bool, s->model->flexible_count + 1)};
    const bool good = eval && jacobian && rigid && pivots && order && found->loads;
    if (good) {
        kmp_eval_closure(eval, 0, q);
        kmp_eval_dense_jacobian(eval, jacobian);
        const int count = take_rigid(s, jacobian, rigid, found->loads);
        kmp_lu_complete(s->m, count, rigid, NULL, order, order + most + 1, pivots);
        while (found->rank < s->m && found->rank < count && pivots[found->rank] > KMP_RANK * pivots[0])
            found->rank++;
        found->freedom = count - s->model->state_count - found->rank;
    } else {
        kmp_rigid_mobility_free(found);
    }
    kmp_eval_free(eval);
    kmp_free(jacobian);
    kmp_free(rigid);
    kmp_free(pivots);
    kmp_free(order);
    return good;
}

void kmp_rigid_mobility_free(kmp_rigid_mobility *rigid)
{
    kmp_free(rigid->loads);
    rigid->loads = NULL;
}
