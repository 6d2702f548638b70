/* SPDX-License-Identifier: BSD-3-Clause */
/* Units that texts, tables, pictures and pages show in place of SI units, by the system that the user has chosen. */
#pragma once

#include <stdbool.h>

/** si; mm: mm, kg, s, N, N mm, MPa, with J and W; us: in, lb, s, lbf, lbf in, psi, hp. */
typedef enum kmp_unit_system { KMP_UNITS_SI, KMP_UNITS_MM, KMP_UNITS_US, KMP_UNIT_SYSTEMS } kmp_unit_system;

/** The choice of units of results: a system, and degrees in place of radians. Zero is SI. */
typedef struct kmp_shown_in {
    kmp_unit_system system;
    bool degrees;
} kmp_shown_in;

/** A unit of SI as results show it, and the factor of their numbers. */
typedef struct kmp_shown {
    const char *unit;
    double factor;
} kmp_shown;

/** Names of units that were made, which last as long as this list. */
typedef struct kmp_shown_units kmp_shown_units;
kmp_shown_units *kmp_shown_units_new(void);
void kmp_shown_units_free(kmp_shown_units *made);

/** The system of a name, "si", "mm" or "us"; KMP_UNIT_SYSTEMS: there is none. */
kmp_unit_system kmp_unit_system_find(const char *name);

const char *kmp_unit_system_name(kmp_unit_system system);

/** A product of units of SI with decimal powers, "N m", "kg m^2", "N/m^1.5", "rad/(N m)": as it is shown. Without
 * memory for its name, and where it has no other, the unit itself. Angles and their rates are in degrees where they are
 * chosen; stiffnesses in N m/rad remain per radian. */
kmp_shown kmp_shown_units_get(kmp_shown_units *made, kmp_shown_in in, const char *unit);
