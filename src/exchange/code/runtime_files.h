/* SPDX-License-Identifier: BSD-3-Clause */
/* Further files that generated code needs: sources of the library, which the build put into it as text. */
#pragma once

#include "base/text.h"

typedef enum kmp_runtime_file {
    KMP_RUNTIME_FUNCTIONS, /* kempe_runtime.h: sine, cosine, functions given by points */
    KMP_RUNTIME_NEWTON,    /* kempe_newton.h: implicit blocks */
    KMP_RUNTIME_NEWTON_PYTHON,
    KMP_RUNTIME_NEWTON_OCTAVE,
    KMP_RUNTIME_CASADI, /* arrays and linear algebra of functions for CasADi, for JAX, for PyTorch */
    KMP_RUNTIME_JAX,
    KMP_RUNTIME_TORCH,
    KMP_RUNTIME_MOTION, /* accelerations, by these */
    KMP_RUNTIME_SIMULATOR_HEADER,
    KMP_RUNTIME_SIMULATOR,
    KMP_RUNTIME_FRICTION, /* kempe_friction.c: friction that sticks, of simulators */
    KMP_RUNTIME_CHARTS,   /* kempe_charts.c: charts of spherical joints, of simulators */
    KMP_RUNTIME_EVENTS,   /* kempe_events.c: bounds of conditions, of simulators */
    KMP_RUNTIME_FILES
} kmp_runtime_file;

const char *kmp_runtime_name(kmp_runtime_file file);
void kmp_runtime_put(kmp_text *text, kmp_runtime_file file);

/** Lines of the files; NULL ends each. */
extern const char *const kmp_runtime_lines[], *const kmp_kempe_newton_h[], *const kmp_kempe_simulator_h[];
extern const char *const kmp_blocks_in_python[], *const kmp_blocks_in_octave[];
extern const char *const kmp_helpers_in_casadi[], *const kmp_helpers_in_jax[], *const kmp_helpers_in_torch[];
extern const char *const kmp_motion_in_python[];
extern const char *const kmp_kempe_simulator_c[], *const kmp_kempe_friction_c[], *const kmp_kempe_charts_c[],
                                                                                     *const kmp_kempe_events_c[];
