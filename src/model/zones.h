/* SPDX-License-Identifier: BSD-3-Clause */
/* The pieces of a wheel's profile that a rigid rail can touch. */
#ifndef KMP_MODEL_ZONES_H
#define KMP_MODEL_ZONES_H

#include "model/wheels.h"

/** Rolls the wheel over the whole rail and notes what touches. Where the point of contact jumps by more than two
 *  millimetres at any roll, one zone ends and the next one begins, in the middle of what is never touched; of more
 *  jumps than zones the smallest are passed over. false: no memory. */
bool kmp_zones_find(const kmp_track *track, kmp_wheel *wheel);

#endif
