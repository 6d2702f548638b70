/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/quantity.h"

const char *kmp_quantity_prefix(kmp_quantity quantity)
{
    static const char *const prefix[KMP_QUANTITIES] = {"q", "qd", "qdd", "lambda"};
    return prefix[quantity];
}

int kmp_quantity_size(const kempe_system *system, kmp_quantity quantity)
{
    return quantity == KMP_QUANTITY_LAMBDA ? system->m : system->n;
}

const char *kmp_quantity_name(const kempe_system *system, kmp_quantity quantity, int k)
{
    return quantity == KMP_QUANTITY_LAMBDA ? system->row_names[k] : system->model->motions[k].name;
}
