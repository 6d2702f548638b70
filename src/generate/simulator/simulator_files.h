/* SPDX-License-Identifier: BSD-3-Clause */
/* The files of the runtime of simulators, which the build put into the library. */
#pragma once

typedef struct kmp_simulator_file {
    const char *name;
    const char *const *lines; /* NULL ends them */
} kmp_simulator_file;

/** A file without a name ends them. */
extern const kmp_simulator_file kmp_simulator_files[];

extern const char *const kmp_kempe_simulator_h[];
