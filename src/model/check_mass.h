/* SPDX-License-Identifier: BSD-3-Clause */
/* Massless motions that the tree shows. */
#ifndef KMP_MODEL_CHECK_MASS_H
#define KMP_MODEL_CHECK_MASS_H

#include "model/model.h"

/** KEMPE_E_INPUT: each massless motion at the place of its body; KEMPE_E_MEMORY. */
kempe_status kmp_check_masses(const kempe_model *model);

#endif
