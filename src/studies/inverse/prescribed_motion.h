/* SPDX-License-Identifier: BSD-3-Clause */
/* A mechanism led along a given motion: at each time some coordinates are what a table says or what the model's drives
 * say, and the others follow by the closures, position by Newton (the branch is kept: small steps where the way there
 * is long), rates and accelerations by one solution each.
 *
 * A drive whose coordinate stands in the table is left out. Independent coordinates are among those of the table; they
 * are exchanged where they go bad. */
#ifndef KMP_STUDIES_INVERSE_PRESCRIBED_MOTION_H
#define KMP_STUDIES_INVERSE_PRESCRIBED_MOTION_H

#include "base/arena.h"
#include "constraints/partition/reduction.h"
#include "studies/inverse/prescribed.h"

typedef struct kmp_guide {
    kmp_arena arena; /* of all rooms */
    const kempe_system *system;
    kmp_plant *plant;
    const kmp_prescribed *motion; /* not owned; NULL: the drives alone */
    bool at_rest;                 /* no motion at all: the start, whose independent coordinates are not accelerated */
    const int *wish;              /* then: coordinates asked for as independent, not owned */
    int wish_count;
    int n, m;
    bool *left_out; /* m: rows that the table stands for */
    bool *given;    /* n: coordinates of the table */
    int *u;         /* n: room for what shall be independent */
    double *masked; /* J without those rows */
    kmp_partition part;
    kmp_reduction red;
    int *sign;               /* of each block of Jv where it was chosen: another one at a trial is another branch */
    double t, *q, *qd, *qdd; /* n: the state */
    double *trial, *move;    /* n */
    double *ud, *udd, *rest; /* n each: independent ones, and scratch */
    double *from, *tq, *tqd, *tqdd; /* n: of the table */
    double off;                     /* largest |q - q of the table| / scale of what is not independent */
    int off_coordinate;
    double off_t;
} kmp_guide;

/** `motion` NULL and not `at_rest`: the drives say all. KEMPE_E_MEMORY, KEMPE_E_ARGUMENT. */
kempe_status kmp_guide_init(kmp_guide *guide, const kempe_system *system, const char *backend,
                            const kmp_prescribed *motion, bool at_rest, const int *wish, int wish_count);
void kmp_guide_free(kmp_guide *guide);

/** Takes the state at t: from the model's start, or where the table gives all coordinates from there. KEMPE_E_FAILED,
 * with what is wrong: the start does not close, what is given does not say how all move, the loops cannot be closed on
 * it. */
kempe_status kmp_guide_start(kmp_guide *guide, double t);

/** Goes on to a later t. KEMPE_E_FAILED: the loops cannot be closed beyond a time that is said. */
kempe_status kmp_guide_advance(kmp_guide *guide, double t);

#endif
