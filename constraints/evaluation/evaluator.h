/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of a mechanism at one state, from the motion program. One per thread; no allocation after
 * kmp_eval_new. */
#pragma once

#include "backend/machine.h"
#include "base/arena.h"
#include "constraints/evaluation/present_inputs.h"
#include "dynamics/system.h"

typedef struct kmp_load_work kmp_load_work;
typedef struct kmp_validity_marks kmp_validity_marks;
typedef struct kmp_state_ends kmp_state_ends;

typedef struct kmp_evaluator {
    const kempe_system *system;
    const kmp_backend *backend;
    kmp_arena arena;
    kmp_backend shared;                            /* the back end with a thread pool */
    kmp_machine *composite, *articulated, *motion; /* by M and C; by articulated bodies, NULL: none; the active one */
    kmp_machine *judge, *changes;
    bool closes_only;      /* `motion` has only the closures, and there is no `judge` */
    bool weighs_only;      /* `composite` has only closures and M: C is computed by articulated bodies, by M */
    bool by_products;      /* `composite` has C and products M x, and no M */
    bool by_bodies;        /* `motion` is `articulated` */
    double *chart;         /* of the system's spherical joints: nine numbers each, initially C = 1 */
    long chart_version;    /* number of their changes */
    double *mode;          /* the conditions (1 or 0), branches of kinks */
    int *late, late_count; /* the conditions whose values depend on accelerations and multipliers */
    bool modes_wait;       /* the machines do not have the present ones yet */
    kmp_present_inputs inputs;
    bool frozen;         /* conditions are fixed; otherwise they follow the state */
    bool holds_friction; /* inputs of friction that sticks do not follow the state (friction_state.h); rows of
                          * rigid contacts never do */
    int n, m;
    const double *h;                  /* m; the first four belong to the last kmp_eval_closure */
    const double *jacobian;           /* system->jacobian.count values */
    const double *h_t;                /* m, NULL when h does not depend on t */
    const double *mass;               /* system->mass.count values, since kmp_eval_mass */
    const double *bias;               /* n, since kmp_eval_bias */
    const double *jdqd;               /* m */
    const double *pivots, *diagonals; /* m: by bodies, of the rows, in place of M */
    const double *qdd, *multipliers;  /* n, m: by bodies, since kmp_eval_bias, in place of C and jdqd */
    double *kept;                     /* m: 1 for rows that may have multipliers by bodies, initially all */
    const bool *left_out;             /* m, not owned: rows that need not be met; NULL: all must be */
    bool *dropped;                    /* m: rows that rounded numbers leave open: they need not be met either */
    const double *solved[2]; /* solutions of implicit blocks in conditions: of all conditions, and of late ones, since
                              * the last kmp_eval_all_changes */
    double t, *q;            /* n: of the last kmp_eval_closure, for the user-defined force */
    const double *own_bias;  /* n: only C of the program */
    const double *given;     /* n, not owned: further generalized forces; NULL: none */
    bool gave;               /* by articulated bodies: the machine still has such forces */
    double *with_force;      /* n: bias minus forces outside the program; by bodies their sum */
    double *effort;          /* n */
    double *by_mass;         /* n + m, where it weighs only: C and jdqd */
    double *nu; /* m: multipliers in the last C (constraints/evaluation/load_multipliers.h); NULL: C has none */
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

/** True if M waits and energies are found link by link: all but energies then needs articulated bodies. */
bool kmp_eval_goes_by_links(const kmp_evaluator *eval);

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

/** Kinetic energy qd' M qd / 2 of the last kmp_eval_mass; both energies at its place. */
double kmp_eval_kinetic(kmp_evaluator *eval, const double *qd);
void kmp_eval_energies(kmp_evaluator *eval, const double *qd, double *kinetic, double *potential);

/* Residuals of closures, the rows that count in them, and rows that are dropped. */

/** For a system of rounded numbers: marks the rows that a choice drops, or the widest rows at the last
 * kmp_eval_closure. Nothing closes them, so that they no longer count as open; kmp_eval_misfit reports them. */
void kmp_eval_drop(kmp_evaluator *eval, int count, const int *rows);
void kmp_eval_drop_widest(kmp_evaluator *eval);

/** |h| / row scale of a row at the last kmp_eval_closure; the largest of the dropped rows and its index, -1: none is
 * open. */
double kmp_eval_opening(const kmp_evaluator *eval, int row);
double kmp_eval_misfit(const kmp_evaluator *eval, int *row);
/** True if a row must be met. */
bool kmp_eval_counts(const kmp_evaluator *eval, int row);

/** max |h| / row scale at the last kmp_eval_closure, over the rows that count. */
double kmp_eval_residual(const kmp_evaluator *eval);

/** max |J qd + h_t| / row scale at the last kmp_eval_closure, over the rows that count. */
double kmp_eval_rate_residual(const kmp_evaluator *eval, const double *qd);

/** The largest |x[i]| / scale (n). */
double kmp_eval_size(const kmp_evaluator *eval, const double *x);

/* Conditions of piecewise laws and branches of kinks, at a state or fixed. */

/** first - second of each condition at (t, q, qd); NULL without conditions. A condition holds if this is negative. */
const double *kmp_eval_changes(kmp_evaluator *eval, double t, const double *q, const double *qd);

/** Evaluates all conditions into `change`, one value per condition, including conditions that depend on accelerations
 * and multipliers, which kmp_eval_changes gives as zero. */
void kmp_eval_all_changes(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                          const double *lambda, double *change);

/** Fixes the conditions as they are at (t, q, qd) for all later states, until `frozen` is cleared. kmp_eval_set_mode
 * changes a fixed one. */
void kmp_eval_freeze(kmp_evaluator *eval, double t, const double *q, const double *qd);
void kmp_eval_set_mode(kmp_evaluator *eval, int condition, bool holds);

/** Takes all conditions and branches of kinks from another time. */
void kmp_eval_set_modes(kmp_evaluator *eval, const double *mode);

/** Selects the branch of a kink (kmp_tree_kink); 0, initially: by the state. Not changed by kmp_eval_set_mode. Sets the
 * input of a friction element's role. */
void kmp_eval_set_kink(kmp_evaluator *eval, int condition, double side);

/* Energies, power, reactions and outputs at a state. */

/** Potential energy at (t, q); power of the non-conservative forces at (t, q, qd); closure forces (3 per closure) at
 * (t, q, lambda). */
double kmp_eval_potential(kmp_evaluator *eval, double t, const double *q);
double kmp_eval_power(kmp_evaluator *eval, double t, const double *q, const double *qd);
/** Power of the non-conservative forces from the last kmp_eval_bias, whose rates are qd. */
double kmp_eval_power_here(kmp_evaluator *eval, const double *qd);
const double *kmp_eval_reactions(kmp_evaluator *eval, double t, const double *q, const double *lambda);

/** Values of the model's outputs in addition to the table, in their order (model/data/output_table.h). */
const double *kmp_eval_shown(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                             const double *lambda);

/* The rank that a rounded drawing means: closures that are redundant but for rounding of the model's numbers. J of such
 * a mechanism has a higher rank than the intended mechanism, with pivots of the size of the rounding, and its loops
 * close nowhere or at a few places. The intended rank is found once, when the loops are assembled
 * (constraints/closing/rounding.h), and kept in the system: every choice of rows uses it. Rows beyond it are dropped;
 * they stay open by their misfit, which is monitored. */

/** NULL: closures hold as written. */
const kmp_rounding *kmp_rounding_of(const kempe_system *system);

/** True if the assembly at the start has looked for redundant closures with the present numbers; it has found none
 * after kmp_rounding_keep_none. */
bool kmp_rounding_is_known(const kempe_system *system);
void kmp_rounding_keep_none(const kempe_system *system);

/** Zero tolerance for pivots of J, and for directions of its rows: `strict`, or more if numbers are rounded. */
double kmp_rounding_zero(const kempe_system *system, double strict);
