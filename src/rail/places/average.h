/* SPDX-License-Identifier: BSD-3-Clause */
/* Averages over places, as a block of the graph (implicit.h), and their numbers. */
#pragma once

#include "symbolic/implicit.h"

/** Averages over places. E and f_1 .. f_count depend on arguments and on the place KMP_IN_Q[0]; Z is the integral of
 * exp(E) over the places. Component 0 is log Z and component k the integral of f_k exp(E), over Z. Places (at least
 * three, increasing) have as weight half the distance of their neighbours. Integrands that are smooth over two places,
 * and vanish before the ends, are thus integrated to many digits (Trefethen and Weideman, SIAM Review 56 (2014) 385).
 * Derivatives are averages again: d log Z = <dE>, d<f> = <df> + <f dE> - <f> <dE>. If E is everywhere below `needed`
 * (of arguments) by more than log Z can compensate, only rough values are needed: the values at one place near the
 * largest E. Owns `local` in any case. NULL: no memory, or the local graph has an implicit block. */
kmp_implicit *kmp_average_new(kmp_graph *local, int arguments, kmp_ref exponent, kmp_ref needed, int count,
                              const kmp_ref *averaged, int places, const double *place);

/** Number of such a block in g, as of kmp_graph_add_implicit. A block of the same expressions that g has, or had before
 * it returned to a mark, is not made again. */
int kmp_average_in(kmp_graph *g, kmp_graph *local, int arguments, kmp_ref exponent, kmp_ref needed, int count,
                   const kmp_ref *averaged, int places, const double *place);

/** A room to compute one in, for a kmp_places_room. */
void *kmp_average_room(const kmp_program_block *block, bool native);
void kmp_average_room_free(void *average);
const double *kmp_average_run(void *average, const double *arguments);
kmp_counts kmp_average_count(const void *average);

/** kmp_implicit_derivative of a block of averages. */
kmp_ref kmp_average_derivative(kmp_graph *g, int block, int component, kmp_ref list, kmp_ref differentials);
