/* SPDX-License-Identifier: BSD-3-Clause */
/* A model with coordinates that drives move. */
#pragma once

#include <kempe/kempe.h>
#include <stdbool.h>

/** Changes of a copy in addition to numbers (kmp_driven_model). */
typedef struct kmp_driven {
    int count; /* coordinates that move at the rates of the start from there, by any load: drives "load.NAME" */
    const int *motion;
    const bool *hold; /* n: coordinates that the assembly of the start keeps, of which only the rates are given there;
                       * NULL: as in the model */
    const double *q;  /* n: start values, where `hold` is given */
} kmp_driven;

/** A model with further drives and another start: its own object, as in kmp_variant_instance. */
kempe_status kmp_driven_model(const kempe_model *model, const kmp_driven *driven, kempe_model **instance);
