/* SPDX-License-Identifier: BSD-3-Clause */
/* Possible independent coordinates; the loops as blocks of Jv in order of solution, with their closures. */
#pragma once

#include "constraints/diagnosis/diagnosis.h"

/* A part of the examination. The arena records memory failures. */
void kmp_diagnosis_alternatives(kmp_examination *x);
