/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of a mechanism at one state, from the motion program. One per thread; no allocation after
 * kmp_eval_new. */
#pragma once

#include "backend/machine.h"
#include "base/arena.h"
#include "constraints/evaluation/judged_values.h"
#include "constraints/evaluation/present_conditions.h"
#include "constraints/evaluation/present_inputs.h"
#include "constraints/evaluation/residuals.h"
#include "dynamics/system.h"

typedef struct kmp_load_work kmp_load_work;
typedef struct kmp_validity_marks kmp_validity_marks;
typedef struct kmp_state_ends kmp_state_ends;

/** The dynamics by articulated bodies, in place of M, C and jdqd. */
typedef struct kmp_body_recursion {
    kmp_machine *machine;             /* NULL: it is not prepared */
    double *kept;                     /* m: 1 for rows that may have multipliers, initially all */
    const double *pivots, *diagonals; /* m: of the rows, since kmp_eval_mass */
    const double *qdd, *multipliers;  /* n, m: since kmp_eval_bias */
} kmp_body_recursion;

/** Generalized forces outside the programs. */
typedef struct kmp_outer_forces {
    double *effort;      /* n: of the user-defined force, or zero */
    const double *given; /* n, not owned: further ones; NULL: none */
    bool gave;           /* by articulated bodies: the machine still has such forces */
    double *sum;         /* n: bias minus all of them; by bodies their sum */
} kmp_outer_forces;

typedef struct kmp_evaluator {
    const kempe_system *system;
    const kmp_backend *backend;
    kmp_arena arena;
    kmp_backend shared;              /* the back end with a thread pool */
    kmp_machine *composite, *motion; /* by M and C; the active one of both dynamics */
    kmp_machine *judge;              /* NULL: `motion` has only the closures */
    bool weighs_only;   /* `composite` has only closures and M: C is computed by articulated bodies, by M */
    bool by_products;   /* `composite` has C and products M x, and no M */
    bool by_bodies;     /* `motion` is of `bodies` */
    double *chart;      /* of the system's spherical joints: nine numbers each, initially C = 1 */
    long chart_version; /* number of their changes */
    kmp_present_conditions conditions;
    kmp_present_inputs inputs;
    int n, m;
    const double *h;        /* m; the first four belong to the last kmp_eval_closure */
    const double *jacobian; /* system->jacobian.count values */
    const double *h_t;      /* m, NULL when h does not depend on t */
    const double *mass;     /* system->mass.count values, since kmp_eval_mass */
    const double *bias;     /* n, since kmp_eval_bias */
    const double *jdqd;     /* m */
    kmp_body_recursion bodies;
    kmp_unmet_rows unmet;
    double t, *q;           /* n: of the last kmp_eval_closure, for the user-defined force */
    const double *own_bias; /* n: only C of the program */
    kmp_outer_forces outer;
    double *by_mass; /* n + m, where it weighs only: C and jdqd */
    double *nu;      /* m: multipliers in the last C (constraints/evaluation/load_multipliers.h); NULL: C has none */
    const double *load_jacobian; /* system->load_jacobian.count values: dC/dlambda, with C */
    kmp_load_work *load;         /* of kmp_load_settle */
    kmp_validity_marks *validity;
    kmp_state_ends *state_ends;
} kmp_evaluator;

/** Makes an evaluator; NULL after a message (unknown back end, no memory). */
kmp_evaluator *kmp_eval_new(const kempe_system *system, const char *backend);

/** Uses of an evaluator: only closures; closures, M and energies, where kmp_eval_bias needs articulated bodies, or
 * kmp_eval_add_composite, if M and C of the system still wait for their first use (a system that goes by products has
 * C, and M x for any x, in place of M); M and C, perhaps rarely; right-hand sides by M and C. */
typedef enum kmp_eval_use { KMP_EVAL_CLOSES, KMP_EVAL_WEIGHS, KMP_EVAL_EVALUATES, KMP_EVAL_STEPS } kmp_eval_use;

/** Makes an evaluator for a use with a thread pool (NULL: none), used if the back end can; the pool outlives it. */
kmp_evaluator *kmp_eval_new_for(const kempe_system *system, const char *backend, kmp_team *team, kmp_eval_use use);

/** Makes an evaluator of only h, J and h_t, by the tape: for kmp_eval_closure, and for what its results give. NULL
 * after a message. */
kmp_evaluator *kmp_eval_new_of_closures(const kempe_system *system);
void kmp_eval_free(kmp_evaluator *eval);

/** The program of its dynamics: by M and C, by products, or by articulated bodies. */
const kmp_program *kmp_eval_program(const kmp_evaluator *eval, bool by_bodies);

/** Its thread pool; NULL: none. */
kmp_team *kmp_eval_team(const kmp_evaluator *eval);

/** Prepares, once, the dynamics by articulated bodies, if the system has them. KEMPE_E_MEMORY. */
kempe_status kmp_eval_add_articulated(kmp_evaluator *eval);

/** Derives M and C, if the evaluator has only M, or products. Its last values are no longer valid. KEMPE_E_MEMORY. */
kempe_status kmp_eval_add_composite(kmp_evaluator *eval);

/** Selects M and C (initially) or articulated bodies for the values from the next kmp_eval_closure on. A kmp_saddle
 * accepts either. */
void kmp_eval_set_by_bodies(kmp_evaluator *eval, bool by_bodies);

/** By bodies: the rows that may have multipliers, which have a position of at least 0 (m). Values of the last state are
 * found again. */
void kmp_eval_keep_rows(kmp_evaluator *eval, const int *position);

/** By bodies: what no multiplier makes of each acceleration of the last kmp_eval_bias (n); NULL: there was none. */
const double *kmp_eval_open(kmp_evaluator *eval);

/** By bodies, after kmp_eval_mass: the mass-orthogonal change (n) with J x = -violation (m) on those rows. */
const double *kmp_eval_correction(kmp_evaluator *eval, const double *violation);

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

/* Products with J and M of the last evaluation. */

/** Dense copies of the last values, column-major: J is m x n, M n x n and symmetric. */
void kmp_eval_dense_jacobian(const kmp_evaluator *eval, double *jacobian);
void kmp_eval_dense_mass(const kmp_evaluator *eval, double *mass);

/** J qd + h_t (m values) at the last kmp_eval_closure. */
void kmp_eval_rates(const kmp_evaluator *eval, const double *qd, double *rates);

/** Power of moving closures at given multipliers, lambda' J qd = -lambda' h_t, with h_t of the last
 * kmp_eval_closure. */
double kmp_eval_drive_power(const kmp_evaluator *eval, const double *lambda);

/** out += M x. By products the evaluator runs a stage of its program. */
void kmp_eval_add_mass_times(const kmp_evaluator *eval, const double *x, double *out);
