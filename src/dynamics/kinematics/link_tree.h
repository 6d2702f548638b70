/* SPDX-License-Identifier: BSD-3-Clause */
/* The tree of links: one link a motion, as the paper's bodies (Fisette and Samin 1996, Fig. 2: body i carried by body
 * h through a joint of one degree of freedom). Intermediate links of a joint with several motions are massless.
 *
 * The stations of a flexible body are guided links: massless, with motions that are functions of the body's
 * coordinates. Bodies and points that are attached there are on such a link, so that each recursion meets flexible
 * bodies only in two places: at guided links and in the body's own inertia.
 *
 * Link axes are chosen so that every motion is about or along a coordinate axis: an oblique axis costs one constant
 * rotation. Link 0 is the ground. */
#pragma once

#include "base/arena.h"
#include "dynamics/kinematics/deformation.h"
#include "dynamics/kinematics/model_conditions.h"
#include "dynamics/kinematics/vector.h"
#include "model/data/closure.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef struct kmp_link {
    int parent;                         /* link; -1 for the ground */
    int body;                           /* the body that it carries, except welded ones; -1 for an intermediate link */
    int motion;                         /* of the model; -1: it is guided */
    const kmp_guide *guide;             /* of a guided link; NULL: it has a motion, or it is fixed to its parent */
    const kmp_deformation *deformation; /* of its body; NULL: it is rigid */
    bool rotation;
    int axis;          /* 0, 1, 2 of the link's axes */
    kmp_ref q, qd;     /* of the motion, with a sign when the axis is a negative coordinate axis */
    bool reversed;     /* the sign */
    bool turned;       /* g is not the identity */
    double g[3][3];    /* v_parent = g v_link at q = 0 */
    bool stays;        /* the link's axes do not turn with the joint: vectors fixed to its body do, by `lag` */
    bool follows;      /* its parent's axes do not turn either, about the same axis: both have the same axes */
    kmp_ref lag;       /* the angle about `axis` from the link's axes to its body's; zero unless it stays */
    double a[3][3];    /* v_model = a v_link: axes of the body's model frame */
    int before, after; /* charts: rotations in model axes before its motion and after it, -1 for none */
    const kmp_vec *virtual_spin; /* of a virtual displacement of its joint, the parent's link axes; NULL: none */
    kmp_ref chart[3][3];         /* g with the chart before it and the one after its parent, when there are any */
    kmp_vec p;        /* from the parent's origin to this joint's, parent's link axes (p_z without the motion) */
    kmp_ref armature; /* a mass only of its coordinate */
    kmp_ref mass;
    kmp_vec com;        /* l^i, link axes */
    kmp_tensor inertia; /* I^i about the com, link axes */
    kmp_composite own;  /* the mass that its wrench counts as its own, about its origin (kmp_tree_sum_up), link axes */
    bool about;         /* its wrench is computed from `own` */
    kmp_composite base; /* the mass that its composite body counts as its own */
    bool lumped;        /* the mass of all bodies it carries, and its own, is in its parent's `base` already */
    kmp_vec push;       /* body inputs: a force at the com and a torque, link axes; zero where there are none */
    kmp_vec twist;
} kmp_link;

/** The position of a body on its link; it differs from the link's origin and axes when the body is welded to another
 * one. */
typedef struct kmp_body_on_link {
    int link;
    bool turned;    /* r is not the identity */
    double r[3][3]; /* v_own = r v_body: model axes of the link's own body, from this body's */
    kmp_vec p;      /* from the link's origin to the body's, link axes */
} kmp_body_on_link;

/** The values of elements' conditions in one graph, by number. */
typedef struct kmp_noted_value {
    kmp_ref value;
    bool known;
} kmp_noted_value;

typedef struct kmp_noted {
    int count;
    kmp_noted_value *note;
} kmp_noted;

typedef struct kmp_table_uses {
    int count, most;
    kmp_table_use *use;
} kmp_table_uses;

/** Numbers that stay symbols, inputs KMP_IN_PARAMETER: none, the model's parameters, or with them (numbered after them)
 * every number of the model. The last is the convention by which generators are compared. Zeros of the data are zeros
 * of the equations in any case. */
typedef enum kmp_keep { KMP_KEEP_NOTHING, KMP_KEEP_PARAMETERS, KMP_KEEP_NUMBERS } kmp_keep;

/** Rows that a closure may have, at most. */
enum { KMP_CLOSURE_ROWS = 6 };

/** A factor of an angle that is a sum of coordinates. */
typedef struct kmp_turn {
    int motion;
    double factor;
} kmp_turn;

/** Leaves and directions of derivatives along time, of motions by their rates, and of rates by accelerations too; made
 * at their first use. */
typedef struct kmp_time_seeds {
    int count[2];
    kmp_ref *leaf[2]; /* then the directions */
} kmp_time_seeds;

/* The state of the values of a group or a name. */
typedef enum kmp_name_state {
    KMP_NAME_UNKNOWN,
    KMP_NAME_SOLVED,
    KMP_NAME_BENT, /* a row of a closure has it, where kinks are bends */
} kmp_name_state;

/* Values of the model's groups of algebraic variables and of its named expressions, once used. */
typedef struct kmp_solved_names {
    kmp_ref *value;         /* KMP_UNKNOWNS_MOST for each group of the model; NULL: not kept */
    kmp_ref *branch;        /* the same with conditions for kinks, in laws of forces; KMP_ZERO: not known */
    kmp_name_state *solved; /* of each group */
    int solving;            /* whose equations are being written, from 1; 0: none */
} kmp_solved_names;

