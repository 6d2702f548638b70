/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/quantity.h"
#include <string.h>

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

const char *kmp_quantity_unit(const kempe_system *system, kmp_quantity quantity, int k)
{
    static const char *const rotation[] = {"rad", "rad/s", "rad/s^2"}, *const slide[] = {"m", "m/s", "m/s^2"};
    static const char *const multiplier[] = {"N m", "N", "N/m"}; /* energy over the unit of the row */
    if (quantity != KMP_QUANTITY_LAMBDA)
        return system->model->motions[k].rotation ? rotation[quantity] : slide[quantity];
    int power = system->rows[k].length_power;
    return power >= 0 && power <= 2 ? multiplier[power] : "";
}

const char *kmp_quantity_unit_of(const kempe_system *system, const char *name)
{
    for (kmp_quantity quantity = KMP_QUANTITY_Q; quantity <= KMP_QUANTITY_QD; quantity++) {
        const char *prefix = kmp_quantity_prefix(quantity);
        size_t length = strlen(prefix);
        for (int k = 0; strncmp(name, prefix, length) == 0 && name[length] == '.' && k < system->n; k++)
            if (strcmp(name + length + 1, system->model->motions[k].name) == 0)
                return kmp_quantity_unit(system, quantity, k);
    }
    return "";
}
