/* SPDX-License-Identifier: BSD-3-Clause */
/* `check`: properties of a mechanism at its assembled configuration. */
#ifndef KMP_CONSTRAINTS_DIAGNOSIS_DIAGNOSE_H
#define KMP_CONSTRAINTS_DIAGNOSIS_DIAGNOSE_H

#include "constraints/diagnosis/doctor.h"
#include <kempe/check.h>

struct kempe_check {
    const kempe_system *system;
    kempe_assembly *assembly;
    bool assembled;        /* false: only `obstacle` is set */
    kmp_partition part;    /* n, m, p (dof), r (rank), u, v, rows, redundant, cond, max_b */
    int driven;            /* degrees of freedom of the drives: the decrease of the rank without them */
    char *undetermined;    /* reason of undetermined accelerations; NULL: they are determined */
    int body_count;        /* number of bodies without the ground */
    int loop_count;        /* number of closures */
    kmp_doctor doctor;     /* results of the examination */
    kmp_obstacle obstacle; /* reason of a failed assembly */
    char *reason;          /* message of the failed assembly */
    kmp_arena arena;       /* of obstacle and reason */
    char *warnings;        /* of the computation, one per line */
};

#endif
