/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations in O(N): articulated bodies, x = M^-1 f without M (Featherstone 1983; the "O(N) scheme" that Fisette
 * and Samin 1996 compare with, section 2.3). */
#pragma once

#include "dynamics/formalisms/newton_euler.h"

/** Rows of closures that the recursion carries from the joints that they couple to the common ancestor of these joints,
 * where their multipliers are eliminated (Brandl, Johanni and Otter 1986). A row that is not kept has the multiplier
 * zero. */
typedef struct kmp_carried {
    int rows;
    const kmp_ref *jacobian; /* rows x n, row by row */
    const kmp_ref *kept;     /* of each row: 1, or 0 */
} kmp_carried;

/** A row at a link between its joints and their common ancestor, or there: the wrench about the link's origin that its
 * unit multiplier adds to what the link needs, until it is eliminated. */
typedef struct kmp_carried_row {
    int row;
    kmp_wrench force;
    kmp_ref effort, share; /* what the multiplier leaves of its force for the joint's own acceleration; over S.U */
} kmp_carried_row;

/** Coordinates of a flexible body, eliminated at the link nearest to the ground that they move, the last one first: for
 * each its pivot, the wrench about that link's origin that its unit acceleration needs, its inertia with the motions
 * that are eliminated later, and its coefficients in rows. */
typedef struct kmp_articulated_elastic {
    const kmp_deformation *of;
    int frame;
    kmp_wrench *at;             /* count x links of the body: until they are eliminated at the innermost one */
    kmp_ref *inertia, *inverse; /* count x count; count */
    kmp_ref *row;               /* rows x count */
    kmp_ref *force;             /* count: what is left of the generalized force, of a solve */
} kmp_articulated_elastic;

/** In the room of the tree's graph, values of the recursion for each joint: its inertia S.U and U / S.U, the wrench
 * that a unit generalized force transmits; and for each row: its pivot, and what couples it with rows that are
 * eliminated later. */
typedef struct kmp_articulated {
    const kmp_tree *tree;
    kmp_ref *inverse;   /* 1 / S.U of each link */
    kmp_wrench *passed; /* U / S.U; the component along the joint is 1 and is not stored */
    kmp_wrench *down;   /* work space of a solve */
    kmp_carried carried;
    int *first;                       /* count + 1: of the rows at each link */
    kmp_carried_row *at;              /* all of them, ascending at each link */
    int *home;                        /* of each row: the link where it is eliminated, 0: the ground */
    kmp_ref *pivot, *diagonal, *over; /* of each row: it, what it would be without rows eliminated before, 1 / pivot */
    kmp_ref *coupling;                /* rows x rows: of a row with the ones that are not eliminated before it */
    kmp_ref *left;                    /* of each row: the curve that is left for its multiplier, of a solve */
    kmp_articulated_elastic *elastic; /* of each flexible body */
    int *region;                      /* of each link: 1 + the flexible body whose coordinates move it; 0: none */
} kmp_articulated;

/** Articulated inertias from the leaves inwards; carried NULL: no rows. KEMPE_E_FAILED: a joint that moves no mass,
 *  S.U = 0, by name; KEMPE_E_MEMORY. */
kempe_status kmp_articulated_init(kmp_articulated *a, const kmp_tree *tree, const kmp_carried *carried);

/** The accelerations (n) and multipliers by the generalized forces (n, NULL: none), where link i needs the wrench
 * share[i] at qdd = 0 (NULL: nothing), and J qdd + curve = 0: M qdd = effort - C + J' lambda. Without shares and rows
 * qdd = M^-1 effort. `open` (n, NULL: not wanted): the part of each acceleration that no multiplier makes. */
typedef struct kmp_articulated_result {
    kmp_ref *qdd, *lambda, *open;
} kmp_articulated_result;
void kmp_articulated_solve(kmp_articulated *a, const kmp_ref *effort, const kmp_wrench *share, const kmp_ref *curve,
                           const kmp_articulated_result *result);
