/* SPDX-License-Identifier: BSD-3-Clause */
/* The bodies between which an element acts: where it changes its length or its gap, one of them moves relative to
 * another. Coordinates count as the two bodies of their joint. */
#pragma once

#include "model/data/force.h"
#include "model/language/expression.h"

enum { KMP_MOST_CONNECTED = 16 };

typedef struct kmp_connected_bodies {
    const kempe_model *model;
    int count, body[KMP_MOST_CONNECTED];
    bool any; /* it may depend on all bodies */
} kmp_connected_bodies;

/** Adds the bodies of an expression (NULL: none): of the points, ropes and gears of its measures. */
void kmp_connected_by_expr(kmp_connected_bodies *to, const kmp_expr *expr);

/** Adds the bodies of a contact, rigid or with a law. */
void kmp_connected_by_contact(kmp_connected_bodies *to, const kmp_force *contact);

/** Adds the two bodies of a coordinate's joint; -1: none. */
void kmp_connected_by_motion(kmp_connected_bodies *to, int motion);

void kmp_connected_by_point(kmp_connected_bodies *to, int point);
