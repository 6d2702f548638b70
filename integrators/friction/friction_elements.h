/* SPDX-License-Identifier: BSD-3-Clause */
/* Elements of friction that sticks: their inputs and values. */
#pragma once

#include "integrators/friction/friction_inside.h"

/** The value of a role at the last measurement. */
KMP_LOCAL double kmp_friction_at(const kmp_friction_run *x, const kmp_friction_element *e, kmp_role role);

/** The level of friction in slip (KMP_ROLE_LEVEL) or at rest (KMP_ROLE_STATIC), against positive rates (way = 1) or
 * negative ones (-1), INFINITY where it has no limit; 0 for a contact, whose values of these roles are its restitution
 * and its coefficient of friction. */
KMP_LOCAL double kmp_friction_level_at(const kmp_friction_run *x, const kmp_friction_element *e, kmp_role role,
                                       double way);

/** The largest friction at rest against these rates: the static level, at least the level, not negative. */
KMP_LOCAL double kmp_friction_bound(const kmp_friction_run *x, const kmp_friction_element *e, double way);

/** Sets the input of a role. */
KMP_LOCAL void kmp_friction_put(kmp_friction_run *x, const kmp_friction_element *e, kmp_role role, double input);

/** A rate of friction that counts as none, in sizes of its place and rates of the motion. */
KMP_LOCAL double kmp_friction_still(const kmp_friction_run *x);

/** Friction of a contact that is open. */
KMP_LOCAL void kmp_friction_set_off(kmp_friction_run *x, kmp_friction_element *e);

/** The rate of slip in two directions that counts as none: within it the direction is not known. */
KMP_LOCAL double kmp_friction_halt(const kmp_friction_run *x, const kmp_friction_element *e, double rate);

/** The places of both components of slip in two directions among the elements of a list; -1 for others. */
KMP_LOCAL void kmp_friction_pair_components(const kmp_friction_run *x, int count, const int *which, int *partner);

/** The size of the force of element i of the elements at rest, both its components. */
KMP_LOCAL double kmp_friction_size(const kmp_friction_run *x, int i);

/** The least x->f within the bounds `lower` and `upper` (box_minimum.h); its accelerations in x->y. */
KMP_LOCAL kmp_box_outcome kmp_friction_minimum(kmp_friction_run *x, const double *lower, const double *upper);

/** Slip in a direction; a contact opens. `rate`: of the motion, 1/s. */
KMP_LOCAL void kmp_friction_set_moving(kmp_friction_run *x, kmp_friction_element *e, double sense, double rate);

/** Slip (`none`: a rate against its sense that counts as none); rest with a given force (`none`: a larger rate is an
 * event); rest at a place by its row. */
KMP_LOCAL void kmp_friction_set_slip(kmp_friction_run *x, kmp_friction_element *e, double sense, double none);
KMP_LOCAL void kmp_friction_set_given(kmp_friction_run *x, kmp_friction_element *e, double force, double none);
KMP_LOCAL void kmp_friction_set_held(kmp_friction_run *x, kmp_friction_element *e, double place);

/** Regularised by its `regularise`, until its rate is large. */
KMP_LOCAL void kmp_friction_set_smooth(kmp_friction_run *x, kmp_friction_element *e);

/** True for an element that is regularised and has not left. */
KMP_LOCAL bool kmp_friction_stays_smooth(const kmp_friction_run *x, const kmp_friction_element *e);

/** Chooses rows and coordinates with the present inputs, without a wish. */
KMP_LOCAL int kmp_friction_choose(kmp_friction_run *x, double t, const double *q);

/** Accelerations and multipliers with the present inputs, and all values. */
KMP_LOCAL int kmp_friction_measure(kmp_friction_run *x, double t, const double *q, const double *qd);

/** True if the row of an element, which is then held, is independent of the rows that are kept now. */
KMP_LOCAL int kmp_friction_is_independent(kmp_friction_run *x, kmp_friction_element *e, double t, const double *q,
                                          bool *adds);

/** The same; rows and coordinates are then chosen with it. */
KMP_LOCAL int kmp_friction_adds_row(kmp_friction_run *x, kmp_friction_element *e, double t, const double *q,
                                    bool *adds);

/** Begins the past of all elements, which are listed. */
KMP_LOCAL void kmp_friction_begin(kmp_friction_run *x);

/** Notes the elements whose events are passed at the conditions in x->change, and the present friction. */
KMP_LOCAL void kmp_friction_note_values(kmp_friction_run *x);

/** Notes a fact of an element (-1: none) in the log of the site. */
KMP_LOCAL void kmp_friction_report(const kmp_friction_run *x, kmp_friction_fact fact, int element, double t,
                                   double number);

/** Lets go of all rows. */
KMP_LOCAL void kmp_friction_let_go(kmp_friction_run *x);
