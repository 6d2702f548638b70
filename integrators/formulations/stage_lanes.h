/* SPDX-License-Identifier: BSD-3-Clause */
/* A program of a formulation in the lanes of vector registers, for integrators that evaluate several stages of a step
 * at once (kmp_ode.lanes). */
#ifndef KMP_INTEGRATORS_FORMULATIONS_STAGE_LANES_H
#define KMP_INTEGRATORS_FORMULATIONS_STAGE_LANES_H

#include "backend/lanes.h"
#include "constraints/evaluation/evaluator.h"

typedef struct kmp_stage_lanes {
    kmp_lanes *lanes; /* NULL: none */
    int width;
    const kmp_evaluator *eval;
    long chart_version; /* of the charts in the lanes */
    double *mode;       /* conditions in the lanes; NULL: the model has none */
} kmp_stage_lanes;

/** Makes the lanes of a program (NULL: none) with the parameters of the evaluator. false: no memory. */
bool kmp_stage_lanes_init(kmp_stage_lanes *stages, const kmp_program *program, const kmp_evaluator *eval);
void kmp_stage_lanes_free(kmp_stage_lanes *stages);

/** Takes the evaluator's charts and frozen conditions if they have changed. */
void kmp_stage_lanes_renew(kmp_stage_lanes *stages);

/** Number of lanes of this machine. */
int kmp_stage_lanes_width(void);

/** True if all of count values in all lanes are finite. */
bool kmp_stage_lanes_finite(const kmp_stage_lanes *stages, int count, const double *values);

/** True if they exceed `part` of the positive `of` (NULL: 0). */
bool kmp_stage_lanes_exceed(const kmp_stage_lanes *stages, int count, const double *values, double part,
                            const double *of);

#endif
