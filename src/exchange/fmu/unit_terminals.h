/* SPDX-License-Identifier: BSD-3-Clause */
/* terminalsAndIcons.xml (FMI 3). Variables that belong together are a terminal: an input with its derivatives, a
 * coordinate with its rate, the components of the position, velocity and acceleration of a point. */
#pragma once

#include "exchange/fmu/unit_parts.h"

/** terminalsAndIcons.xml: terminals for variables that belong together, and the place of the icon. */
void kmp_unit_terminals(kmp_text *xml, const kmp_unit_variable *variables, int count);
