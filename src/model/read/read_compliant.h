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

/** The journal of a contact: the place of its centre in vector[] of the force, and of a cylindrical one its angular
 * velocity. False after an error. */
bool kmp_read_journal(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force, kmp_journal *journal);

/** The film of a journal. NULL after an error. */
const kmp_film *kmp_read_film(kmp_reader *r, const kmp_yaml *map, const char *of, const kmp_expr *clearance,
                              const kmp_expr *radius);

/** Its distance from the bearing, for rigid contacts; with a radius its slip there, of a ball the surfaces. */
void kmp_read_journal_gap(kmp_reader *r, kmp_force *force, const kmp_journal *journal, kmp_contact_pair *pair);

/** The surfaces of a ball with a radius: a sphere in a hollow one. */
void kmp_read_ball_surfaces(kmp_reader *r, const kmp_force *force, const kmp_journal *journal, kmp_contact_pair *pair);

/** A corner of a slider in a guide: its distance from its side of the guide, and in vector[0] the slip. False after an
 * error. */
bool kmp_read_guide(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force, kmp_contact_pair *pair);

/** The word of a slider's corner, NULL after the last one. */
const char *kmp_guide_corner(int k);

/** A number as an expression; a formula of this program over locals; a further local. NULL: no memory. */
const kmp_expr *kmp_read_as_expr(kmp_reader *r, const kmp_number *number);
const kmp_expr *kmp_read_formula(kmp_reader *r, const char *text, const kmp_expr_locals *locals);
void kmp_add_local(kmp_expr_locals *locals, const char *name, const kmp_expr *expr);
