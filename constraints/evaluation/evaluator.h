/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of a mechanism at one state, from the motion program. One per thread; no allocation after
 * kmp_eval_new. */
#pragma once

#include "backend/machine.h"
#include "base/arena.h"
#include "constraints/evaluation/present_inputs.h"
#include "dynamics/system.h"

typedef struct kmp_load_work kmp_load_work;
typedef struct kmp_left_tables kmp_left_tables;

typedef struct kmp_evaluator {
    const kempe_system *system;
    const kmp_backend *backend;
    kmp_arena arena;
    kmp_backend shared;                            /* the back end with a thread pool */
    kmp_machine *composite, *articulated, *motion; /* by M and C; by articulated bodies, NULL: none; the active one */
    kmp_machine *judge, *changes;
    bool closes_only;   /* `motion` has the closures alone, and there is no `judge` */
    bool weighs_only;   /* `composite` has closures and M alone: C is that of articulated bodies, by M */
    bool by_bodies;     /* `motion` is `articulated` */
    double *chart;      /* of the system's spherical joints: nine numbers each, initially C = 1 */
    long chart_version; /* number of their changes */
    double *mode;       /* the conditions (1 or 0), branches of kinks */
    kmp_present_inputs inputs;
    bool frozen;         /* conditions are fixed; otherwise they follow the state */
    bool holds_friction; /* inputs of friction that sticks do not follow the state (friction_state.h); those of rigid
                          * contacts never do */
    int n, m;
    const double *h;          /* m; the first four are those of the last kmp_eval_closure */
    const double *jacobian;   /* system->jacobian.count values */
    const double *h_t;        /* m, NULL when h does not depend on t */
    const double *mass;       /* system->mass.count values, since kmp_eval_mass */
    const double *bias;       /* n, since kmp_eval_bias */
    const double *jdqd;       /* m */
    const double *compliance; /* by bodies: compliance to drift replace mass to jdqd */
    const double *mobility;   /* system->mobility.count */
    const double *free_qdd;   /* n: accelerations without closure forces, since kmp_eval_bias */
    const double *drift;      /* m: J free_qdd + jdqd */
    const bool *left_out;     /* m, not owned: rows that need not be met; NULL: all must be */
    bool *dropped;            /* m: rows that rounded numbers leave open: they need not be met either */
    const double *solved[2];  /* solutions of implicit blocks in conditions: of all conditions, and of late ones, since
                               * the last kmp_eval_all_changes */
    double t, *q;             /* n: of the last kmp_eval_closure, for the user-defined force */
    const double *own_bias;   /* n: C of the program alone */
    const double *given;      /* n, not owned: further generalized forces; NULL: none */
    bool gave;                /* by articulated bodies: the machine still has such forces */
    double *with_force;       /* n: bias minus forces outside the program; by bodies their sum */
    double *effort;           /* n */
    double *by_mass;          /* n + m, where it weighs only: C and jdqd */
    double *nu; /* m: multipliers in the last C (constraints/evaluation/load_multipliers.h); NULL: C has none */
    const double *load_jacobian; /* system->load_jacobian.count values: dC/dlambda, with C */
    kmp_load_work *load;         /* of kmp_load_settle */
    kmp_left_tables *left_tables;
} kmp_evaluator;

/** Makes an evaluator; NULL after a message (unknown back end, no memory). */
kmp_evaluator *kmp_eval_new(const kempe_system *system, const char *backend);

/** Uses of an evaluator: closures alone; closures, M and energies, where kmp_eval_bias needs articulated bodies, or
 * kmp_eval_add_composite, if M and C of the system still wait for their first use; M and C, perhaps rarely; right-hand
 * sides by M and C. */
typedef enum kmp_eval_use { KMP_EVAL_CLOSES, KMP_EVAL_WEIGHS, KMP_EVAL_EVALUATES, KMP_EVAL_STEPS } kmp_eval_use;

/** Makes an evaluator for a use with a thread pool (NULL: none), used if the back end can; the pool outlives it. */
kmp_evaluator *kmp_eval_new_for(const kempe_system *system, const char *backend, kmp_team *team, kmp_eval_use use);

/** Makes an evaluator of h, J and h_t alone, by the tape: for kmp_eval_closure, and for what its results give. NULL
 * after a message. */
kmp_evaluator *kmp_eval_new_of_closures(const kempe_system *system);
void kmp_eval_free(kmp_evaluator *eval);

/** Its thread pool; NULL: none. */
kmp_team *kmp_eval_team(const kmp_evaluator *eval);

/** Prepares, once, the dynamics by articulated bodies, if the system has them. KEMPE_E_MEMORY. */
kempe_status kmp_eval_add_articulated(kmp_evaluator *eval);

/** Derives M and C, if the evaluator has M alone. Its last values are no longer valid. KEMPE_E_MEMORY. */
kempe_status kmp_eval_add_composite(kmp_evaluator *eval);

/** Selects M and C (initially) or articulated bodies for the values from the next kmp_eval_closure on. A kmp_saddle
 * accepts either. */
void kmp_eval_set_by_bodies(kmp_evaluator *eval, bool by_bodies);

/** Evaluates h, J, h_t at (t, q); then M there; then C and jdqd at qd. Each call needs the ones before it. */
void kmp_eval_closure(kmp_evaluator *eval, double t, const double *q);
void kmp_eval_mass(kmp_evaluator *eval);
void kmp_eval_bias(kmp_evaluator *eval, const double *qd);

/** Sets additional generalized forces (n, not owned; NULL: none) for later calls, and for M and C in the last
 * kmp_eval_bias. */
void kmp_eval_set_effort(kmp_evaluator *eval, const double *effort);

/** Evaluates C again with other multipliers, after kmp_eval_bias, for systems with forces that depend on multipliers
 * (system->load_row_count). */
void kmp_eval_bias_with(kmp_evaluator *eval, const double *nu);

/** Sets an input of all programs. */
void kmp_eval_set_all(kmp_evaluator *eval, kmp_input_kind kind, const double *values);

/** Takes new values of the system's parameters; earlier results are no longer valid. */
void kmp_eval_renew_parameters(kmp_evaluator *eval);

/** Uses h, J and h_t (NULL: none) at (t, q) of the caller, who keeps them until the next kmp_eval_closure. M, C and
 * jdqd need a preceding kmp_eval_closure or kmp_eval_use_closure. */
void kmp_eval_use_closure(kmp_evaluator *eval, double t, const double *q, const double *h, const double *jacobian,
                          const double *h_t);

/** Uses M, and C with jdqd after it, of the caller at the lent closure and some qd, by M and C and without forces that
 * depend on multipliers; the caller keeps them until the next kmp_eval_mass. */
void kmp_eval_lend_motion(kmp_evaluator *eval, const double *mass, const double *bias);

/** Sets the charts of the spherical joints (constraints/evaluation/charts.h); earlier results are no longer valid. */
void kmp_eval_set_charts(kmp_evaluator *eval, const double *chart);

/** User-defined generalized forces at (t, q, qd), owned by the evaluator, not finite on failure; NULL: none. */
const double *kmp_eval_effort(kmp_evaluator *eval, double t, const double *q, const double *qd);
