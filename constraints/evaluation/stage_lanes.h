/* SPDX-License-Identifier: BSD-3-Clause */
/* A program of a mechanism at several states at once, in the lanes of vector registers: for integrators that evaluate
 * several stages of a step together (kmp_ode.lanes), and for tables of states. */
#pragma once

#include "backend/lanes.h"
#include "constraints/evaluation/evaluator.h"

/* Stages evaluated at once, also where registers have four doubles: the integrator's method, and its bits, are the same
 * everywhere. */
enum { KMP_STAGE_LANES = 8 };

typedef struct kmp_stage_lanes {
    kmp_lanes *lanes; /* NULL: none */
    const kmp_evaluator *eval;
    double *times;            /* t and the inputs of the model in all lanes */
    long chart_version;       /* of the charts in the lanes */
    double *mode;             /* conditions in the lanes; NULL: the model has none */
    const double *parameters; /* of the program; NULL: of the evaluator's system */
} kmp_stage_lanes;

/** Makes the lanes of a program (NULL: none) with the parameters of the evaluator. false: no memory. */
bool kmp_stage_lanes_init(kmp_stage_lanes *stages, const kmp_program *program, const kmp_evaluator *eval);
/** Makes the lanes of a program with other parameters, which must outlive them. */
bool kmp_stage_lanes_init_varied(kmp_stage_lanes *stages, const kmp_program *program, const kmp_evaluator *eval,
                                 const double *parameters);
void kmp_stage_lanes_free(kmp_stage_lanes *stages);

/** Takes another evaluator of the same system, and the present parameters. No allocation. */
void kmp_stage_lanes_take(kmp_stage_lanes *stages, const kmp_evaluator *eval);

/** Runs a stage of the program at t, q and qd (NULL: it has none), with the evaluator's charts and frozen conditions.
 * Value k of lane l, also of the outputs, is at k KMP_STAGE_LANES + l. */
const double *kmp_stage_lanes_run(kmp_stage_lanes *stages, int stage, const double *t, const double *q,
                                  const double *qd);

/** Only sets these, for runs of several stages by kmp_lanes_run. */
void kmp_stage_lanes_place(kmp_stage_lanes *stages, const double *t, const double *q, const double *qd);

/** Copies the values of lanes to a row of `count` for each of them. */
void kmp_stage_lanes_rows(int count, const double *values, double *rows);

/** True if all of count values in all lanes are finite. */
bool kmp_stage_lanes_finite(int count, const double *values);

/** True if they exceed `part` of the positive `of` (NULL: 0). */
bool kmp_stage_lanes_exceed(int count, const double *values, double part, const double *of);
