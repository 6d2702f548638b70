/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions that goals of the start are about, with their first and second derivatives; places of joints with
 * clearance, and coordinates of cut joints where the start gives one, with their first derivatives. */
#pragma once

#include "dynamics/equations.h"
#include "symbolic/program.h"

/* Stages; each point with a goal has three values x, y, z. */
enum {
    KMP_STAGE_PLACE = 1, /* q: the values of all points, then each value's derivative along all n coordinates; the same
                            of the lengths of joints with clearance, and of the coordinates of all cut joints */
    KMP_STAGE_BEND       /* qd: each value's second derivative along qd, only of points */
};

/** The number of values of the goals of points. */
int kmp_goals_place_count(const kempe_model *model);

/** The number of lengths that are zero where joints with clearance are centred, and of the lengths of one contact. */
int kmp_goals_centred_count(const kempe_model *model);
int kmp_goals_centred_of(const kmp_force *force);

/** The program of these values; *program stays NULL when there are none of these. False: no
 * memory. */
bool kmp_goals_program(kmp_equations *eq, kmp_program **program);
