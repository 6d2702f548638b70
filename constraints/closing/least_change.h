/* SPDX-License-Identifier: BSD-3-Clause */
/* Closing the loops by least changes of the scaled coordinates,
 *
 *     dq = S J' y      (J J' + mu^2) y = -h      J scaled, mu = |h| or more.
 *
 * Redundant rows, whose rank is undecided before h is closed, then cause no large steps. Convergence to the nearest
 * closed state remains quadratic (Yamashita and Fukushima, Computing Suppl. 15 (2001) 239). J is dense; a large one
 * is factored sparse as [1 -J'; J mu^2]. */
#pragma once

#include "base/arena.h"
#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include "linalg/sparse.h"
#include "model/data/pose.h"

/* Closures that align the axes of two points, by rotation vectors. With R the rotation from the axes of the first point
 * to the axes of the second, of angle theta about the unit vector e, the closure's rows are sin(theta) e. They are zero
 * at half a turn too, where their rank is lower, and from more than a right angle on they lead there. The rotation
 * vector theta e has the same zeros but for that one, and leads to it from every angle. With w the angular velocity of
 * the second point's axes relative to the first's, in the latter, the rates of x = theta e are
 *
 *     x' = w - x cross w / 2 + (1 - theta/2 cot(theta/2)) e cross (e cross w)
 *
 * (Bortz, IEEE Trans. Aerospace and Electronic Systems 7 (1971) 61). */

typedef struct kmp_rotation_vectors {
    const kempe_system *system; /* not owned */
    int count;                  /* closures that align axes */
    int *closure;               /* count */
    double *angle;              /* count: rad, of the last measure */
    int *at, *component;        /* m: index of the row's closure, and component of the vector; -1: another row */
    double (*vector)[3];        /* count */
    double (*rates)[3][3];      /* count: from angular velocities in the ground's axes to x' */
    int *side;                  /* count * n: 1: the rotation turns only the second point, -1: only the first, 0 */
    kmp_pose *poses;
    double (*axes)[3];
    double *h, *jacobian; /* lent to the evaluator */
} kmp_rotation_vectors;

/** Finds the closures. False: no memory. */
bool kmp_rotation_vectors_init(kmp_rotation_vectors *vectors, const kempe_system *system, kmp_arena *arena);

/** Measures the angles at the evaluator's last closure. */
void kmp_rotation_vectors_measure(kmp_rotation_vectors *vectors, const kmp_evaluator *eval);

/** Replaces, until the next kmp_eval_closure, the closures' rows of h and J at the last one. Entries outside the
 * pattern of J are left out: where a row has some, corrections are less exact. */
void kmp_rotation_vectors_lend(kmp_rotation_vectors *vectors, kmp_evaluator *eval);

typedef struct kmp_least_change {
    kmp_evaluator *eval;           /* not owned */
    kmp_rotation_vectors *vectors; /* not owned: rows of closures that align axes are these; NULL: their own */
    const bool *hold;              /* n, not owned: coordinates that stay; NULL: none */
    const double *scale;           /* n, not owned: of coordinates; at first of the system */
    double *entry;       /* entries of the scaled J, in its order; zero for held coordinates and for rows that need not
                          * be met */
    int *start, *column; /* n + 1; entries column by column */
    double *right;       /* n + m */
    double *dx;          /* n */
    double *matrix;      /* m x m; values when sparse */
    double damping;      /* damping of the last factorisation */
    kmp_sparse *sparse;
    kmp_arena arena;
} kmp_least_change;

/** Allocates all memory; false: no memory. */
bool kmp_least_change_init(kmp_least_change *least, kmp_evaluator *eval);
void kmp_least_change_free(kmp_least_change *least);

kmp_closer kmp_least_change_closer(kmp_least_change *least);

/** Rule of convergence in which long corrections are cut. */
kmp_close_rule kmp_least_change_rule(int most);
