/* SPDX-License-Identifier: BSD-3-Clause */
/* Making and freeing an assembly, and messages about the closures that stay open. */
#pragma once

#include "constraints/closing/loose_start.h"
#include <kempe/check.h>

/** Assembles as kempe_assembly_new, without a message; the assembly says if it closed. */
kempe_status kmp_assemble_start(const kempe_system *system, kempe_assembly **assembly);

/** As kempe_assembly_new, for studies that begin there: conditions that end runs are not judged. */
kempe_status kmp_assembly_at_start(const kempe_system *system, kempe_assembly **assembly);

/** Likewise, before it moves to an equilibrium that the model asks for: for the search. */
kempe_status kmp_assembly_as_given(const kempe_system *system, kempe_assembly **assembly);

/** The gap of a closure with the arc of its angle, m. */
double kmp_assembly_extent(const kempe_assembly *assembly, int closure);

/** "'C' by 0.01 m", "'C' by 180 deg", "'C' by 0.01 m and 3 deg". */
void kmp_assembly_put_open(kmp_text *text, const kempe_assembly *assembly, int closure);

/** True if the rate of coordinate k was given and could not be kept. */
bool kmp_assembly_changed_rate(const kempe_assembly *assembly, int k);

/** Appends a sentence for each changed rate, one per line. */
void kmp_assembly_put_rates(kmp_text *text, const kempe_assembly *assembly);

/** Appends a sentence, with its line end, of the given start value that closing moves farthest from its guess, if it is
 * far: the loops may be closed in another assembly mode than the one that was meant; and of loops that a search has
 * closed without any start value. */
void kmp_assembly_put_moves(kmp_text *text, const kempe_assembly *assembly);

/** "'pin', 'B'": joints with clearance that start in this way, and their number. */
int kmp_assembly_put_loose(kmp_text *text, const kempe_assembly *assembly, kmp_loose_start start);

/** Makes an empty assembly; NULL when memory is exhausted. */
kempe_assembly *kmp_assembly_new(const kempe_system *system);
