/* SPDX-License-Identifier: BSD-3-Clause */
/* The right-hand side of a simulator for a choice of coordinates and rows, with the linear algebra written out
 * (constraints/programs/reduced_program.h). For other choices the runtime solves the linear systems. */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "exchange/code/source.h"

/** Routines of slopes at most. */
enum { KMP_SLOPES_MOST = 4 };

/** Adds routines of slopes to the source: for the partition at the evaluator's last closure, and for those that a trial
 * run of the model exchanges it for. There is none for forces that depend on multipliers, implicit blocks, large blocks
 * of loops, too many degrees of freedom, and where it is much longer than the equations. */
kempe_status kmp_slopes_add(kmp_code_source *source, const kmp_set_choice *choice, kmp_evaluator *eval,
                            const kmp_partition *part);
