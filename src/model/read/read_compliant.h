/* SPDX-License-Identifier: BSD-3-Clause */
/* Readers of compliant contacts and of joints with clearance. */
#pragma once

#include "model/data/compliant.h"
#include "model/read/reading.h"

/** A journal in its bearing, or a ball in its socket. */
typedef struct kmp_journal {
    const kmp_expr *clearance, *radius; /* radial clearance; radius of the bearing, NULL: not given */
    bool ball;
} kmp_journal;

/** A contact with a law. */
void kmp_read_compliant(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force);

/** True if such a mapping has a law that depends on the rate at the beginning of contact, and so a state. */
bool kmp_contact_keeps_rate(const kmp_yaml *map);
