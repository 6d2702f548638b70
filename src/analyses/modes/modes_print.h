/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes as text, JSON and tables. */
#pragma once

#include "base/context.h"
#include "base/json.h"
#include <kempe/modes.h>

/** The form in which results show values of the number that varies. */
kmp_shown kmp_modes_shown(const kempe_modes *modes);

/** The coordinates with the largest shares in a mode of n, of at least 2 %, up to `most`; returns their number.
 * Shares that are equal but for rounding, as of both sides of a symmetric mode, are in the order of their coordinates:
 * each share belongs to the next larger one if it is less by no more than a small part of it, whatever their last
 * digits. */
int kmp_modes_order_shares(int n, const double *share, int most, int *order);

/** The results as members of an open object. */
void kmp_modes_json(kmp_json *json, const kempe_modes *modes);
