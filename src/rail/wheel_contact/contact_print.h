/* SPDX-License-Identifier: BSD-3-Clause */
/* A table of contacts as text, JSON and CSV. */
#pragma once

#include "base/context.h"
#include <kempe/vehicle.h>

/** The SI unit of swept quantity k; "" for a parameter. Its form in results, and the unit of an angle. */
const char *kmp_contact_unit(const kempe_contacts *table, int k);
kmp_shown kmp_contact_shown(const kempe_contacts *table, const char *unit);
