/* SPDX-License-Identifier: BSD-3-Clause */
/* Errors of the estimates by the linearised model (Seber and Wild 1989, section 2.1): with J of the weighted
 * residuals and s^2 their sum of squares by the degrees of freedom, the covariance is s^2 (J'J)^-1. */
#pragma once

#include "base/text.h"
#include <kempe/fit.h>

/** The relative error of the derivatives: of exact ones a hundred tolerances. */
double kmp_fit_slope_error(const kempe_fit *fit);

/** Standard errors, intervals, correlation and rank from the residuals and their derivatives, and the degrees of
 * freedom of each column. KEMPE_E_MEMORY. */
kempe_status kmp_fit_judge(kempe_fit *fit);

/** A sentence about each set of parameters that the data does not determine. */
void kmp_fit_put_open(const kempe_fit *fit, kmp_text *text);
