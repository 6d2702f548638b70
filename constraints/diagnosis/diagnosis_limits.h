/* SPDX-License-Identifier: BSD-3-Clause */
/* Limits of motion: a mechanism of one degree of freedom moves by arc length in the scaled coordinates. Each step
 * goes along the tangent and is closed again; the turn of the tangent controls its length. */
#pragma once

#include "constraints/diagnosis/diagnosis.h"

/* A part of the examination. The arena records memory failures. */
void kmp_diagnosis_limits(kmp_examination *x);
