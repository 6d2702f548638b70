/* SPDX-License-Identifier: BSD-3-Clause */
/* A program of a formulation in the lanes of vector registers, for integrators that evaluate several stages of a step
 * at once (kmp_ode.lanes). */
#pragma once

#include "backend/lanes.h"
#include "constraints/evaluation/evaluator.h"

/* Stages evaluated at once. Registers of four doubles take them in two halves: the integrator's method, and its bits,
 * are those of registers of eight. */
enum { KMP_STAGE_LANES = 8 };

typedef struct kmp_stage_lanes {
    kmp_lanes *lanes; /* NULL: none */
    int width;        /* of a register */
    const kmp_program *program;
    const kmp_evaluator *eval;
    int inputs;    /* numbers of q, and of qd */
    double *times; /* t and the inputs of the model in all lanes */
    double *half;  /* inputs of a half, NULL where there is none; then the outputs of all stages */
    double *outputs;
    long chart_version; /* of the charts in the lanes */
    double *mode;       /* conditions in the lanes; NULL: the model has none */
} kmp_stage_lanes;

/** Makes the lanes of a program (NULL: none) with the parameters of the evaluator, in registers of `width` doubles, 4
 * or
 * 8. `inputs`: numbers of q, and of qd if the program has them. false: no memory. */
bool kmp_stage_lanes_init(kmp_stage_lanes *stages, const kmp_program *program, const kmp_evaluator *eval, int inputs,
                          int width);
void kmp_stage_lanes_free(kmp_stage_lanes *stages);

/** Runs a stage of the program at t, q and qd (NULL: it has none), with the evaluator's charts and frozen conditions.
 * Value k of lane l, also of the outputs, is at k KMP_STAGE_LANES + l. */
const double *kmp_stage_lanes_run(kmp_stage_lanes *stages, int stage, const double *t, const double *q,
                                  const double *qd);

/** True if all of count values in all lanes are finite. */
bool kmp_stage_lanes_finite(int count, const double *values);

/** True if they exceed `part` of the positive `of` (NULL: 0). */
bool kmp_stage_lanes_exceed(int count, const double *values, double part, const double *of);
