/* SPDX-License-Identifier: BSD-3-Clause */
/* The multipliers that forces depend on (constraints/evaluation/load_multipliers.h) by Newton's method in a written
 * program, which has C, the residual and the step in one stage (load_newton.h): for one state, or for states in lanes.
 */
#pragma once

#include "backend/lanes.h"
#include "backend/machine.h"
#include "base/arena.h"
#include "constraints/partition/partition.h"

typedef struct kmp_load_passes {
    size_t width;                  /* states */
    int n, m, loads;               /* sizes of C and of all rows; number of such multipliers of the partition */
    int *row;                      /* loads: of all rows */
    const double *scale, *weight;  /* n, m: scales of coordinates and rows, the latter in all rows */
    bool by_state;                 /* these are given for each state, value k of state l at k width + l */
    double *nu;                    /* m x width: the multipliers, likewise */
    bool settled[KMP_LANES_MOST];  /* of each state */
    double energy[KMP_LANES_MOST]; /* the largest residual times the scale of its row, in the pass before */
    int pass;
} kmp_load_passes;

/** The place of a row among the independent rows of a partition; -1: it is not one of them. */
int kmp_load_place(const kmp_partition *part, int row);

/** The load rows of a partition, in their order: returns how many. Room for all load rows. */
int kmp_load_rows(const kempe_system *system, const kmp_partition *part, int *row);

/** Room for this number of states of a system in an arena, with the scales of the system. False: no memory. */
bool kmp_load_passes_init(kmp_load_passes *passes, kmp_arena *arena, const kempe_system *system,
                          const kmp_partition *part, size_t width);

/** Begins from these multipliers (m) in all states. NULL: from `nu`. */
void kmp_load_begin(kmp_load_passes *passes, const double *nu);

/* Stages of a program with such multipliers: values that do not depend on them, and the outputs of a pass. */
enum { KMP_LOADS_APART = 1, KMP_LOADS_PASS };

/** Runs passes from the present multipliers, at states that the machine or the lanes have, until all states are
 * settled, or will not be: then false. */
bool kmp_load_settle_one(kmp_load_passes *passes, kmp_machine *machine);
bool kmp_load_settle_lanes(kmp_load_passes *passes, kmp_lanes *lanes);

/** Operations of an evaluation whose last stage is `last`: of two passes. */
kmp_counts kmp_load_count(const kmp_program *program, int last);
