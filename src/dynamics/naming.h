/* SPDX-License-Identifier: BSD-3-Clause */
/* Names of the formalisms' quantities in printed equations: those of ROBOTRAN where it has them, an entry's number and
 * then the link's. */
#pragma once

#include "dynamics/kinematics/vector.h"
#include "symbolic/label.h"

extern const kmp_notion kmp_name_rate, kmp_name_acceleration, kmp_name_linear, kmp_name_beta, kmp_name_force,
    kmp_name_moment;
extern const kmp_notion kmp_name_column_rate, kmp_name_column_linear, kmp_name_column_force, kmp_name_column_moment;
extern const kmp_notion kmp_name_mass, kmp_name_first, kmp_name_second;

/** column 0: none. */
void kmp_name_entry(kmp_graph *g, const kmp_notion *quantity, kmp_ref r, int entry, int link, int column);
void kmp_name_vector(kmp_graph *g, const kmp_notion *quantity, kmp_vec v, int link, int column);
