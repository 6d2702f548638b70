/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "model/read/reading.h"

/** Roads and tyres, with the states of transient ones. */
void kmp_read_tyres(kmp_reader *r);

/** The forces of tyres, of their names. */
void kmp_add_tyre_forces(kmp_reader *r);
