/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies, each with the motions of its joint, and points on them. */
#pragma once

#include "model/data/joint_table.h"
#include "model/data/place.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** A point fixed to a body, in the body's axes, from the body's origin. */
typedef struct kmp_point {
    const char *name; /* without the body's name */
    int body;
    kmp_number at[3];     /* of a flexible body: without deformation */
    bool turned;          /* its axes differ from the axes of the body */
    double axes[3][3];    /* v_body = axes v_point, when turned */
    int station;          /* of a flexible body: 1 + the station that it moves with; 0: none, it moves with the frame */
    kmp_number offset[3]; /* from there, in the axes of the station */
} kmp_point;

/** One elementary motion: a rotation about (or translation along) a unit axis, which is fixed in the axes reached by
 * the motions before it. Motion k of the model has coordinate q[k]. */
typedef struct kmp_motion {
    const char *name; /* of the coordinate: `joint`, `joint.1` ... when the joint has several, or a separate one */
    int number;       /* of the joint's coordinates, from 1: joint.k denotes it */
    int body;
    bool rotation;
    bool elastic; /* a coordinate of a flexible body's deformation, without axis; these follow the coordinates of
                     joints. Its unit is the unit of an angle or of a length */
    double axis[3];
} kmp_motion;

typedef struct kmp_body {
    const char *name;
    const char *joint; /* its joint's name */
    kmp_place place;
    int parent;         /* body */
    int at;             /* point of the parent where the joint's chain begins, -1: its origin */
    int to;             /* its own point where the chain ends, -1: its origin */
    bool turned;        /* with all coordinates zero the axes at `to` differ from the axes at `at` */
    double frame[3][3]; /* then v_at = frame v_to, when turned; when reversed v_to = frame v_at */
    bool reversed;      /* its joint's coordinates describe the parent relative to the body: the chain has the inverse
                           motions, and a frame is at its end */
    bool loads_parent;  /* the second body of its joint, which the joint's reaction loads, is its parent */
    int first_motion, motion_count; /* its chain; no motion: it is welded to its parent */
    int load_count;   /* of its first motions: translations that are locked, for the reaction of its joint */
    int load_closure; /* the first one of their locks */
    const kmp_joint_row *coupling; /* its row if that couples the two motions by a number; NULL: it does not */
    kmp_number number;             /* of the coupling */
    kmp_number armature;           /* of a joint with one motion: a mass only of this coordinate */
    kmp_number mass;
    kmp_number com[3];
    kmp_number inertia[6]; /* xx yy zz xy xz yz about the com, body axes; xy is the tensor's entry, -sum m x y */
    bool by_shape;         /* these three follow from its shapes */
    bool partial;          /* some moments are given, and others left out: */
    bool left_out[3];
    int flexible; /* 1 + which of the model's flexible bodies it is; 0: it is rigid */
} kmp_body;

/** True for a rigid body without moments of inertia. */
static inline bool kmp_body_is_bare(const kmp_body *body)
{
    bool bare = body->flexible == 0;
    for (int k = 0; k < 6; k++)
        bare = bare && body->inertia[k].value == 0;
    return bare;
}

/** Not a constant zero. */
static inline bool kmp_body_has_armature(const kmp_body *body)
{
    return body->armature.value != 0 || body->armature.expr;
}

/** Motion k of the model, whose coordinate is q[k]; a body, 0 being the ground; a point. */
const kmp_motion *kmp_model_motion(const kempe_model *model, int k);
const kmp_body *kmp_model_body(const kempe_model *model, int body);
const kmp_point *kmp_model_point(const kempe_model *model, int point);

/** The number of motions, with the motions of states (n), and of bodies, with the ground. */
int kmp_model_motion_count(const kempe_model *model);
int kmp_model_body_count(const kempe_model *model);

/** The nearest common ancestor of two bodies. Bodies follow their parents. */
int kmp_model_common_body(const kempe_model *model, int a, int b);
