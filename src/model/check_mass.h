/* SPDX-License-Identifier: BSD-3-Clause */
/* Motions that carry no mass, as far as the tree shows them. */
#ifndef KMP_MODEL_CHECK_MASS_H
#define KMP_MODEL_CHECK_MASS_H

#include "model/model.h"

/** KEMPE_E_INPUT: each such motion at the place of its body; KEMPE_E_MEMORY. */
kempe_status kmp_check_masses(const kempe_model *model);

#endif
