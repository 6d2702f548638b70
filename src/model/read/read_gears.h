/* SPDX-License-Identifier: BSD-3-Clause */
/* Gear wheels: the section `gears`. */
#pragma once

#include "model/data/closure.h"
#include "model/read/reading.h"

/** Reads an entry of `gears` as a closure, after bodies, points and joints. */
void kmp_read_gear(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_closure *closure);

/** Adds the losses of gears to `forces` as friction and their play to `contacts`, in r->root: NAME_loss, NAME_front,
 * NAME_back. */
void kmp_read_gear_losses(kmp_reader *r);
