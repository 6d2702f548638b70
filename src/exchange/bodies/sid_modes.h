/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies as standard input data (SID), a text: O. Wallrapp, "Standardization of flexible body modeling in
 * multibody system codes, part I: definition of standard input data", Mechanics of Structures and Machines 22 (1994).
 */
#pragma once

#include "model/flexible/modal_file.h"

bool kmp_sid_modes_read(const kmp_modal_source *source);
