/* SPDX-License-Identifier: BSD-3-Clause */
/* The position of a wheel relative to its rail, and the place where both touch, as expressions. The wheel is a surface
 * of revolution, the rail its cross-section drawn along the track at the wheel's place. */
#pragma once

#include "dynamics/kinematics/link_tree.h"
#include "model/data/wheels.h"

/** A cross-section of a track; vectors in the axes of the ground's link. */
typedef struct kmp_track_place {
    kmp_ref along;   /* arc length, m */
    kmp_vec origin;  /* the middle on top of the rails, from the ground's origin */
    kmp_vec axis[3]; /* forwards, left, up: canted */
    kmp_ref outwards[KMP_TRACK_SIDES], upwards[KMP_TRACK_SIDES]; /* displacements of the rails by irregularities, m */
} kmp_track_place;

/** The cross-section in whose plane a point is (from the ground's origin, axes of the ground's link). Of a curved track
 *  the arc length is an implicit unknown, on a straight one nothing is. The graph fails when there is no memory. */
void kmp_track_at(const kmp_tree *tree, const kmp_track *track, kmp_vec point, kmp_track_place *place);

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
/** Makes any expression an argument. The list has room for KMP_PAIR_ARGUMENTS; more of them fail both graphs. */
kmp_ref kmp_pair_argument(kmp_graph *g, kmp_graph *local, kmp_ref x, kmp_ref *list, int *count);

kmp_trace kmp_trace_at(const kmp_wheel_pair *pair, kmp_ref s);

/** dx/ds, s an input. */
kmp_ref kmp_slope_of(kmp_graph *g, kmp_ref x, kmp_ref s);
/** Half of the distance on which one zone's weight falls and the next one's rises. A rigid wheel touches in one zone:
 * there the border is sharp, or both zones were equally near around it. */
double kmp_zone_border(const kmp_wheel *wheel);

/** A wheel in the cross-section of its rail. */
typedef struct kmp_wheel_pose {
    kmp_track_place place;
    kmp_vec centre;  /* from the ground's origin, axes of the ground's link */
    kmp_vec axis[3]; /* forwards, outwards, up: unit vectors there (left-handed on the right side) */
    kmp_ref out, up; /* of the centre, from the track's middle at rail top, less irregularities */
    kmp_ref axle[3]; /* unit vector of the axle, outwards, in these axes */
} kmp_wheel_pose;

/* The graph fails when there is no memory, here and below. */
void kmp_wheel_find(const kmp_tree *tree, const kmp_wheel *wheel, kmp_wheel_pose *pose);

/** The place where a zone of a wheel is nearest to the rail: for an elastic wheel the average over its neighbourhood.
 */
typedef struct kmp_patch {
    kmp_ref s;             /* lateral coordinate on the wheel's profile */
    kmp_ref y;             /* the place on the track */
    kmp_ref gap;           /* along the common normal, m; negative: penetration */
    kmp_ref closing;       /* rate of the gap at a constant place on the wheel, m/s; for elastic wheels, otherwise 0 */
    kmp_ref slope;         /* tangent of the contact angle: dz/dy of the rail, positive where it falls inwards */
    kmp_vec point;         /* the wheel's, from the ground's origin, axes of the ground's link */
    kmp_vec normal, side;  /* out of the rail; in the contact plane across the track, to the left */
    kmp_ref along, across; /* relative curvatures, 1/m */
    kmp_ref weight;        /* 1, falling to 0 where the nearest point would be beyond the zone */
} kmp_patch;

void kmp_wheel_patch(const kmp_tree *tree, const kmp_wheel *wheel, int zone, const kmp_wheel_pose *pose,
                     kmp_patch *patch);

/** The contact of the nearest of all zones, chosen by conditions of the wheel; its weight is 1. */
void kmp_wheel_touch(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, kmp_patch *patch);

/** The curvature across at the place of an elastic wheel's patch, divided by the patch's curvature, which is an
 * average. It is 1 where the gap is a parabola, and the patch one ellipse. The patch of a rigid wheel is unknown: 0. */
kmp_ref kmp_patch_fit(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, const kmp_patch *patch);

/** The slip of a wheel in its contact, relative to its rolling speed. */
typedef struct kmp_slip {
    kmp_ref along, across, spin; /* spin in 1/m, over the rolling speed with its sign */
    kmp_ref sense;               /* 1 rolling forwards, -1 backwards, smooth between */
    kmp_ref speed;               /* rolling speed, regularised */
    kmp_vec velocity;            /* of the wheel's material point relative to the rail, m/s */
    kmp_vec turn;                /* angular velocity of the wheel */
} kmp_slip;

void kmp_wheel_slip(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, const kmp_patch *patch,
                    kmp_slip *slip);
