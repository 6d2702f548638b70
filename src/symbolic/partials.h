/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of many expressions along one input after the other, each at the cost of the nodes that depend on that
 * input: the columns of a Jacobian. */
#pragma once

#include "symbolic/graph.h"

typedef struct kmp_partials kmp_partials;

/** For the expressions of[0 .. count). NULL when there is no memory: the graph has then failed. */
kmp_partials *kmp_partials_new(kmp_graph *g, int count, const kmp_ref *of);
void kmp_partials_free(kmp_partials *p);

/** Derivatives along a leaf: value[0 .. returned) of the expressions which[0 .. returned), ascending; all other
 * derivatives are zero. Both arrays are the object's, until the next call. -1: no memory, also for NULL. */
int kmp_partials_along(kmp_partials *p, kmp_ref leaf, const int **which, const kmp_ref **value);

/** The matrix of derivatives by the inputs 0 .. `inputs` of a kind: row i, of expression i, at out + i inputs. */
void kmp_partials_all(kmp_graph *g, int count, const kmp_ref *of, kmp_input_kind kind, int inputs, kmp_ref *out);
