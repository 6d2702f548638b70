/* SPDX-License-Identifier: BSD-3-Clause */
/* Names of the values in generated code, each taken once. */
#pragma once

#include "exchange/code/scalar.h"

/** Names for reading of all variables of a stage, each once: S1, C1, S1p2 for sines and cosines of coordinates, OM12
 * for labelled values, a1, a2 .. for all others. false: no memory. */
bool kmp_names_give(kmp_scalar *s);
