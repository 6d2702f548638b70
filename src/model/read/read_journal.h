/* SPDX-License-Identifier: BSD-3-Clause */
/* Geometry of joints with clearance: the journal in its bearing, the ball in its socket, the slider in its guide.
 * Each is read for compliant and for rigid contacts. */
#pragma once

#include "model/read/read_compliant.h"

/** The journal of a contact: the place of its centre in vector[] of the force, and of a cylindrical one its angular
 * velocity. False after an error. */
bool kmp_read_journal(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force, kmp_journal *journal);

/** The distance of a journal from its bearing, for rigid contacts; with a radius its slip there, of a ball the
 * surfaces. */
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
