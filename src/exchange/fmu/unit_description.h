/* SPDX-License-Identifier: BSD-3-Clause */
/* modelDescription.xml and terminalsAndIcons.xml. */
#pragma once

#include "exchange/fmu/unit_files.h"

/** Writes modelDescription.xml, and the terminals of version 3. False: no memory. */
bool kmp_unit_describe(kmp_text *xml, kmp_text *terminals, const kmp_unit_plan *plan);

/** sources/buildDescription.xml (FMI 3). */
void kmp_unit_build_description(kmp_text *xml, const kmp_unit_plan *plan);
