/* SPDX-License-Identifier: BSD-3-Clause */
/* The public workspace. Evaluation and accelerations are the same as in runs: by articulated bodies if that costs less,
 * or on the independent rows and coordinates of the start while these are good. */
#pragma once

#include "constraints/closing/least_change.h"
#include "constraints/closing/saddle.h"
#include "constraints/evaluation/stage_lanes.h"
#include "constraints/partition/reduction.h"
#include <kempe/workspace.h>

/* Equations at several states at once. */
typedef struct kmp_state_lanes {
    size_t seen;            /* states in calls for many, until the lanes are prepared */
    kmp_stage_lanes stages; /* the motion program; without lanes: not prepared */
    int count[3], size;     /* outputs of closures, M and bias; all of them */
    double *t, *q, *qd;     /* of all lanes, in their order of numbers */
    double *values;         /* outputs lane by lane */
} kmp_state_lanes;

/* An object that a wing adds to a workspace: derivatives and steps with them (src/analyses/derivatives), actuators
 * (src/analyses/inverse/state_torque.c). */
typedef struct kmp_workspace_part {
    void *self; /* NULL: there is none */
    void (*free)(void *self);
} kmp_workspace_part;

/* Modes of friction and of contacts at each state (integrators/run/friction_workspace.c). */
typedef struct kmp_workspace_friction {
    void *self; /* NULL: friction follows the sign of its rates, contacts are open, or there are none */
    kempe_status (*decide)(void *self, double t, const double *q, const double *qd);
    void (*release)(kmp_evaluator *eval); /* no row is held until the next decision */
    void (*free)(void *self);
    bool decided, kept; /* there is a decision; it holds at all further states */
    double *mode;       /* of all conditions, by the last decision */
} kmp_workspace_friction;

struct kempe_workspace {
    const kempe_system *system;
    kmp_arena arena;
    kmp_evaluator *eval;
    kmp_saddle saddle;
    kmp_least_change least;
    int n, m;
    bool chosen;        /* the start can be assembled */
    kmp_partition part; /* choice of rows and coordinates at the start */
    kmp_reduction red;
    bool by_bodies;                            /* accelerations are computed by articulated bodies */
    kmp_saddle bodies;                         /* closure forces for the articulated bodies */
    bool stale;                                /* the values below belong to an earlier state than q */
    double t, *q, *qd;                         /* n: of the last call; dense copies of its values follow */
    double *mass, *bias, *h, *jdqd, *jacobian; /* n x n, n, m, m, m x n */
    double *trial;                             /* n: q while closing */
    double *answer;                            /* n + m: accelerations and multipliers, or shares */
    double *row;                               /* n, or m: a row of J, or rates of the rows */
    double *change;                            /* of each condition */
    double *share;                             /* m: parts of the kept rows in a dropped one */
    bool *hold;                                /* n */
    int *closure_rows, closure_count;          /* m; rows that belong to no friction and no contact */
    bool *of_modes;                            /* m: rows that do */
    kmp_workspace_friction friction;
    kmp_state_lanes many;
    kmp_workspace_part derivatives, step, actuators, determinant;
    bool visits; /* states of one call: the message of an earlier one stays */
    char message[400];
};

/** Sets the message. KEMPE_E_FAILED. */
kempe_status kmp_workspace_fail(kempe_workspace *ws, const char *sentence, ...) __attribute__((format(printf, 2, 3)));

/** Sets the message of an argument that is refused. KEMPE_E_ARGUMENT. */
#define KMP_WORKSPACE_REFUSE(ws, ...) ((void)kmp_workspace_fail(ws, __VA_ARGS__), KEMPE_E_ARGUMENT)

/** Reports a NULL argument; false: it is NULL. */
bool kmp_workspace_given(kempe_workspace *ws, const char *name, const void *argument);

/** Refuses a time that is not finite, in the message. KEMPE_E_ARGUMENT. */
kempe_status kmp_workspace_check_time(kempe_workspace *ws, double t);

/** The name of an entry of an argument. */
typedef const char *kmp_entry_name(const kempe_workspace *ws, int entry);
kmp_entry_name kmp_workspace_coordinate_name, kmp_workspace_independent_name, kmp_workspace_row_name;

