/* SPDX-License-Identifier: BSD-3-Clause */
/* Compliant contacts as expressions: their geometry, and the normal force of their law. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "model/data/compliant.h"

/** Conditions of a contact, numbers of kmp_tree_condition: its bodies touch; its law would pull; its journal is out of
 * the bearing; its law has no force at so great a depth; its film has its least thickness. */
enum { KMP_PRESSING, KMP_PRESSING_PULLS, KMP_PRESSING_OUT, KMP_PRESSING_DEEP, KMP_PRESSING_THIN };

typedef struct kmp_bearing_load {
    kmp_ref open;                  /* negative where the bodies touch: the gap, or a smooth function of it */
    kmp_ref depth, rate;           /* of approach; only meaningful near contact */
    kmp_ref slip[3];               /* velocity along the surface, linear in the rates */
    int slips;                     /* 1: with a sign; 3: a vector; 0: the contact has no friction */
    kmp_ref x, y, z, eccentricity; /* of a journal's centre in its bearing; z of a ball */
} kmp_bearing_load;

void kmp_bearing_load_find(const kmp_tree *tree, const kmp_force *force, kmp_bearing_load *pressing);

/** 1 where the bodies touch, during a step an input. */
kmp_ref kmp_bearing_load_holds(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing);

/** The normal force, zero without contact and where the law would pull. */
kmp_ref kmp_bearing_load_normal(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing);

/** An expression of the law, over the quantities of the contact. */
kmp_ref kmp_bearing_load_law(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing,
                             const kmp_expr *law);

/** The coefficient of friction at a slip. */
kmp_ref kmp_bearing_load_coefficient(const kmp_tree *tree, const kmp_force *force, kmp_ref slip);

/** Depth, approach or normal force, as measures of expressions. */
kmp_ref kmp_bearing_load_measure(const kmp_tree *tree, kmp_measure_kind kind, const char *contact);
