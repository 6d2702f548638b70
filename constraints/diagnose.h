/* SPDX-License-Identifier: BSD-3-Clause */
/* `check`: what the mechanism is, at its assembled configuration. */
#ifndef KMP_CONSTRAINTS_DIAGNOSE_H
#define KMP_CONSTRAINTS_DIAGNOSE_H

#include "constraints/assemble.h"
#include "constraints/partition.h"

struct kempe_check {
    const kempe_system *system;
    kempe_assembly *assembly;
    kmp_partition part; /* n, m, p (dof), r (rank), u, v, rows, redundant, cond, max_b */
    int body_count;     /* ground not counted */
    int loop_count;     /* closures */
    int block_count;    /* diagonal blocks of Jv, in order of solution */
    int *block_start;   /* block_count + 1, into block_column */
    int *block_column;  /* coordinates of v, block by block */
};

#endif
