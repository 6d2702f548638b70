/* SPDX-License-Identifier: BSD-3-Clause */
/* The C file with the table of equations that kempe_simulator.c reads: names, sizes, a start, and functions of one
 * form for all models. */
#pragma once

#include "exchange/code/source.h"

/** Adds NAME_simulator.h, NAME_simulator.c and the files of the runtime. False: no memory. */
bool kmp_simulator_pages(const kmp_code_source *source, kmp_code_files *files);
