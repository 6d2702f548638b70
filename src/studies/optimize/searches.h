/* SPDX-License-Identifier: BSD-3-Clause */
/* Searches from several starts, which threads share. Each thread has an objective of its own, and a search depends on
 * its start alone: results have the same bits with any number of threads. */
#pragma once

#include "studies/optimize/optimize_study.h"

/** Searches from the starts search[0] .. search[count - 1] by o->threads threads. Their x are the starts in the unit
 * cube, and then the best places in SI. Those that have begun are kept, o->searches of them. KEMPE_STOPPED: an
 * interrupt; a search that was under way has its best place so far. */
kempe_status kmp_searches_run(kempe_optimum *optimum, int count);

/** From the unit cube to values between the bounds; they may be the same array. */
void kmp_optimum_leave_cube(const kempe_optimum *optimum, const double *cube, double *x);
