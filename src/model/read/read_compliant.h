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

/** The journal of a contact: the place of its centre in vector[] of the force, and of a cylindrical one its angular
 * velocity. False after an error. */
bool kmp_read_journal(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force, kmp_journal *journal);

/** The distance of a journal from its bearing, for rigid contacts; with a radius its slip there, of a ball the
 * surfaces. */
void kmp_read_journal_gap(kmp_reader *r, kmp_force *force, const kmp_journal *journal, kmp_contact_pair *pair);

/** A corner of a slider in a guide: its distance from its side of the guide, and in vector[0] the slip. False after an
 * error. */
bool kmp_read_guide(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force, kmp_contact_pair *pair);

/** The word of a slider's corner, NULL after the last one. */
const char *kmp_guide_corner(int k);
