/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/simulator/simulator_files.h"
#include <stddef.h>

const kmp_simulator_file kmp_simulator_files[] = {{"kempe_simulator.h", kmp_kempe_simulator_h}, {NULL, NULL}};
