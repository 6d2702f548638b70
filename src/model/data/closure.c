/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures by their numbers, and the units of their rows. */
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"

const kmp_closure *kmp_model_closure(const kempe_model *model, int k)
{
    return &model->closures[k];
}

int kmp_model_closure_count(const kempe_model *model)
{
    return model->closure_count;
}

int kmp_closure_effort_power(const kempe_model *model, const kmp_closure *closure)
{
    switch (kmp_closure_row_of(closure)->needs) {
    case KMP_NEEDS_TERMS:
    case KMP_NEEDS_COUPLING:
    case KMP_NEEDS_DRIVE:
        return model->motions[closure->motion].rotation ? 0 : 1;
    case KMP_NEEDS_EXPRESSION:
    case KMP_NEEDS_MODES:
        return closure->power;
    default:
        return -1;
    }
}

const char *kmp_multiplier_unit(int power)
{
    static const char *const units[] = {"N m", "N", "N/m"};
    return power >= 0 && power <= 2 ? units[power] : "";
}
