/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism that a rounded drawing means: of all mechanisms whose redundant closures say exactly the same the one
 * with the nearest points and axes. */
#ifndef KMP_CONSTRAINTS_MEND_H
#define KMP_CONSTRAINTS_MEND_H

#include "constraints/assemble.h"

/** Derives it, with dynamics written as `word` says (kempe_system_new_by). `assembly`: of the rounded one, with the
 * rows that stay open. *mended is NULL where none is found: too large, or nothing near is redundant. KEMPE_E_MEMORY. */
kempe_status kmp_mend(const kempe_system *rounded, const kempe_assembly *assembly, const char *word,
                      kempe_system **mended);

/** What a closure stays open by as drawn, as a sentence; nothing where it closes. */
void kmp_put_misfit(kmp_text *text, const kempe_system *system, int closure);

#endif
