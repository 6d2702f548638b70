/* SPDX-License-Identifier: BSD-3-Clause */
/* Assembly modes by signs: with some coordinates independent, the others are solved in the diagonal blocks of Jv, one
 * after the other, and between two modes the determinant of a block passes through zero. */
#pragma once

#include "base/arena.h"
#include "constraints/partition/partition.h"

/** The blocks for independent coordinates, and J at one state. */
typedef struct kmp_mode_signs {
    const kempe_system *system;
    kmp_evaluator *eval; /* not owned */
    kmp_arena arena;
    kmp_partition part; /* r = 0: no signs */
    kmp_loop_block *blocks;
    int block_count;
    int *level;            /* n: the block of a dependent coordinate; block_count: an independent one */
    int *column, *row;     /* n, m: place in the block; -1: none */
    int *first, *entry;    /* block_count + 1; entries of J in the columns of a block */
    double *unit;          /* n: of the coordinates */
    double *matrix;        /* n x n */
    int *order;            /* n */
    bool *centred;         /* of each spherical joint: its angles are all dependent */
    double *chart, *place; /* of all spherical joints; n */
} kmp_mode_signs;

/** Begins with the joints that are centred for independent coordinates `kept` (n). False: no memory; it must be freed
 * also then. */
bool kmp_mode_signs_init(kmp_mode_signs *signs, kmp_evaluator *eval, const bool *kept);
void kmp_mode_signs_free(kmp_mode_signs *signs);

/** Chooses rows and v by the entries of J, with the kept coordinates in u if these can be independent. False: no
 * memory. */
bool kmp_mode_signs_choose(kmp_mode_signs *signs, const bool *kept, const double *jacobian);

/** J at (t, q), in the user's angles. A spherical joint whose angles are all dependent is centred: its columns are then
 * turns about axes that depend only on its rotation. By the angles, det Jv would have another sign on the other side
 * of their singular position, where the mechanism has none, and for other angles of the same rotation. */
void kmp_mode_signs_evaluate(kmp_mode_signs *signs, double t, const double *q);

/** '+' or '-': the sign of the determinant of block b at the last state; '0': singular, or not certain. */
char kmp_mode_sign(const kmp_mode_signs *signs, int b);

/** Changes of the assembly mode along a motion, with the coordinates `kept` (n) independent. t, q (n): a state at which
 * the blocks are chosen; where rows are redundant, the rows with the largest pivots are chosen again at each state.
 * `released` (m): rows that do not hold; NULL: all hold. NULL: the kept coordinates are not independent or do not
 * determine the others, more than 60 coordinates are solved together, or memory is exhausted. */
typedef struct kmp_mode_watch kmp_mode_watch;
kmp_mode_watch *kmp_mode_watch_new(const kempe_system *system, const bool *kept, double t, const double *q,
                                   const bool *released);
void kmp_mode_watch_free(kmp_mode_watch *watch);

/** The next state (t, q). The block of coordinates whose sign has changed since the last state where both were certain,
 * owned by the watch; NULL: none. */
const kmp_loop_block *kmp_mode_watch_next(kmp_mode_watch *watch, double t, const double *q);
