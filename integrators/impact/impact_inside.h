/* SPDX-License-Identifier: BSD-3-Clause */
/* Impacts of rigid contacts on plain arrays. All contacts that are closed or touch at an instant and are connected with
 * one that strikes, directly or through others, are decided together. Their normal impulses f and the rates v of their
 * distances after the impact are related by v+ = v- + D f with D = G P G', P the inverse inertia with the closures.
 * Newton's law asks for v+ + e v- >= 0, f >= 0, with one of them zero: the minimum of f'Df/2 + ((1 + e) v-)'f over f >=
 * 0 (Glocker 2001, chapter 8). Friction joins with impulses of at most mu times the normal one against the slip after
 * the impact; its bounds are iterated. Friction without a limit in one direction joins like a contact
 * without restitution.
 *
 * An impact whose next one would follow within KMP_IMPACT_SPACING of the run ends a sequence: it takes the rate away,
 * and the contact closes. The mechanism belongs to a site: a run of the library, or a generated simulator. */
#pragma once

#include "integrators/friction/friction_inside.h"
#include "integrators/impact/impact_site.h"

typedef struct kmp_impact_run kmp_impact_run;

struct kmp_impact_run {
    const kmp_impact_site *site;
    kmp_friction_run *friction;
    int n; /* coordinates */
    int count,
        *which;   /* the elements that take part, by number: the contacts that strike, and all connected with them */
    int *partner; /* the other component of friction in two directions; -1: none */
    double *row, *way; /* elements x n: their rows of J; changes of the rates by unit impulses */
    double *d, *v, *a, *e, *lower, *upper, *f, *y, *tried, *room;
    double *most_friction; /* bound of the impulse of friction, in this pass */
    int *side;
    int *first, *last; /* of each row: where its entries begin and end */
    bool *held;        /* it takes its rate away, in both directions */
    double *deep;      /* overlap of an element at this impact, which the located time leaves */
    double *before;    /* n: rates before the impact */
    double since;      /* the shortest time since the impact before of the same contact; INFINITY: none strikes twice */
    long total;        /* impacts so far */
};
