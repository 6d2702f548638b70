/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures that align the axes of two points, by rotation vectors. With R the rotation from the axes of the first point
 * to those of the second, of angle theta about the unit vector e, the closure's rows are sin(theta) e. They are zero at
 * half a turn too, where their rank is lower, and from more than a right angle on they lead there. The rotation vector
 * theta e has the same zeros but for that one, and leads to it from every angle. With w the angular velocity of the
 * second point's axes relative to the first's, in the latter, the rates of x = theta e are
 *
 *     x' = w - x cross w / 2 + (1 - theta/2 cot(theta/2)) e cross (e cross w)
 *
 * (Bortz, IEEE Trans. Aerospace and Electronic Systems 7 (1971) 61). */
#pragma once

#include "base/arena.h"
#include "constraints/evaluation/evaluator.h"
#include "model/data/pose.h"

typedef struct kmp_rotation_vectors {
    const kempe_system *system; /* not owned */
    int count;                  /* closures that align axes */
    int *closure;               /* count */
    double *angle;              /* count: rad, of the last measure */
    int *at, *component;        /* m: index of the row's closure, and component of the vector; -1: another row */
    double (*vector)[3];        /* count */
    double (*rates)[3][3];      /* count: from angular velocities in the ground's axes to x' */
    int *side;                  /* count * n: 1: the rotation turns the second point alone, -1: the first alone, 0 */
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
