/* SPDX-License-Identifier: BSD-3-Clause */
/* A wheel and its rail in one graph: the points of the wheel that can touch, the gap over them, and the borders of
 * zones. */
#pragma once

#include "rail/wheel/patch.h"

/** Arguments of a block: the wheel's radius, its outward position, the axle's three components; of averages
 * (patch.c) also 1/e and the height of the centre. */
enum { KMP_PAIR_ARGUMENTS = 7 };

typedef struct kmp_wheel_pair {
    kmp_graph *g;
    int wheel, rail; /* tables: both heights */
    kmp_ref radius, out, axle[3];
} kmp_wheel_pair;

/** A point of the trace line, from the wheel's centre. */
typedef struct kmp_trace {
    kmp_ref radius, slope; /* r and r' */
    kmp_ref x, y, z;
} kmp_trace;

kmp_wheel_pair kmp_pair_of(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose);

/** The pair in a graph of its own, for a block: each expression that is not a number becomes an argument, and is
 * appended to the list. */
kmp_wheel_pair kmp_pair_inside(const kmp_wheel_pair *pair, kmp_graph *local, kmp_ref *list, int *count);
/** Makes any expression an argument. The list has room for KMP_PAIR_ARGUMENTS; more of them fail both graphs. */
kmp_ref kmp_pair_argument(kmp_graph *g, kmp_graph *local, kmp_ref x, kmp_ref *list, int *count);

kmp_trace kmp_trace_at(const kmp_wheel_pair *pair, kmp_ref s);
/** D less the height of the wheel's centre. */
kmp_ref kmp_pair_drop(const kmp_wheel_pair *pair, const kmp_trace *trace);

/** dx/ds, s an input. */
kmp_ref kmp_slope_of(kmp_graph *g, kmp_ref x, kmp_ref s);
/** The cosine of the angle with this tangent. */
kmp_ref kmp_cosine_of(kmp_graph *g, kmp_ref slope);

/** m beyond a border: where a slope of 10 is balanced. */
double kmp_zone_give(const kmp_wheel *wheel);
/** Half of the distance on which one zone's weight falls and the next one's rises. A rigid wheel touches in one zone:
 * there the border is sharp, or both zones were equally near around it. */
double kmp_zone_border(const kmp_wheel *wheel);
/** The term added to D beyond the borders of a zone. */
kmp_ref kmp_zone_penalty(kmp_graph *g, const kmp_wheel *wheel, int zone, kmp_ref s);
/** 1 within, 0 beyond, 6 x^5 - 15 x^4 + 10 x^3 between. */
kmp_ref kmp_zone_weight(kmp_graph *g, const kmp_wheel *wheel, int zone, kmp_ref s);
