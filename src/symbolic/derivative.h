/* SPDX-License-Identifier: BSD-3-Clause */
/* Forward differentiation in the graph along one direction. Partial derivatives (one seed), total time derivatives (q
 * -> qd, t -> 1) and all mixtures are one operation with different seeds. */
#pragma once

#include "symbolic/graph.h"

typedef struct kmp_derivative kmp_derivative;

/** Direction: d(leaf[k]) = direction[k], every other input is constant. NULL when there is no memory: the graph has
 * then failed, and derivatives by NULL are zero. */
kmp_derivative *kmp_derivative_new(kmp_graph *g, int count, const kmp_ref *leaf, const kmp_ref *direction);
/** Restarts along another direction. False when there is no memory. */
bool kmp_derivative_restart(kmp_derivative *d, int count, const kmp_ref *leaf, const kmp_ref *direction);
/** Leaves one to the graph, for the next: most derivatives in a large graph touch few of its nodes. The next one has
 * its results, if it is along the same direction. Before the graph is freed. */
void kmp_derivative_free(kmp_derivative *d);
/** Of the derivatives that are left to a graph: forgets all results, as the graph returns to a state that lacks some of
 * their nodes; frees them. */
void kmp_derivatives_forget(kmp_derivative *left);
void kmp_derivatives_discard(kmp_derivative *left);

/** The derivative of x. Results are remembered: many x share one pass. */
kmp_ref kmp_derivative_of(kmp_derivative *d, kmp_ref x);

/** The derivatives of several expressions by one input. */
void kmp_derivatives_by(kmp_graph *g, kmp_ref leaf, int count, const kmp_ref *of, kmp_ref *slope);

/** Derivatives of many expressions along one input after the other, each at the cost of the nodes that depend on that
 * input: the columns of a Jacobian. */
typedef struct kmp_partials kmp_partials;

/** For the expressions of[0 .. count). NULL when there is no memory: the graph has then failed. */
kmp_partials *kmp_partials_new(kmp_graph *g, int count, const kmp_ref *of);
void kmp_partials_free(kmp_partials *p);
/** Before the graph is freed: frees the partial derivatives that it keeps. */
void kmp_partials_discard(kmp_partials *p);

/** Derivatives along a leaf: value[0 .. returned) of the expressions which[0 .. returned), ascending; all other
 * derivatives are zero. Both arrays are the object's, until the next call. -1: no memory, also for NULL. */
int kmp_partials_along(kmp_partials *p, kmp_ref leaf, const int **which, const kmp_ref **value);

/** The derivatives of one expression by those inputs 0 .. `inputs` of a kind on which it may depend: their numbers,
 * ascending, and the slopes, in the graph's arena; returns how many. At the cost of the expression, not of the graph.
 */
int kmp_gradient(kmp_graph *g, kmp_ref of, kmp_input_kind kind, int inputs, int **index, kmp_ref **slope);

/** The matrix of derivatives by the inputs 0 .. `inputs` of a kind: row i, of expression i, at out + i inputs. */
void kmp_partials_all(kmp_graph *g, int count, const kmp_ref *of, kmp_input_kind kind, int inputs, kmp_ref *out);

/** The derivatives of one expression by several inputs in one pass, from the expression down to them: at the cost of a
 * few times the expression, whatever the number of inputs. */
void kmp_gradient_backward(kmp_graph *g, kmp_ref of, int count, const kmp_ref *leaf, kmp_ref *slope);
