/* SPDX-License-Identifier: BSD-3-Clause */
/* Contacts at rest, or that strike at once, whose forces rigid bodies leave open. A block on three feet in a plane has
 * such contacts, and a block on four feet in space. Other forces with the same accelerations of all contacts exist.
 * Friction that slips follows its contact, and friction at rest is bounded by it, so that the motion may depend on
 * which forces are taken. Friction that holds a joint may share the load of a contact, too. Generated simulators have
 * this file as well. */
#pragma once

#include "integrators/friction/friction_inside.h"

/** After a decision: marks the contacts at rest that share loads, `shares`, and reports them. */
KMP_LOCAL void kmp_friction_find_shared(kmp_friction_run *x, double t);

/** True for a contact, or friction of a joint, at rest whose row the rows of others imply: they may share its load. */
KMP_LOCAL bool kmp_sharing_is_carried(const kmp_friction_element *e);

/** The same of the elements that are listed, with their forces in x->f. */
KMP_LOCAL int kmp_friction_find_present(kmp_friction_run *x, double t, const double *q, const double *qd);

/** True for friction that may follow how contacts share: of a contact, or of a joint that slips with a level by a load.
 */
KMP_LOCAL bool kmp_sharing_is_felt_by(const kmp_friction_element *e);

/* The forces, or impulses, of n elements of which `count` are unknown. */
typedef struct kmp_sharing {
    int n, count;
    double *d;
    int *place;    /* n: among the unknown ones; STAYS: it is known; FOLLOWS: it follows `base` */
    int *base;     /* n: the force that it follows, or that bounds it; -1: none */
    double *ratio; /* n: in this ratio */
    bool *contact; /* n: its force is not negative */
    double *scale; /* count: of the unknown ones, 1 / sqrt(d_ii) */
    int *of;       /* count: their numbers among the n */
    bool *presses; /* count: without a force, which may only grow; then: it can have none */
    double *null;  /* count x count: null vectors, scaled */
    int nulls;
    double *room;
} kmp_sharing;

/** Number of doubles of `room`. */
static inline int kmp_sharing_room(int n)
{
    return kmp_disc_room(n) + n * n + 22 * n;
}

/** Forces that are known; d: n x n, accelerations by unit forces. Room: kmp_sharing_room(n). */
KMP_LOCAL kmp_sharing kmp_sharing_begin(int n, double *d, double *room);

/** Force i of a contact is unknown. `presses`: it is zero, and cannot be negative. */
KMP_LOCAL void kmp_sharing_contact(kmp_sharing *s, int i, bool presses);

/** Friction i at rest is unknown, and at most `ratio` times the force `base`; -1: it has its own bounds. */
KMP_LOCAL void kmp_sharing_friction(kmp_sharing *s, int i, int base, double ratio);

/** Force i follows the force `base` in a ratio. */
KMP_LOCAL void kmp_sharing_follow(kmp_sharing *s, int i, int base, double ratio);

/** The ratio of the friction of an element to the force of its contact: `slip` is the direction of slip, or its
 * component. Quotients of both forces would have the rounding of small ones. */
KMP_LOCAL double kmp_sharing_ratio(const kmp_friction_run *x, const kmp_friction_element *e, double slip);

/** The place of an element in a list; -1: it is not there. */
KMP_LOCAL int kmp_sharing_number(int element, int count, const int *which);

/** Marks the contacts among the elements `which` that share, and friction of joints that shares with them; false: none
 * does. *felt: the motion depends on how. Reports the first ones, and the first ones that are felt, with
 * kmp_sharing_report. */
KMP_LOCAL bool kmp_sharing_mark(kmp_sharing *s, kmp_friction_run *x, const int *which, bool *felt);
KMP_LOCAL void kmp_sharing_report(kmp_friction_run *x, kmp_friction_fact fact, double t, bool felt);

/* Of n elements: accelerations a + D f of their places, forces, the other components of slip (-1: none), and own bounds
 * of friction that no contact bounds. */
typedef struct kmp_sharing_state {
    double *a; /* is put back */
    const double *f;
    const int *partner;
    const double *lower, *upper;
} kmp_sharing_state;

/** After kmp_sharing_mark: true if friction at rest might as well slip, with other forces of contacts that share. */
KMP_LOCAL bool kmp_sharing_may_move(kmp_sharing *s, const kmp_sharing_state *at);
