/* SPDX-License-Identifier: BSD-3-Clause */
/* Contacts at rest, or that strike at once, whose forces rigid bodies leave open. A block on three feet in a plane has
 * such contacts, and a block on four feet in space. Other forces with the same accelerations of all contacts exist.
 * Friction that slips follows its contact, so that the motion may depend on which forces are taken. Generated
 * simulators have this file too. */
#pragma once

#include "integrators/friction/friction_inside.h"

/** After a decision: marks the contacts at rest that share loads, `shares`, and reports them. */
KMP_LOCAL void kmp_friction_find_shared(kmp_friction_run *x, double t);

/* The forces, or impulses, of n elements of which `count` are unknown. */
typedef struct kmp_sharing {
    int n, count;
    const double *d;
    int *place;    /* n: among the unknown ones; STAYS: it is known; FOLLOWS: it follows `base` */
    int *base;     /* n: the force that it follows */
    double *ratio; /* n: in this ratio */
    double *scale; /* count: of the unknown ones, 1 / sqrt(d_ii) */
    int *of;       /* count: their numbers among the n */
    bool *presses; /* count: without a force, which may only grow; then: it can have none */
    double *null;  /* count x count: null vectors, scaled */
    double *room;
} kmp_sharing;

/** Forces that are known; d: n x n, accelerations by unit forces. Room: kmp_disc_room(n). */
KMP_LOCAL kmp_sharing kmp_sharing_begin(int n, const double *d, double *room);

/** Force i is unknown. `presses`: it is zero, and cannot be negative. */
KMP_LOCAL void kmp_sharing_add(kmp_sharing *s, int i, bool presses);

/** Force i follows the force `base` in a ratio. */
KMP_LOCAL void kmp_sharing_follow(kmp_sharing *s, int i, int base, double ratio);

/** The ratio of the friction of an element to the force of its contact: `slip` is the direction of slip, or its
 * component. Quotients of both forces would have the rounding of small ones. */
KMP_LOCAL double kmp_sharing_ratio(const kmp_friction_run *x, const kmp_friction_element *e, double slip);

/** The place of an element in a list; -1: it is not there. */
KMP_LOCAL int kmp_sharing_number(int element, int count, const int *which);

/** Marks the contacts among the elements `which` that share; false: none does. *felt: the motion depends on how.
 * Reports the first ones, and the first ones that are felt, with kmp_sharing_report. */
KMP_LOCAL bool kmp_sharing_mark(kmp_sharing *s, kmp_friction_run *x, const int *which, bool *felt);
KMP_LOCAL void kmp_sharing_report(kmp_friction_run *x, kmp_friction_fact fact, double t, bool felt);
