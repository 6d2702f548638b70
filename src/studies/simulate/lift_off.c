/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/lift_off.h"
#include "base/context.h"
#include "constraints/tolerances.h"
#include "model/data/closure.h"
#include <math.h>

static void look_at(const kempe_system *system, const kmp_samples *table, int r)
{
    const kmp_closure *closure = kmp_model_closure(system->model, system->rows[r].closure);
    double most = 0;
    int first = -1;
    for (int row = 0; row < table->rows; row++) {
        const double force = kmp_samples_get(table, KMP_QUANTITY_LAMBDA, row)[r];
        most = fmax(most, fabs(force));
    }
    for (int row = 0; row < table->rows && first < 0; row++)
        first = kmp_samples_get(table, KMP_QUANTITY_LAMBDA, row)[r] < -KMP_PULLING_FORCE * most ? row : -1;
    if (first < 0)
        return;
    kmp_log(
        system->context, KEMPE_LOG_WARNING,
        "cam '%s' would lift off at t = %.6g s, where it pulls its follower with %.4g N: an ideal follower stays on "
        "it, a contact lifts off",
        closure->name, kmp_samples_time(table, first), -kmp_samples_get(table, KMP_QUANTITY_LAMBDA, first)[r]);
}

void kmp_warn_of_lift_off(const kempe_system *system, const kmp_samples *table)
{
    for (int r = 0; r < system->m; r++)
        if (kmp_model_closure(system->model, system->rows[r].closure)->cam)
            look_at(system, table, r);
}
