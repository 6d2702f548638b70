/* SPDX-License-Identifier: BSD-3-Clause */
/* The values of a model's states along a prescribed motion, from a table or from a run along the drives. States that
 * change at instants keep the value of the row before. */
#pragma once

#include "analyses/inverse/prescribed_motion.h"
#include "output/reference.h"
#include "output/samples.h"

typedef struct kmp_prescribed_states {
    kmp_prescribed table; /* as if they were coordinates */
    double *run;          /* rows x states: of a run along the drives; NULL: none */
    int rows;             /* of it */
    double *now;          /* 3 states: values, and room; NULL: they have the values of the start */
} kmp_prescribed_states;

/** Reads them from a table, which has columns for them, at a path. KEMPE_E_MODEL: a value is missing. Arrays are of the
 * arena. */
kempe_status kmp_prescribed_states_read(kmp_prescribed_states *states, kmp_arena *arena, const kempe_system *system,
                                        const kmp_reference *reference, const char *path);

/** Runs along the drives, with rows at these times. Errors as kmp_run. */
kempe_status kmp_prescribed_states_run(kmp_prescribed_states *states, kmp_arena *arena, const kempe_system *system,
                                       const kmp_times *times, const char *backend);
void kmp_prescribed_states_free(kmp_prescribed_states *states);

/** The values at the k-th instant, t; NULL: of the start. */
const double *kmp_prescribed_states_at(kmp_prescribed_states *states, const kempe_model *model, int k, double t);
