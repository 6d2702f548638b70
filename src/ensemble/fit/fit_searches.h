/* SPDX-License-Identifier: BSD-3-Clause */
/* Searches of a fit from several starts. Each thread has runs of its own, with the same bound on their steps. */
#pragma once

#include <kempe/fit.h>

/** Searches from `count` starts by the threads of the fit. Their results are added to it, in the order of the starts;
 * the best values change only where a better one is found. KEMPE_E_FAILED: the model runs at no start. KEMPE_STOPPED:
 * an interrupt, with the best values so far. */
kempe_status kmp_fit_searches(kempe_fit *fit, int count);
