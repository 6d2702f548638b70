/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions that goals of the start are about, with their first and second derivatives. */
#pragma once

#include "dynamics/equations.h"
#include "symbolic/program/program.h"

/* Stages; each point with a goal has three values x, y, z. */
enum {
    KMP_STAGE_PLACE = 1, /* q: the values of all points, then each value's derivative along all n coordinates */
    KMP_STAGE_BEND       /* qd: each value's second derivative along qd */
};

/** The number of values of the goals of points. */
int kmp_goals_place_count(const kempe_model *model);

/** The program of these values; *program stays NULL when no goal concerns a point. False: no memory. */
bool kmp_goals_program(kmp_equations *eq, kmp_program **program);
