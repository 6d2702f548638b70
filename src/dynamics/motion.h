/* SPDX-License-Identifier: BSD-3-Clause */
/* The programs that make accelerations: by M and C, and by articulated bodies where those were requested or cost less.
 */
#pragma once

#include "dynamics/equations.h"
#include "dynamics/system.h"

/** The sets for accelerations by M and C. */
enum { KMP_MOTION_SETS = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_POWER };

/** Makes system->motion and its members, for a system that knows its rows. False: no memory. */
bool kmp_motion_make(kempe_system *system, kmp_equations *eq);

/** Room for M and C that wait; NULL: no memory. */
kmp_lazy_equations *kmp_lazy_equations_new(kempe_system *system);
void kmp_lazy_equations_free(kmp_lazy_equations *late);

/** Makes late->weighing and the members of a system whose M and C wait, as kmp_motion_make. False: no memory. */
bool kmp_motion_make_weighing(kempe_system *system, kmp_equations *eq);

/** The program by M and C for a system that has its members already. NULL: no memory. */
kmp_program *kmp_motion_make_again(const kempe_system *system, kmp_equations *eq);

/** Makes M and C of a system that they wait in, when it is first called. Several threads may call. KEMPE_E_MEMORY. */
kempe_status kmp_motion_need(const kempe_system *system);

/** True if M and C have been made. */
bool kmp_motion_is_made(const kempe_system *system);

/** The program by M and C if it has been made, otherwise the program by products M x or by articulated bodies (NULL:
 * none). A large tree may have neither: it makes one. */
const kmp_program *kmp_motion_known(const kempe_system *system);

/** Lists operands of expressions of an input that do not depend on it, in the order of the graph: they are evaluated
 * once, while the multipliers are solved for, or for all products M x. `to` has room for one reference per node. False:
 * no memory. */
bool kmp_list_independent(const kmp_graph *graph, kmp_input_kind kind, int count, const kmp_ref *of, kmp_ref *to,
                          int *found);

/** Room for articulated bodies; NULL: no memory. */
kmp_bodies *kmp_bodies_new(void);
void kmp_bodies_free(kmp_bodies *bodies);
/** As new, with the variants to begin with. */
void kmp_bodies_forget(kmp_bodies *bodies);

/** Makes system->bodies when it is first called; no program where they were not requested and cost more or are
 * impossible. Several threads may call. KEMPE_E_FAILED: they were requested and are impossible; KEMPE_E_MEMORY. */
kempe_status kmp_motion_need_bodies(const kempe_system *system);
