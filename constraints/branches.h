/* SPDX-License-Identifier: BSD-3-Clause */
/* The other assembly modes of a mechanism: closed states that share the kept coordinates with the model's, found by
 * assembling from many starts. Sampling: what is found is there, what is not found may be there all the same. */
#ifndef KMP_CONSTRAINTS_BRANCHES_H
#define KMP_CONSTRAINTS_BRANCHES_H

#include "base/arena.h"
#include "constraints/doctor.h"

enum { KMP_MOST_BRANCHES = 64 };

typedef struct kmp_branch {
    double *q;       /* n; angles within half a turn of the model's */
    double residual; /* scaled |h| */
    char *sign;      /* of det Jv, block by block in order of solution: '+', '-', '0' when singular */
    int hits;        /* starts that ended here */
} kmp_branch;

struct kempe_branches {
    const kempe_system *system;
    kempe_assembly *assembly; /* the model's */
    bool *kept;               /* n */
    int starts, closed;       /* tried; of these closed */
    bool many;                /* ended before its time: more than KMP_MOST_BRANCHES */
    kmp_branch branch[KMP_MOST_BRANCHES];
    int count; /* branch[0] is the model's; the others by sign, then by q */
    kmp_arena arena;
    char *warnings; /* of the computation, one a line */
};

#endif
