/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/runtime_files.h"

static const struct {
    const char *name;
    const char *const *lines;
} files[KMP_RUNTIME_FILES] = {[KMP_RUNTIME_FUNCTIONS] = {"kempe_runtime.h", kmp_runtime_lines},
                              [KMP_RUNTIME_NEWTON] = {"kempe_newton.h", kmp_kempe_newton_h},
                              [KMP_RUNTIME_NEWTON_PYTHON] = {"", kmp_blocks_in_python}, /* part of the files */
                              [KMP_RUNTIME_NEWTON_OCTAVE] = {"", kmp_blocks_in_octave},
                              [KMP_RUNTIME_CASADI] = {"", kmp_helpers_in_casadi},
                              [KMP_RUNTIME_JAX] = {"", kmp_helpers_in_jax},
                              [KMP_RUNTIME_TORCH] = {"", kmp_helpers_in_torch},
                              [KMP_RUNTIME_MOTION] = {"", kmp_motion_in_python},
                              [KMP_RUNTIME_SIMULATOR_HEADER] = {"kempe_simulator.h", kmp_kempe_simulator_h},
                              [KMP_RUNTIME_SIMULATOR] = {"kempe_simulator.c", kmp_kempe_simulator_c},
                              [KMP_RUNTIME_FRICTION] = {"kempe_friction.c", kmp_kempe_friction_c},
                              [KMP_RUNTIME_CHARTS] = {"kempe_charts.c", kmp_kempe_charts_c},
                              [KMP_RUNTIME_EVENTS] = {"kempe_events.c", kmp_kempe_events_c}};

const char *kmp_runtime_name(kmp_runtime_file file)
{
    return files[file].name;
}

void kmp_runtime_put(kmp_text *text, kmp_runtime_file file)
{
    for (const char *const *line = files[file].lines; *line; line++)
        kmp_text_put(text, *line);
}
