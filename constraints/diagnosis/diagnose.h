/* SPDX-License-Identifier: BSD-3-Clause */
/* `check`: what the mechanism is, at its assembled configuration. */
#ifndef KMP_CONSTRAINTS_DIAGNOSIS_DIAGNOSE_H
#define KMP_CONSTRAINTS_DIAGNOSIS_DIAGNOSE_H

#include "constraints/diagnosis/doctor.h"

struct kempe_check {
    const kempe_system *system;
    kempe_assembly *assembly;
    bool assembled;        /* else only `obstacle` says something */
    kmp_partition part;    /* n, m, p (dof), r (rank), u, v, rows, redundant, cond, max_b */
    int driven;            /* freedoms that drives take: how much the rank falls without them */
    char *undetermined;    /* why the accelerations are; NULL: they are determined */
    int body_count;        /* ground not counted */
    int loop_count;        /* closures */
    kmp_doctor doctor;     /* what was found out beyond */
    kmp_obstacle obstacle; /* why it does not assemble */
    char *reason;          /* of that, as a sentence */
    kmp_arena arena;       /* of both */
    char *warnings;        /* of the computation, one a line */
};

#endif
