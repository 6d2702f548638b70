/* SPDX-License-Identifier: BSD-3-Clause */
/* Names of variables for reading: S1, C1, S1p2 for sines and cosines of coordinates, OM12 for labelled values, a1, a2
 * .. for all others. */
#ifndef KMP_GENERATE_NAMES_H
#define KMP_GENERATE_NAMES_H

#include "generate/scalar.h"

/** Names for all variables of a stage, each once: s->name. false: no memory. */
bool kmp_names_give(kmp_scalar *s);

#endif
