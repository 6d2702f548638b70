/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of a mechanism at one state, from the motion program. One per thread; no allocation after
 * kmp_plant_new. */
#ifndef KMP_CONSTRAINTS_EVALUATION_PLANT_H
#define KMP_CONSTRAINTS_EVALUATION_PLANT_H

#include "backend/x86/machine.h"
#include "base/arena.h"
#include "dynamics/system.h"

typedef struct kmp_plant {
    const kempe_system *system;
    const kmp_backend *backend;
    kmp_arena arena;
    kmp_backend shared;                            /* the back end with a thread pool */
    kmp_machine *composite, *articulated, *motion; /* by M and C; by articulated bodies, NULL: none; the active one */
    kmp_machine *judge, *changes;
    bool by_bodies;     /* `motion` is `articulated` */
    double *chart;      /* of the system's spherical joints: nine numbers each, initially C = 1 */
    long chart_version; /* number of their changes */
    double *mode;       /* the conditions (1 or 0), branches of kinks */
    bool frozen;        /* conditions are fixed; otherwise they follow the state */
    int n, m;
    const double *h;          /* m; the first four are those of the last kmp_plant_closure */
    const double *jacobian;   /* system->jacobian.count values */
    const double *h_t;        /* m, NULL when h does not depend on t */
    const double *mass;       /* system->mass.count values, since kmp_plant_mass */
    const double *bias;       /* n, since kmp_plant_bias */
    const double *jdqd;       /* m */
    const double *compliance; /* by bodies: compliance to drift replace mass to jdqd */
    const double *mobility;   /* system->mobility.count */
    const double *free_qdd;   /* n: accelerations without closure forces, since kmp_plant_bias */
    const double *drift;      /* m: J free_qdd + jdqd */
    const bool *left_out;     /* m, not owned: rows that need not be met; NULL: all must be */
    bool *dropped;            /* m: rows that rounded numbers leave open: they need not be met either */
    const double *solved[2];  /* solutions of implicit blocks in conditions: of all conditions, and of late ones, since
                               * the last kmp_plant_all_changes */
    double t, *q;             /* n: of the last kmp_plant_closure, for the user-defined force */
    const double *own_bias;   /* n: C of the program alone */
    const double *given;      /* n, not owned: further generalized forces; NULL: none */
    bool gave;                /* by articulated bodies: the machine still has such forces */
    double *with_force;       /* n: bias minus forces outside the program; by bodies their sum */
    double *effort;           /* n */
    double *nu;               /* m: multipliers in the last C (constraints/evaluation/pressing.h); NULL: C has none */
    const double *pressing;   /* system->pressing.count values: dC/dlambda, with C */
    struct kmp_press_work *press; /* of kmp_press */
} kmp_plant;

/** Makes a plant; NULL after a message (unknown back end, no memory). */
kmp_plant *kmp_plant_new(const kempe_system *system, const char *backend);

/** Makes a plant with a thread pool (NULL: none), used if the back end can; the pool outlives the plant. */
kmp_plant *kmp_plant_new_shared(const kempe_system *system, const char *backend, kmp_team *team);
void kmp_plant_free(kmp_plant *plant);

/** Prepares, once, the dynamics by articulated bodies, if the system has them. KEMPE_E_MEMORY. */
kempe_status kmp_plant_add_articulated(kmp_plant *plant);

/** Selects M and C (initially) or articulated bodies for the values from the next kmp_plant_closure on. A kmp_saddle
 * accepts either. */
void kmp_plant_take(kmp_plant *plant, bool by_bodies);

/** Evaluates h, J, h_t at (t, q); then M there; then C and jdqd at qd. Each call needs the ones before it. */
void kmp_plant_closure(kmp_plant *plant, double t, const double *q);
void kmp_plant_mass(kmp_plant *plant);
void kmp_plant_bias(kmp_plant *plant, const double *qd);

/** Sets additional generalized forces (n, not owned; NULL: none) for later calls, and for M and C in the last
 * kmp_plant_bias. */
void kmp_plant_give(kmp_plant *plant, const double *effort);

/** Evaluates C again with other multipliers, after kmp_plant_bias, for systems with forces that depend on multipliers
 * (system->pressed_count). */
void kmp_plant_bias_with(kmp_plant *plant, const double *nu);

/** Takes new values of the system's parameters; earlier results are no longer valid. */
void kmp_plant_renew_parameters(kmp_plant *plant);

