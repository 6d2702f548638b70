/* SPDX-License-Identifier: BSD-3-Clause */
/* The adjoint equations (adjoint.c) at all stages of a step at once, in the lanes of vector registers. The times of the
 * stages determine the matrices, which all sweeps of a step share; weights and their rates are in lanes, too: value k
 * of lane l is at k KMP_STAGE_LANES + l. */
#pragma once

#include "analyses/derivatives/varied_lanes.h"
#include "analyses/sensitivity/recorded_motion.h"

typedef struct kmp_adjoint_stages {
    kmp_varied_lanes *lanes;
    kmp_recorded_motion *motion;
    double t_end;
    int p, moving;
    bool known;                /* the matrices belong to these times: */
    double t[KMP_STAGE_LANES]; /* of the motion */
    double *y, *state;         /* 2 p: u and ud at one time; in lanes */
    double *of_state;          /* in lanes, p x 2 p: derivatives of udd by u and ud */
    double *udd;               /* in lanes, p: room */
    bool weighed;              /* the slopes of the last lane are known */
    double *slope;             /* moving, in lanes: room; the slopes of quadratures in the last lane */
} kmp_adjoint_stages;

/** Begins the lanes for a number of unknowns and of quadratures. False: no memory. */
bool kmp_adjoint_stages_begin(kmp_adjoint_stages *stages, kmp_arena *arena, int p, int moving);

/** dy (2 p, in lanes) of the weights at times `back` before the end. The second function: of the quadratures, behind
 * them. KMP_GO; results as of kmp_varied_lanes_run. */
int kmp_adjoint_stages_rates(kmp_adjoint_stages *stages, const double *back, const double *y, double *dy);
int kmp_adjoint_stages_integrands(kmp_adjoint_stages *stages, const double *back, const double *y, double *dy);

/** True if the last lane is at a time: the end of a step. */
bool kmp_adjoint_stages_end_at(const kmp_adjoint_stages *stages, double back);

/** dy there, not in lanes, of weights and quadratures. */
void kmp_adjoint_stages_last(kmp_adjoint_stages *stages, const double *y, double *dy);

/** The derivatives of udd by u and ud (p x 2 p) at the time of a lane. False: none has it. */
bool kmp_adjoint_stages_matrix(const kmp_adjoint_stages *stages, double back, double *matrix);
