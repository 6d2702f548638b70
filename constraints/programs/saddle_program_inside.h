/* SPDX-License-Identifier: BSD-3-Clause */
/* The program of saddle_program.c, made by saddle_program_write.c. */
#pragma once

#include "constraints/programs/saddle_program.h"
#include "constraints/programs/writer_blocks.h"
#include "constraints/programs/writer_ldl.h"

/** Most unknowns, qdd and lambda, and most operations of a run: the preparation takes microseconds an operation, and
 * code beyond the second cache is no faster than loops over entries. */
enum { KMP_SADDLE_PROGRAM_UNKNOWNS = 400, KMP_SADDLE_PROGRAM_OPERATIONS = 100000 };

/* Unknowns of the program: q and qd, or a state (u, ud, v) of a reduction with its order of elimination. */
typedef struct kmp_saddle_program_plan {
    const kmp_partition *part;
    const kmp_reduction *red; /* NULL: q and qd */
    const int *order;         /* kmp_writer_order */
    bool closes;              /* with KMP_SADDLE_PROGRAM_CLOSE */
} kmp_saddle_program_plan;

typedef struct kmp_saddle_program_written {
    kmp_program *program; /* NULL: there is none */
    kmp_saddle_program_layout layout;
    kmp_eliminated *row; /* of each multiplier of the elimination; the caller's */
} kmp_saddle_program_written;
