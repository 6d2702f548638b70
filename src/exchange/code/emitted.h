/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "exchange/code/source.h"

/** The data from which the files of a generation are made. */
const kmp_code_source *kmp_code_source_of(const kempe_code *code);