/* The treatment of conditions in expressions. */
typedef struct kmp_tree_conditions {
    kmp_events *events; /* NULL: conditions are evaluated in place */
    kmp_noted *noted;   /* of the graph; present with `events` */
    bool kinks;         /* abs, min and max are conditions: in laws of forces */
    bool watches;       /* places where functions begin to count are conditions: in laws and in rows of closures */
    bool bends;         /* they are conditions as comparisons are: in rows of closures, whose J jumps with them */
    bool settled;       /* no further condition becomes an event: a new one is evaluated in place */
} kmp_tree_conditions;

/* Loads by multipliers, for expressions that read them. */
typedef struct kmp_tree_reactions {
    /* The force or the moment of a closure by its multipliers; NULL: there are none. */
    kmp_vec (*of_closure)(const struct kmp_tree *tree, int closure, bool moment);
    struct kmp_joint_loads *joints; /* (dynamics/joint_loads.h); NULL: they are not known */
    kmp_vec (*of_joint)(const struct kmp_tree *tree, int body, bool moment); /* the load of a body's joint, by them */
    const int *row; /* KMP_CLOSURE_ROWS per closure: the number of each declared row among the kept rows, -1 for
                       others; not owned; NULL: none is known */
} kmp_tree_reactions;

typedef struct kmp_tree {
    kmp_graph *graph;
    const kempe_model *model;
    kmp_arena arena; /* of all arrays that it owns */
    kmp_keep keep;
    double *symbols;                 /* KMP_KEEP_NUMBERS: values of all symbols, parameters first */
    bool charted;                    /* joints of kmp_spherical_find have inputs KMP_IN_CHART */
    int count;                       /* links, ground included */
    int *of_motion;                  /* of each motion of the model: its link; 0: a coordinate of a flexible body */
    int **stations;                  /* of each flexible body, of each of its stations: its link */
    int *chart_before, *chart_after; /* of each motion: charts, as of its link */
    kmp_ref *heading; /* the angle of each link from the ground where all axes on the way are parallel, KMP_ZERO
                         elsewhere; NULL: not known, as of a short tree, and with variants */
    kmp_link *links;
    kmp_body_on_link *mounts; /* of each body */
    double *factor;           /* of each motion, for kmp_tree_angle_sum; zero between its calls */
    kmp_turn *turn;
    kmp_time_seeds *seeds;
    kmp_vec gravity;
    const kmp_ref *place;   /* 3: the values of x, y, z in expressions; NULL: they have none */
    bool friction_in_place; /* the force of friction that sticks is derived: no run puts it among the multipliers */
    bool given_delays;      /* states of continuous delays have no rate */
    kmp_table_uses *uses;   /* of outputs; NULL: they are not noted */
    kmp_solved_names names;
    kmp_tree_conditions conditions;
    kmp_tree_reactions reactions;
} kmp_tree;

/** After the graph has returned to an earlier state: forgets all values of names and conditions that are no longer in
 * it. */
void kmp_tree_forget(kmp_tree *tree);

/** Builds the links, except the members that kmp_tree_sum_up sets. False: no memory. */
bool kmp_tree_init(kmp_tree *tree, kmp_graph *g, const kempe_model *model, kmp_keep keep, bool charted);

/** The same links again, of a tree without inputs on its bodies. False: no memory. */
bool kmp_tree_init_again(kmp_tree *tree, const kmp_tree *from);

/** Sets each link's `own` and `base` from its mass, centre of mass and inertia. */
void kmp_tree_sum_up(kmp_tree *tree);

/** The first link that link i carries; 0: it carries none. */
int kmp_tree_first_child(const kmp_tree *tree, int i);

/** Gives every body that has motions three force inputs and three torque inputs. Forces act at the centre of
 * mass of all bodies welded to it. The inputs are KMP_IN_FORCE and KMP_IN_TORQUE, number 3 (body - 1) + k. Bodies named
 * in `without`, separated by commas, have none (NULL: all have). */
void kmp_tree_add_inputs(kmp_tree *tree, const char *without);

void kmp_tree_free(kmp_tree *tree);

/** One of the model's algebraic variables, or the value of a name (KMP_EXPR_UNKNOWN). */
kmp_ref kmp_tree_unknown(const kmp_tree *tree, const kmp_expr *expr);

/** The inputs KMP_IN_TIME whose derivatives by t equations need, and these derivatives: of t, and of the inputs of the
 * model. No equation needs a third derivative of an input. The number of them. */
int kmp_tree_time_leaf_count(const kmp_tree *tree);

/** v of a body's axes in the axes of its link, and the reverse. They differ where the joint's axis is oblique, the body
 * is attached by a point with axes, or it is welded. */
kmp_vec kmp_body_vector(const kmp_tree *tree, int body, kmp_vec v);
kmp_vec kmp_body_vector_back(const kmp_tree *tree, int body, kmp_vec v);

/** A rigid body on its link: mass, centre of mass from the link's origin, inertia about it, link axes. */
typedef struct kmp_inertia {
    kmp_ref mass;
    kmp_vec com;
    kmp_tensor about_com;
} kmp_inertia;
kmp_inertia kmp_body_inertia(const kmp_tree *tree, int body);

/** The position of a spherical joint's chart: true for before its three rotations, false for after them, by the
 * estimated cost. After them it rotates the data of the body once and each vector passed to carried bodies. Before them
 * it rotates each vector that passes the joint, where the base itself turns or a point's position is needed. */
bool kmp_tree_chart_before(const kempe_model *model, int first);
