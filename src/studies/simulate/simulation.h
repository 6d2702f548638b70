/* SPDX-License-Identifier: BSD-3-Clause */
/* A simulation in its stages, which src/pipeline.c calls in order. */
#pragma once

#include "output/times.h"
#include "studies/simulate/run_judge.h"
#include "studies/simulate/trajectory.h"

/** All that a simulation needs until it is done. */
typedef struct kmp_simulation {
    const kempe_system *system;
    kempe_context *context;
    const kempe_run_options *run;
    kmp_arena arena;
    kmp_run_spec spec;
    kmp_reference reference;
    bool has_reference;
    kmp_times times;
    kmp_samples before;          /* rows of the checkpoint to continue from */
    kmp_past *past;              /* of delayed signals in it; NULL: none */
    kmp_program_cache_past kept; /* for the checkpoint of this run */
    kempe_assembly start;
    void *judge_needs; /* what the judge of a wing needs; NULL: it does not judge */
    kmp_step_counts counts;
    bool least_norm;              /* loads that redundant constraints share */
    kempe_trajectory *trajectory; /* the result; NULL: there is none yet */
} kmp_simulation;
