/* SPDX-License-Identifier: BSD-3-Clause */
/* The programs of derivatives at a group of states of a workspace, in the lanes of vector registers, after its
 * equations (state_workspace.h), with the bits that they have at each of them separately. */
#pragma once

#include "constraints/evaluation/stage_lanes.h"
#include "constraints/partition/reduction.h"
#include "constraints/workspace/state_workspace.h"

struct kmp_derivative_point;

typedef struct kmp_derivative_lanes {
    kmp_arena arena, named;                       /* `named`: of rows of the names and outputs */
    size_t seen;                                  /* states in calls for many, until the lanes are prepared */
    kmp_stage_lanes tangents, equations, outputs; /* the last two: of the names, and of outputs; without lanes: none */
    bool ready, names_ready;
    kmp_reduction red[KMP_STAGE_LANES]; /* at each state */
    int tangent_count, name_count, output_count;
    double *qdd, *lambda, *answer; /* in lanes; a row of both for each lane */
    double *tangent_rows, *name_rows, *output_rows;
} kmp_derivative_lanes;

/** Decides whether groups of states run in lanes, which are made once enough states have been seen. */
bool kmp_derivative_lanes_by(kempe_workspace *ws, int count);
void kmp_derivative_lanes_free(kmp_derivative_lanes *lanes);

/** Removes the lanes of names and outputs. */
void kmp_derivative_lanes_forget(kmp_derivative_lanes *lanes);

/** Solves the equations at a group of states (rows of q, qd and Q; NULL: none) and evaluates their derivatives. false:
 * some state needs other means, or fails. */
bool kmp_derivative_lanes_run(kempe_workspace *ws, const double *t, int t_step, const double *q, const double *qd,
                              const double *Q, bool closed);

/** Takes the state of a lane, as kmp_derivative_point_take does; the workspace `keeps` copies of its values. It is to
 * be given back before another one. */
void kmp_derivative_lanes_take(kempe_workspace *ws, const double *q, const double *qd, int lane, bool keeps,
                               struct kmp_derivative_point *point);
void kmp_derivative_lanes_give_back(kempe_workspace *ws, int lane);
