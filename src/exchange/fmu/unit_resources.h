/* SPDX-License-Identifier: BSD-3-Clause */
/* The model in the resources of a unit on the library: its files, in folders as they were. */
#pragma once

#include "exchange/code/source.h"

/** Adds the files of the model to the archive, below resources/. */
kempe_status kmp_unit_add_resources(kmp_code_files *files, kmp_arena *arena, const kempe_model *model);
