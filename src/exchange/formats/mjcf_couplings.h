/* SPDX-License-Identifier: BSD-3-Clause */
/* Equalities of MJCF as closures, tendons and actuators as forces. */
#pragma once

#include "exchange/formats/mjcf.h"

/** Adds the closures of all elements `equality`. */
void kmp_mjcf_add_equalities(kmp_mjcf *m);

/** Adds the springs, dampers and friction of tendons, and actuators as forces of inputs. */
void kmp_mjcf_add_tendons(kmp_mjcf *m);
void kmp_mjcf_add_actuators(kmp_mjcf *m);
