/* SPDX-License-Identifier: BSD-3-Clause */
/* modelDescription.xml. The order of variables and their value references are those of kempe_fmu.h. */
#pragma once

#include "exchange/fmu/unit_parts.h"

/** Writes modelDescription.xml, and the terminals of version 3. False: no memory. */
bool kmp_unit_describe(kmp_text *xml, kmp_text *terminals, const kmp_unit_plan *plan);

/** An attribute whose value is escaped. */
void kmp_unit_attribute(kmp_text *xml, const char *name, const char *value);

/** sources/buildDescription.xml (FMI 3). */
void kmp_unit_build_description(kmp_text *xml, const kmp_unit_plan *plan);
