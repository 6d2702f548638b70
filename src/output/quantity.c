/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/quantity.h"
#include "model/data/model.h"
#include <string.h>

const char *kmp_quantity_prefix(kmp_quantity quantity)
{
    static const char *const prefix[] = {"q", "qd", "qdd", "lambda", "state"};
    return prefix[quantity];
}

int kmp_quantity_size(const kempe_system *system, kmp_quantity quantity)
{
    return quantity == KMP_QUANTITY_LAMBDA  ? system->m
           : quantity == KMP_QUANTITY_STATE ? system->model->state_count
                                            : kmp_model_coordinates(system->model);
}

const char *kmp_quantity_name(const kempe_system *system, kmp_quantity quantity, int k)
{
    return quantity == KMP_QUANTITY_LAMBDA  ? system->row_names[k]
           : quantity == KMP_QUANTITY_STATE ? system->model->states[k].name
                                            : system->model->motions[k].name;
}

const char *kmp_quantity_unit(const kempe_system *system, kmp_quantity quantity, int k)
{
    static const char *const rotation[] = {"rad", "rad/s", "rad/s^2"}, *const slide[] = {"m", "m/s", "m/s^2"};
    static const char *const multiplier[] = {"N m", "N", "N/m"}; /* energy over the unit of the row */
    if (quantity == KMP_QUANTITY_STATE || (quantity != KMP_QUANTITY_LAMBDA && kmp_state_of(system->model, k)))
        return "";
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
        for (int k = 0;
             strncmp(name, prefix, length) == 0 && name[length] == '.' && k < kmp_model_coordinates(system->model); k++)
            if (strcmp(name + length + 1, system->model->motions[k].name) == 0)
                return kmp_quantity_unit(system, quantity, k);
    }
    return "";
}
