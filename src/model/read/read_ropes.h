/* SPDX-License-Identifier: BSD-3-Clause */
/* The paths of ropes. */
#pragma once

#include "model/read/reading.h"

/** Reads the section `ropes`, after bodies. */
void kmp_read_ropes(kmp_reader *r);

/** Finds the angles of all paths at the start, and checks that there is a path. After the start is read. */
void kmp_settle_ropes(kmp_reader *r);

/** A coordinate at the start: as it is driven or written. */
double kmp_start_coordinate(const kempe_model *model, int motion, const double *parameters);
