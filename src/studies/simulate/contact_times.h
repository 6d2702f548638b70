/* SPDX-License-Identifier: BSD-3-Clause */
/* The compliant contacts of a run: how often and how long their bodies touched, and how deep each contact was. */
#pragma once

#include "studies/simulate/trajectory.h"

enum { KMP_DEPTHS = 5 }; /* least, quartiles, largest */

typedef struct kmp_contact_times {
    int force;
    int begun;                /* contacts that began during the run */
    int ended;                /* contacts with a depth: those that ended */
    double depth[KMP_DEPTHS]; /* least one, quartiles and largest one of their largest depths; NaN without contacts */
    double touching;          /* part of the time */
    const char *turning;      /* the driven coordinate that turned farthest, NULL: none turned once */
    double turns;
} kmp_contact_times;

/** The contacts of one force element. KEMPE_E_MEMORY. */
kempe_status kmp_contact_times_find(const kempe_trajectory *trajectory, int force, kmp_contact_times *times);

/** Of the k-th contact of the log: its largest depth in the unit of the element, NaN: it has not ended. */
double kmp_contact_time_depth(const kempe_trajectory *trajectory, int k);
