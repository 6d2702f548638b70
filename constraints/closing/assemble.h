/* SPDX-License-Identifier: BSD-3-Clause */
/* Assembly: the loops closed from the model's guess, rates made consistent. */
#ifndef KMP_CONSTRAINTS_CLOSING_ASSEMBLE_H
#define KMP_CONSTRAINTS_CLOSING_ASSEMBLE_H

#include "base/arena.h"
#include "constraints/closing/goals.h"
#include "dynamics/system.h"

struct kempe_assembly {
    const kempe_system *system;
    kmp_arena arena;
    double *q, *qd;  /* n */
    double residual; /* max |h| / row scale */
    double gap;      /* widest gap of a closure, m */
    bool closed;
    bool *dropped;      /* m: closed: rows that stay open because they say what others say but for rounding */
    double *open;       /* m: scaled |h| */
    double *pivots;     /* m + n: of J there */
    double misfit;      /* the widest of the dropped ones, scaled */
    bool rates_changed; /* the given rates contradict the closures: they were corrected */
    double rates_left;  /* what prescribed motions ask for and the closures do not allow: of the fastest scaled rate */
    int iterations;
    double *gaps;  /* gap of each closure, m, in the order of the model */
    int *culprits; /* closures that remain open, largest gap first */
    int culprit_count;
    double *moved;                      /* n: how far each coordinate went from the guess */
    double *inner_q, *inner_qd, *chart; /* the same state in the charts that it was found in; NULL: in the user's own */
    kmp_goals_verdict goals;
};

/* kempe_assemble and kempe_assembly_free are the way in (kempe.h). */

/** Where to begin and what must not move. */
typedef struct kmp_guess {
    const double *q;  /* n */
    const bool *hold; /* n */
    int pushes;       /* how often it is pushed aside where it comes to rest with h open */
    bool goals;       /* the model's goals are sought once it is closed */
    int rank; /* of J, whose other rows stay open by rounding of the model's numbers; 0: what the system has found */
} kmp_guess;

/** The same from any guess; whether it closed is in the assembly, without a complaint. Errors: memory alone. */
kempe_status kmp_assemble_from(const kempe_system *system, const kmp_guess *guess, kempe_assembly **assembly);

/** kempe_assemble without a complaint: whether it closed is in the assembly. */
kempe_status kmp_assemble_start(const kempe_system *system, kempe_assembly **assembly);

/** Whether the rate of coordinate k was given and could not be kept. */
bool kmp_assembly_changed_rate(const kempe_assembly *assembly, int k);

/** Says so of each, a sentence a line. */
void kmp_assembly_put_rates(kmp_text *text, const kempe_assembly *assembly);

/** An empty one; NULL when there is no memory. */
kempe_assembly *kmp_assembly_new(const kempe_system *system);

#endif
