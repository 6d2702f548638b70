/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes of friction elements that stick (dynamics/kinematics/friction_modes.h), decided between steps: at the start, at
 * events, and wherever conditions or inputs have changed. All elements at rest are decided together. Their forces f and
 * the accelerations a of their places are related by a = a0 + D f, f within the levels, and a = 0 inside them: the
 * minimum of a quadratic function in a box (linalg/dense/box_minimum.h). Levels that depend on multipliers depend on f;
 * they are iterated (Glocker 2001, section 7).
 *
 * Elements that stick become rows of J, as far as these are independent of other rows. If other elements that stick
 * imply a row, its element keeps the force of this solution until the next event. If other rows imply it, the rate is
 * theirs: it slips, or rests without a force. */
#pragma once

#include "integrators/friction/friction_site.h"
#include "integrators/run/run.h"

struct kmp_friction_element;

/** The number of elements among conditions. */
int kmp_friction_elements(const kmp_events *events);

/** Lists the elements: their conditions, rows, numbers, and relations to each other. */
void kmp_friction_list(const kempe_system *s, const kmp_events *events, struct kmp_friction_element *element);

/** Makes the workspace in the run's arena. NULL: no memory, or the system has no such elements (*none). */
kmp_friction_run *kmp_friction_new(kmp_runner *run, bool *none);

/** Frees the saddle system of a decision under way, which a site shares: the system of run->part, before other rows
 * are chosen. */
void kmp_friction_release(kmp_runner *run);
struct kmp_shared_saddle *kmp_friction_saddle(const kmp_runner *run);

/** Forgets the rows of elements, which a decision evaluates once at a place: conditions or parameters may have changed.
 */
void kmp_friction_forget_rows(kmp_runner *run);

/** Lets go of all rows at an event, after small rates along rows of contacts have been removed, and chooses rows and
 * coordinates without them. If there is a formulation, its rows and coordinates are noted. */
kempe_status kmp_friction_release_rows(kmp_runner *run, double t, double *q, double *qd);

/** True after a decision if the same elements hold rows as before it; run->part then belongs to the formulation. */
bool kmp_friction_holds_as_before(const kmp_runner *run);

/** Ends the decision that kmp_friction_release_rows has begun: its saddle system remains for the next one. */
void kmp_friction_end_decision(kmp_runner *run);

/** Forgets what kmp_friction_release_rows has noted: closures have changed. */
void kmp_friction_drop_kept(kmp_runner *run);

/** Appends that a body has almost no inertia in one direction, if this may be why a decision with D (n x n) fails. */
void kmp_friction_put_spread(kmp_text *text, int n, const double *d);

/** s: the span of the run of which instants are parts. */
double kmp_friction_span(const kmp_runner *run);

/** 1/s: the rate of the motion. */
double kmp_friction_pace(const kmp_runner *run, const double *qd);

/** True if a level of friction that sticks depends on multipliers. */
bool kmp_friction_is_loaded(const kempe_model *model);

/** True while an element is regularised for a time; also without elements (NULL). */
bool kmp_friction_is_smooth(const kmp_friction_run *x);

/** True if the motion has depended on how redundant contacts share their loads; x may be NULL. */
bool kmp_friction_feels_sharing(const kmp_friction_run *x);

/** Decides on modes at t and the state (q, qd), whose rates are made consistent with the rows that are held. Chooses
 * rows and coordinates, and computes run->qdd and run->lambda. KEMPE_E_FAILED with a message where no modes are
 * possible. */
kempe_status kmp_friction_settle(kmp_runner *run, double t, double *q, double *qd);

/** The same at an event at which no other condition has changed: elements that are held and not connected with what
 * changes stay as they are. */
kempe_status kmp_friction_settle_changed(kmp_runner *run, double t, double *q, double *qd);

/** Lists what friction knows of its past; returns the number of pieces. Their size in all. */
int kmp_friction_memory(kmp_friction_run *x, kmp_memory_piece *piece);
size_t kmp_friction_memory_size(const kmp_events *events);

/** Takes the numbers of the elements from the model and the system: after the memory of a motion with other parameters.
 * Also without elements. */
void kmp_friction_renew(kmp_runner *run);

/** After a step to t: examines contacts that share loads, as a decision does. Sharing may begin to count where loads or
 * levels change without an event. */
kempe_status kmp_friction_watch_shared(kmp_runner *run, double t);

/** Marks a contact by its first condition, for the ensemble of a run, in the place of one of its roles: it shares its
 * load, and the motion depends on how (SENSE) or does not (HELD); it has been struck (LEVEL). */
void kmp_mark_contact(const kempe_system *system, int slot, kmp_role role);

/** Puts the forces of all elements, friction and contacts, in place of the multipliers of their rows, in a row at t. */
void kmp_friction_show(kmp_runner *run, double t, double *row);
