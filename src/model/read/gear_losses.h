/* SPDX-License-Identifier: BSD-3-Clause */
/* Losses of gears as friction. */
#pragma once

#include "model/read/reading.h"

/** Adds the losses of gears to `forces` as friction, in r->root: NAME_loss. */
void kmp_read_gear_losses(kmp_reader *r);
