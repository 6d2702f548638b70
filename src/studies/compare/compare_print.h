/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "studies/compare/compare_study.h"

/** The results as members of an open object. */
void kmp_compare_json(kmp_json *json, const kempe_comparison *comparison);
