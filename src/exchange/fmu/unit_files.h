/* SPDX-License-Identifier: BSD-3-Clause */
/* The table of the unit in C, and its page. */
#pragma once

#include "exchange/fmu/unit_parts.h"

/** Writes the token, which a unit on the library makes again from its resources. */
void kmp_unit_token(char token[KMP_UNIT_TOKEN], const kmp_unit_plan *plan);

/** Tolerances of co-simulation: those of the model's runs, otherwise 1e-8. */
double kmp_unit_rtol(const kempe_model *model);
double kmp_unit_atol(const kempe_model *model);
double kmp_unit_longest_step(const kempe_model *model); /* s; 0: any */

/** NAME_fmu.c, documentation/index.html. */
void kmp_unit_table(kmp_text *text, const kmp_unit_plan *plan);
void kmp_unit_page(kmp_text *html, const kmp_unit_plan *plan);
