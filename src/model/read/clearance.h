/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints with clearance, rewritten before the model is read: the joint becomes one that moves freely in a plane, and
 * its keys `clearance` and `contact` entries of `contacts`. */
#pragma once

#include "model/read/reading.h"

/** Replaces joints with clearance by joints that move in a plane and entries of `contacts`, in r->root. */
void kmp_read_clearances(kmp_reader *r);
