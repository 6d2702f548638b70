/* SPDX-License-Identifier: BSD-3-Clause */
/* FASTSIM: tangential forces of a contact by the simplified theory of rolling contact (Kalker, 1982). */
#pragma once

#include <kempe/rolling_contact.h>

void kmp_fastsim_flexibilities(const kempe_creep *creep, const kempe_kalker *coefficients, double flexibility[3]);

/** The one flexibility that replaces the three of Kalker's theory. */
double kmp_fastsim_flexibility(const kempe_creep *creep, const kempe_kalker *coefficients);

/** *force is zero before. */
void kmp_fastsim(const kempe_creep *creep, const double flexibility[3], kempe_creep_force *force);
