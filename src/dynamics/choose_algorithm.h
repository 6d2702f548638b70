/* SPDX-License-Identifier: BSD-3-Clause */
/* The algorithm that makes the accelerations of a mechanism with the fewest operations: M and C, products with M, or
 * articulated bodies. */
#pragma once

#include "dynamics/system.h"

/** True if M and C of a new system wait: it is large, articulated bodies may cost less, and runs by these never need
 * C. */
bool kmp_motion_may_wait(const kempe_system *system);
/** True if a system whose M and C wait does without M: it is a large tree. */
bool kmp_motion_goes_by_links(const kempe_model *model);
/** True if the runs of a system may take products M x in place of M: it is a large mechanism with loops, and nothing
 * needs M itself for modes and impulses. Then, with its rows: they do, where independent coordinates are so few that
 * the entries of M outnumber the operations of the products. */
bool kmp_motion_may_go_by_products(const kempe_system *system);
bool kmp_motion_goes_by_products(const kempe_system *system, int rows);

/** Finds whether articulated bodies may cost less than M and C, as far as this is visible before they are derived;
 * then, with their program, whether they do. M and C need not be counted if articulated bodies cost less than
 * only the solves with M and C. KEMPE_E_MEMORY. */
kempe_status kmp_bodies_may_pay(const kempe_system *system, bool *may_pay);
kempe_status kmp_bodies_pay(const kempe_system *system, const kmp_program *bodies, bool *pay);
