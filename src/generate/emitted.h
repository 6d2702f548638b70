/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "generate/source.h"

/** What the files of a generation were made of. */
const kmp_code_source *kmp_code_source_of(const kempe_code *code);
