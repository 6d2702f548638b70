/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies, their order and their points. The tree comes from the joints' `at`; parents are put before their children,
 * the file's order kept otherwise. */
#pragma once

#include "model/data/body.h"
#include "model/read/reading.h"

extern const kmp_key kmp_body_keys[];

void kmp_read_bodies(kmp_reader *r);

/** False: no memory. */
bool kmp_reader_add_motion(kmp_reader *r, kmp_motion motion);

/** Reports keys of numbers that belong to another kind of joint than `row` (NULL: to any). */
void kmp_check_joint_keys(kmp_reader *r, const kmp_joint_row *row, const kmp_yaml *joint, const char *what);

/** The axes a, b and c of a joint's chain as columns of m: of an axis a, or, where b counts, of a list of two. */
void kmp_read_chain_axes(kmp_reader *r, const char *chain, const kmp_yaml *node, const char *what, double m[3][3]);
