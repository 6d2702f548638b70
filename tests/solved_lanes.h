/* SPDX-License-Identifier: BSD-3-Clause */
/* A solved program in lanes, for tests and measurements. */
#pragma once

#include "backend/lanes.h"
#include "constraints/programs/saddle_program.h"

/* Takes the parameters, charts and conditions of the evaluator. */
static inline void renew_solved_lanes(const kmp_evaluator *eval, int width, kmp_lanes *lanes)
{
    for (int lane = 0; lane < width; lane++) {
        kmp_lanes_set_one(lanes, KMP_IN_PARAMETER, lane, eval->system->parameters);
        kmp_lanes_set_one(lanes, KMP_IN_CHART, lane, eval->chart);
        kmp_lanes_set_one(lanes, KMP_IN_MODE, lane, eval->conditions.mode);
    }
    (void)kmp_lanes_run(lanes, KMP_STAGE_PARAMETERS);
}

/* NULL: no memory. They must not outlive `solved`. */
static inline kmp_lanes *solved_lanes(const kmp_saddle_program *solved, const kmp_evaluator *eval, int width)
{
    kmp_lanes *lanes = kmp_lanes_new(kmp_saddle_program_code(solved), width, false);
    if (lanes)
        renew_solved_lanes(eval, width, lanes);
    return lanes;
}
