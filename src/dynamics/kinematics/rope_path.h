/* SPDX-License-Identifier: BSD-3-Clause */
/* Lengths of the path of a rope. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "model/data/rope.h"

/** From end to end, or from drum to drum where the rope leaves them; around a closed rope. m */
kmp_ref kmp_rope_length(const kmp_tree *tree, const kmp_rope *rope);

/** The free length of that part: what drums pay out is added to it. m */
kmp_ref kmp_rope_free_length(const kmp_tree *tree, const kmp_rope *rope);

/** Positive where the rope pulls, behind its sheave with friction; N */
kmp_ref kmp_rope_tension(const kmp_tree *tree, const kmp_rope *rope);

/** An end of an open rope, the last or the first one: the place at which it acts, on the rim of a drum, and the unit
 * vector of the span that leaves there; in ground axes. The tension there; N */
void kmp_rope_end(const kmp_tree *tree, const kmp_rope *rope, bool last, kmp_vec *place, kmp_vec *along);
kmp_ref kmp_rope_end_tension(const kmp_tree *tree, const kmp_rope *rope, bool last);

/** The angle over which the rope touches a sheave; rad */
kmp_ref kmp_rope_wrap(const kmp_tree *tree, const kmp_rope *rope, int place);

/** The way that the rope has slid over the rim of a sheave whose rotation counts, towards the first end; m */
kmp_ref kmp_rope_slide(const kmp_tree *tree, const kmp_rope *rope, int place);