/** Uses h, J and h_t (NULL: none) at (t, q) of the caller, who keeps them until the next kmp_plant_closure. M, C and
 * jdqd need a preceding kmp_plant_closure or kmp_plant_lend_closure. */
void kmp_plant_lend_closure(kmp_plant *plant, double t, const double *q, const double *h, const double *jacobian,
                            const double *h_t);

/** Copies J of the last closure with the rows in `left_out` (m) zero, into room for all entries of J. */
void kmp_plant_mask(const kmp_plant *plant, const bool *left_out, double *masked);

/** For a system of rounded numbers: marks the rows that a choice drops, or the widest rows at the last
 * kmp_plant_closure. Nothing closes them, so that they no longer count as open; kmp_plant_misfit reports them. */
void kmp_plant_drop(kmp_plant *plant, int count, const int *rows);
void kmp_plant_drop_widest(kmp_plant *plant);

/** Sets the charts of the spherical joints (constraints/closing/charts.h); earlier results are no longer valid. */
void kmp_plant_set_charts(kmp_plant *plant, const double *chart);

/** first - second of each condition at (t, q, qd); NULL without conditions. A condition holds if this is negative. */
const double *kmp_plant_changes(kmp_plant *plant, double t, const double *q, const double *qd);

/** Evaluates all conditions into `change`, one value per condition, including those that depend on accelerations and
 * multipliers, which kmp_plant_changes gives as zero. */
void kmp_plant_all_changes(kmp_plant *plant, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda, double *change);

/** Fixes the conditions as they are at (t, q, qd) for all later states, until `frozen` is cleared. kmp_plant_set_mode
 * changes a fixed one. */
void kmp_plant_freeze(kmp_plant *plant, double t, const double *q, const double *qd);
void kmp_plant_set_mode(kmp_plant *plant, int condition, bool holds);

/** Selects the branch of a kink (kmp_tree_kink); 0, initially: by the state. Not changed by kmp_plant_set_mode. */
void kmp_plant_set_kink(kmp_plant *plant, int condition, int side);

/** User-defined generalized forces at (t, q, qd), owned by the plant, not finite on failure; NULL: none. */
const double *kmp_plant_effort(kmp_plant *plant, double t, const double *q, const double *qd);

/** Dense copies of the last values, column-major: J is m x n, M n x n and symmetric. */
void kmp_plant_dense_jacobian(const kmp_plant *plant, double *jacobian);
void kmp_plant_dense_mass(const kmp_plant *plant, double *mass);

/** out += M x. */
void kmp_plant_add_mass_times(const kmp_plant *plant, const double *x, double *out);

/** Potential energy at (t, q); power of the non-conservative forces at (t, q, qd); closure forces (3 per closure) at
 * (t, q, lambda). */
double kmp_plant_potential(kmp_plant *plant, double t, const double *q);
double kmp_plant_power(kmp_plant *plant, double t, const double *q, const double *qd);
/** Power of the non-conservative forces from the last kmp_plant_bias, whose rates are qd. */
double kmp_plant_power_here(kmp_plant *plant, const double *qd);
const double *kmp_plant_reactions(kmp_plant *plant, double t, const double *q, const double *lambda);

/** Values of the model's outputs in addition to the table, in their order (model/output_table.h). */
const double *kmp_plant_shown(kmp_plant *plant, double t, const double *q, const double *qd, const double *qdd,
                              const double *lambda);

/** Power of moving closures at given multipliers, lambda' J qd = -lambda' h_t, with h_t of the last
 * kmp_plant_closure. */
double kmp_plant_drive_power(const kmp_plant *plant, const double *lambda);

/** Kinetic energy qd' M qd / 2 of the last kmp_plant_mass. */
double kmp_plant_kinetic(const kmp_plant *plant, const double *qd);

/** |h| / row scale of a row at the last kmp_plant_closure; the largest of the dropped rows and its index, -1: none is
 * open. */
double kmp_plant_opening(const kmp_plant *plant, int row);
double kmp_plant_misfit(const kmp_plant *plant, int *row);
/** True if a row must be met. */
bool kmp_plant_counts(const kmp_plant *plant, int row);

/** max |h| / row scale at the last kmp_plant_closure, over the rows that count. */
double kmp_plant_residual(const kmp_plant *plant);

/** J qd + h_t (m values) at the last kmp_plant_closure. */
void kmp_plant_rates(const kmp_plant *plant, const double *qd, double *rates);

/** max |J qd + h_t| / row scale at the last kmp_plant_closure, over the rows that count. */
double kmp_plant_rate_residual(const kmp_plant *plant, const double *qd);

#endif
