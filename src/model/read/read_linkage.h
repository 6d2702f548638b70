/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints between two bodies. Once the tree is chosen they are converted to forms that the rest of the reader knows:
 * joints in bodies, and closures. */
#pragma once

#include "model/data/closure.h"
#include "model/read/reading.h"

/** Reads `joints` and chooses the ones that make the tree; the others become closures: r->linkage. */
void kmp_read_linkage(kmp_reader *r, const kmp_yaml *bodies);

/** The joint by which the k-th body (1: the first of the file) is attached, NULL after an error. */
const kmp_yaml *kmp_linkage_joint(const kmp_linkage *linkage, int body);

/** The cut joints as a mapping of closures, NULL without joints between bodies. */
const kmp_yaml *kmp_linkage_cuts(const kmp_reader *r);

/** Adds the coordinates of a cut joint, from the node that replaced it and its closure. */
void kmp_linkage_read_coordinates(kmp_reader *r, const kmp_yaml *made, const kmp_closure *closure);

/** For a node that represents a joint: its name, and its description in messages; NULL for every other node. */
const char *kmp_linkage_name(const kmp_reader *r, const kmp_yaml *made);
const char *kmp_linkage_what(kmp_reader *r, const kmp_yaml *made);

/** True if the second body of a joint carries the first. */
bool kmp_linkage_loads_parent(const kmp_reader *r, const kmp_yaml *made);

/** Finds the joint of `JOINT` or `JOINT.k` among the joints between bodies: in the tree, or not (also when it is
 * faulty). */
kmp_linked kmp_linkage_find(kmp_reader *r, const char *coordinate);
