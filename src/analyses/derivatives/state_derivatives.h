/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives at a state of a workspace: what it was prepared for, and the response of accelerations, multipliers and
 * outputs to a small change of the state, which matrices and products with vectors share. */
#pragma once

#include "analyses/derivatives/derivative_lanes.h"
#include "analyses/derivatives/direction_lanes.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "constraints/evaluation/tangent.h"
#include "constraints/workspace/state_workspace.h"
#include "model/data/variant.h"
#include <kempe/derivatives.h>

/* Derivatives of the equations, and work space. */
typedef struct kmp_state_derivatives {
    kmp_arena arena;
    kmp_tangents tangents;
    double *unit, *force, *curve; /* n, n, m: a direction, and the changes of M qdd + C - J' lambda and J qdd + jdqd */
    double *x, *a;                /* n, m: changes of qdd and lambda */
    double *dq, *dqd;             /* n: changes of all coordinates along closed motions */
    double *room;                 /* KMP_FOLLOW_ROOM */
    kmp_direction_lanes lanes;    /* of columns of matrices */
    double *part, *sum;           /* 3 m + n: the change of the equations by a name; by all */
    int names;                    /* inputs and parameters by which derivatives are taken, too, */
    const char **name;            /* in output_arena */
    kmp_variant *variant;         /* in which the parameters among them vary, with the outputs, */
    kempe_system *varied;         /* and its system; NULL: all names are inputs, and there are no outputs */
    kmp_slopes *slopes;           /* NULL: no names, and no outputs */
    kmp_arena output_arena;       /* of the names, and of these: */
    int outputs, *shown;          /* the number of each output among the values of `slopes` */
    const char **output_name;
    double *values; /* all values of `slopes` */
    kmp_second_derivatives second;
    bool bends;                  /* `second` is there */
    double *x_before, *a_before; /* n, m: the response to the first direction */
    kmp_curvature curvature;     /* without `curved`: it is not there */
    bool curved;
    kmp_derivative_lanes many; /* of states */
    double *path; /* work space for Hessians: changes of the state along directions, of the user's force, */
    int paths;    /* and the number of directions for which there is room */
} kmp_state_derivatives;

/** The state at which derivatives are taken: its accelerations and factors, and the derivatives of the equations. */
typedef struct kmp_derivative_point {
    bool reduced;           /* the reduction has the factors */
    const double *tangents; /* kmp_tangents_derivatives */
    const double *shown;    /* values of the outputs of `slopes`; NULL: there are none */
} kmp_derivative_point;

/** Solves the equations at a state and takes their derivatives. `closed`: along closed motions, which the independent
 * coordinates describe. KEMPE_E_ARGUMENT, KEMPE_E_FAILED with a message. */
kempe_status kmp_derivative_point_take(kempe_workspace *ws, double t, const double *q, const double *qd,
                                       const double *Q, bool closed, kmp_derivative_point *point);

/** A small change: of q, qd, Q (n each) and of the names (k); NULL: zero. `name`: one more name changes by one; -1:
 * none.
 */
typedef struct kmp_state_change {
    const double *q, *qd, *Q, *names;
    int name;
} kmp_state_change;

/** Changes of accelerations and multipliers, in d->x and d->a. */
void kmp_derivatives_respond(kempe_workspace *ws, const kmp_derivative_point *point, const kmp_state_change *change);

/** The same for changes d->force and d->curve of the equations; forces that depend on multipliers change with them. */
void kmp_derivatives_answer(kempe_workspace *ws, const kmp_derivative_point *point);

/** The same with the force of each such element constant. */
void kmp_derivatives_solve(kempe_workspace *ws, const kmp_derivative_point *point);

/** KEMPE_E_ARGUMENT with a message unless the workspace is prepared. */
kempe_status kmp_derivatives_prepared(kempe_workspace *ws);

/** The change of the outputs with these; y (outputs; NULL: not required). */
void kmp_derivatives_of_outputs(kempe_workspace *ws, const kmp_state_change *change, double *y);

/** Changes of all coordinates along closed motions, in d->dq and d->dqd, for changes of u and ud (p each; NULL: zero)
 * and of the names. `udd` (p; NULL: not required) receives the change of the independent accelerations. */
void kmp_derivatives_follow(kempe_workspace *ws, const kmp_derivative_point *point, const double *u, const double *ud,
                            const kmp_state_change *names, double *udd);

/** The values of the outputs at the point. */
void kmp_derivatives_outputs(const kempe_workspace *ws, const kmp_derivative_point *point, double *y);

/** Refuses directions, and weights, with numbers that are not finite, in the message. KEMPE_E_ARGUMENT. */
kempe_status kmp_derivatives_check_direction(kempe_workspace *ws, const kempe_state_direction *direction);
kempe_status kmp_derivatives_check_weights(kempe_workspace *ws, const kempe_forward_values *weight);

/** Refuses changes of all coordinates together with changes of the independent ones, in the message. KEMPE_E_ARGUMENT.
 */
kempe_status kmp_derivatives_refuse_both(kempe_workspace *ws, bool all, bool closed);

/** Gradients by q and qd in d->dq and d->dqd, by Q in d->x and by the names in `names` (NULL: not required), of weights
 * of accelerations, multipliers and outputs. The weights of changes of M qdd + C - J' lambda and of J qdd + jdqd that
 * have this effect are in d->force and d->a. */
void kmp_derivatives_weigh(kempe_workspace *ws, const kmp_derivative_point *point, const kempe_forward_values *weight,
                           double *names);

/** Removes what Hessians were prepared with. */
void kmp_derivatives_release_hessians(kmp_state_derivatives *d);
