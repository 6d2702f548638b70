/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of sums. */
#ifndef KMP_SYMBOLIC_TRIG_H
#define KMP_SYMBOLIC_TRIG_H

#include "symbolic/graph.h"

/** Rewrites the outputs in place: sin and cos of a sum whose parts are needed anyway become addition theorems (6
 * operations instead of a call). A sum with a part that is needed nowhere else keeps its own call. False: no memory. */
bool kmp_trig_sums(kmp_graph *g, int count, kmp_ref *outputs);

#endif