/** Refuses `count` numbers (NULL: not given) of which one is not finite, in the message: `what` they are, and the name
 * of the first such one. KEMPE_E_ARGUMENT. */
kempe_status kmp_workspace_check_finite(kempe_workspace *ws, const char *what, kmp_entry_name *name, int count,
                                        const double *x);

/** Refuses a model with contacts, in the message. KEMPE_E_ARGUMENT. */
kempe_status kmp_workspace_refuse_contacts(kempe_workspace *ws, const char *what);

/** The same unless the workspace decides on contacts at each state. */
kempe_status kmp_workspace_require_decisions(kempe_workspace *ws, const char *what);

/** True if the independent coordinates describe the motions that keep the loops closed, after an evaluation; the
 * reduction then has its factors and its tangent. Rows of friction and contacts do not count. */
bool kmp_workspace_follows_loops(kempe_workspace *ws);

/** Fails with the constraint equation, after an evaluation at (t, ws->q, ws->qd), where the loops are open or their
 * rates are not zero; `what` is what needs them. */
kempe_status kmp_workspace_require_closed(kempe_workspace *ws, const char *what, double t);

/** The same of the position only. */
kempe_status kmp_workspace_require_closed_position(kempe_workspace *ws, const char *what, double t);

/** Refuses a negative number of states, in the message. KEMPE_E_ARGUMENT. */
kempe_status kmp_workspace_check_count(kempe_workspace *ws, int count);

/** For a call that goes through `count` steps: true, with a message, if it is to end after `done` of them, because the
 * context was interrupted since; `before`: kmp_interrupt_taken at the begin of the call. */
bool kmp_workspace_interrupted(kempe_workspace *ws, bool before, int done, int count, const char *of);

/** Evaluates state k of `count`, or a group from k on: *done, 1 before the call, is the number of states that it has
 * dealt with, the last of which fails where an error is returned. */
typedef kempe_status kmp_state_visit(kempe_workspace *ws, const void *self, int k, int count, int *done);

/** Visits all states until one fails or the context is interrupted (KEMPE_STOPPED). *failed (may be NULL): the number
 * of the first state without results, -1: none. */
kempe_status kmp_workspace_visit(kempe_workspace *ws, int count, kmp_state_visit *visit, const void *self, int *failed);

/** Accelerations and multipliers into `answer`, with the factors of `red` (*reduced: true) or of `saddle` at the state.
 * Articulated bodies are not used. KEMPE_E_FAILED. */
kempe_status kmp_workspace_solve(kempe_workspace *ws, double t, const double *q, const double *qd, const double *Q,
                                 bool *reduced);

/** The same from the evaluator's M, C, h, J and jdqd. */
kempe_status kmp_workspace_accelerate(kempe_workspace *ws, const double *Q, bool *reduced);

/** The accelerations of the last answer, and its multipliers (NULL: not wanted). */
void kmp_workspace_put_answer(const kempe_workspace *ws, double *qdd, double *lambda);

/** Decides whether groups of KMP_STAGE_LANES states run in lanes, which are made once enough states have been seen; a
 * call is for `count` states. */
bool kmp_workspace_by_lanes(kempe_workspace *ws, int count);

/** Evaluates such a group, rows of q and qd, t at t[l] or, without a step, the first one. false: some value may not be
 * finite. */
bool kmp_workspace_run_lanes(kempe_workspace *ws, const double *t, int t_step, const double *q, const double *qd);

/** Makes the state of a lane of these rows the state of the workspace and of its evaluator; the workspace `keeps`
 * copies of its values. */
void kmp_workspace_take_lane(kempe_workspace *ws, const double *q, const double *qd, int lane, bool keeps);

/** The inputs of a workspace. */
kmp_present_inputs *kmp_workspace_inputs(struct kempe_workspace *workspace);

/** Makes a workspace with friction that slips. KEMPE_E_MEMORY. */
kempe_status kmp_workspace_new(const kempe_system *system, kempe_workspace **workspace);

/** Lets friction decide on its modes at each state, and chooses rows there. KEMPE_E_MEMORY; the caller frees `friction`
 * then. */
kempe_status kmp_workspace_take_friction(kempe_workspace *ws, kmp_workspace_friction friction);
