/* SPDX-License-Identifier: BSD-3-Clause */
/* Other assembly modes of a mechanism: closed states that share the kept coordinates with the model's, found by
 * assembling from many starts. Sampling may miss some modes. */
#pragma once

#include "base/arena.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/random_walk.h"
#include <kempe/check.h>

/** Random starts: uniform over all angles, and translations within some characteristic lengths. The loops are then
 * closed. */
typedef struct kmp_random_starts {
    const kempe_system *system;
    const double *from; /* n */
    const bool *still;  /* n: coordinates that keep their values */
    double far;         /* range of a translation, in characteristic lengths */
    double *guess;      /* n: work space */
    unsigned state;     /* of the sequence */
    int starts, closed; /* number of starts so far, and of closed ones */
} kmp_random_starts;

/** Assembles from the next start; kempe_assembly_free frees it. NULL: it did not close. */
kempe_status kmp_random_starts_next(kmp_random_starts *random, kempe_assembly **closed);

/** True if two states (n) differ by at most `within`, scaled. Angles count modulo a turn, angles of spherical joints
 * by the rotations they represent; coordinates of the list `apart` do not count. */
bool kmp_state_same(const kempe_system *system, double within, int apart_count, const int *apart, const double *a,
                    const double *b);

/** True if a comes before b by the first coordinate that differs. */
bool kmp_state_before(const kempe_system *system, double within, const double *a, const double *b);

enum { KMP_MOST_BRANCHES = 64 };

typedef struct kmp_branch {
    double *q;       /* n; angles within half a turn of the model's */
    double residual; /* scaled |h| */
    char *sign;      /* sign of det Jv, block by block in order of solution: '+', '-', '0' when singular */
    int hits;        /* starts that ended here */
} kmp_branch;

struct kempe_branches {
    const kempe_system *system;
    kempe_assembly *assembly; /* the model's */
    bool *kept;               /* n */
    int starts, closed;       /* number of starts, and of closed ones */
    bool many;                /* ended early: more than KMP_MOST_BRANCHES */
    kmp_branch branch[KMP_MOST_BRANCHES];
    int count; /* branch[0] is the model's; the others are sorted by sign, then by q */
    kmp_arena arena;
    kempe_status status;
    char *warnings; /* of the computation, one per line */
};
