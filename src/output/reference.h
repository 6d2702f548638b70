/* SPDX-License-Identifier: BSD-3-Clause */
/* Reference values from a CSV file: columns t, q.NAME, qd.NAME, qdd.NAME, lambda.CLOSURE.k. Fields may be empty, lines
 * beginning with # are comments, columns of other outputs in tables (model/data/output_kinds.def) are skipped. */
#pragma once

#include "output/samples.h"

/** The rows to compare with, times ascending from 0; rows of a run serve as well. */
typedef kmp_samples kmp_reference;

/** KEMPE_E_IO, or KEMPE_E_INPUT with file:line:column for each error (unknown column with the nearest known name, a
 * field that is not a number, times not ascending). */
kempe_status kmp_reference_read(const kempe_system *system, const char *path, kmp_reference *reference);
