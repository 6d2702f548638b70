/* SPDX-License-Identifier: BSD-3-Clause */
/* The other assembly modes of a mechanism: closed states that share the kept coordinates with the model's, found by
 * assembling from many starts. Sampling: what is found is there, what is not found may be there all the same. */
#ifndef KMP_CONSTRAINTS_CLOSING_BRANCHES_H
#define KMP_CONSTRAINTS_CLOSING_BRANCHES_H

#include "base/arena.h"
#include "constraints/diagnosis/doctor.h"

/** Random starts: evenly over all angles, and translations within some characteristic lengths, the loops then closed.
 */
typedef struct kmp_scatter {
    const kempe_system *system;
    const double *from; /* n */
    const bool *still;  /* n: coordinates that stay there */
    double far;         /* of a translation, in characteristic lengths */
    double *guess;      /* n: room */
    unsigned state;     /* of the sequence */
    int starts, closed; /* so far; of these closed */
} kmp_scatter;

/** The next start, to be freed by kempe_assembly_free; NULL: it did not close. */
kempe_status kmp_scatter_next(kmp_scatter *scatter, kempe_assembly **closed);

/** Whether two states (n) are one but for `within`, scaled. Angles count to the turn, those of spherical joints by the
 * rotations that they mean; coordinates of the list `apart` do not count. */
bool kmp_state_same(const kempe_system *system, double within, int apart_count, const int *apart, const double *a,
                    const double *b);

/** Whether a comes before b by the first coordinate that differs. */
bool kmp_state_before(const kempe_system *system, double within, const double *a, const double *b);

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
