/* SPDX-License-Identifier: BSD-3-Clause */
/* Dependencies of computed variables: by the arguments that the generated routines read. Coordinates follow from the
 * states through the closures, accelerations and multipliers from all that the routines of the motion read. */
#pragma once

#include "exchange/fmu/unit_parts.h"

/** Dependencies of computed variables of a unit of sources; NULL: no memory. */
kmp_unit_structure *kmp_unit_structure_new(kmp_arena *arena, const kmp_code_source *source);

/** True for a variable whose dependencies are known, by its reference. */
bool kmp_unit_has_dependencies(unsigned reference);

/** True where the computed variable may depend on a known one, a state or an input. */
bool kmp_unit_depends(const kmp_unit_structure *structure, unsigned reference, unsigned known);
