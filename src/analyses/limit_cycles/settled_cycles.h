/* SPDX-License-Identifier: BSD-3-Clause */
/* Limit cycles as simulations reach them, for models whose forces jump or have too many contacts for Newton's
 * method. */
#pragma once

#include <kempe/limit_cycles.h>

/** Simulates at each value of the sweep, up and down, each time from the last state: a branch for each direction.
 * (settled_cycles.c) */
kempe_status kmp_settled_cycles(kempe_limit_cycles *cycles, const char *outputs, const kempe_run_options *run);
