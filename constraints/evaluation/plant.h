/* SPDX-License-Identifier: BSD-3-Clause */
/* The numbers of a mechanism at one state, from the motion program: one a thread. No allocation after kmp_plant_new. */
#ifndef KMP_CONSTRAINTS_EVALUATION_PLANT_H
#define KMP_CONSTRAINTS_EVALUATION_PLANT_H

#include "backend/x86/machine.h"
#include "base/arena.h"
#include "dynamics/system.h"

typedef struct kmp_plant {
    const kempe_system *system;
    const kmp_backend *backend;
    kmp_arena arena;
    kmp_backend shared;                            /* it, with a team */
    kmp_machine *composite, *articulated, *motion; /* by M and C; without them, NULL: none; the one at hand */
    kmp_machine *judge, *changes;
    bool by_bodies;     /* `motion` is the second */
    double *chart;      /* of the system's spherical joints: nine numbers each, 1 at first */
    long chart_version; /* how often they have changed */
    double *mode;       /* the conditions (1 or 0), branches of kinks */
    bool frozen;        /* they stay as they are; otherwise they follow the state */
    int n, m;
    const double *h;          /* m; these four since the last kmp_plant_closure */
    const double *jacobian;   /* system->jacobian.count values */
    const double *h_t;        /* m, NULL when h does not depend on t */
    const double *mass;       /* system->mass.count values, since kmp_plant_mass */
    const double *bias;       /* n, since kmp_plant_bias */
    const double *jdqd;       /* m */
    const double *compliance; /* these four by bodies, in place of those three: system->compliance.count values */
    const double *mobility;   /* system->mobility.count */
    const double *free_qdd;   /* n: accelerations without closure forces, since kmp_plant_bias */
    const double *drift;      /* m: J free_qdd + jdqd */
    const bool *left_out;     /* m, not owned: rows that need not be met; NULL: all count */
    bool *dropped;            /* m: rows that rounded numbers leave open: they need not be met either */
    const double *solved[2];  /* what implicit blocks solve for in conditions: of all, and of late ones, since the last
                                 kmp_plant_all_changes */
    double t, *q;             /* n: of the last kmp_plant_closure, for the user's force */
    const double *own_bias;   /* n: of the program alone */
    const double *given;      /* n, not owned: efforts beside those of the model and the user's; NULL: none */
    bool gave;                /* by bodies: the machine still holds such efforts */
    double *with_force;       /* n: bias less all efforts outside the program; by bodies the sum of these */
    double *effort;           /* n */
    double *nu; /* m: multipliers that C was evaluated with (constraints/evaluation/pressing.h); NULL: C has none */
    const double *pressing;       /* system->pressing.count values: dC/dlambda, with C */
    struct kmp_press_work *press; /* of kmp_press */
} kmp_plant;

/** NULL after a message (unknown back end, no memory). */
kmp_plant *kmp_plant_new(const kempe_system *system, const char *backend);

/** The same with a team that shares the work, as far as the back end can; NULL: with none. It outlives the plant. */
kmp_plant *kmp_plant_new_shared(const kempe_system *system, const char *backend, kmp_team *team);
void kmp_plant_free(kmp_plant *plant);

/** Makes ready, once, to write the dynamics by articulated bodies, where the system has them. KEMPE_E_MEMORY. */
kempe_status kmp_plant_add_articulated(kmp_plant *plant);

/** Which of the two what follows is of, from the next kmp_plant_closure on; not by bodies at first. A kmp_saddle takes
 *  either. */
void kmp_plant_take(kmp_plant *plant, bool by_bodies);

/** h, J, h_t at (t, q); then M there; then C and jdqd at qd. Each needs those before it to be up to date. */
void kmp_plant_closure(kmp_plant *plant, double t, const double *q);
void kmp_plant_mass(kmp_plant *plant);
void kmp_plant_bias(kmp_plant *plant, const double *qd);

/** Sets additional efforts (n, not owned; NULL: none) for later calls, and for M and C in the last kmp_plant_bias. */
void kmp_plant_give(kmp_plant *plant, const double *effort);

/** C anew with other multipliers, after kmp_plant_bias, of systems with forces that depend on them
 * (system->pressed_count). */
void kmp_plant_bias_with(kmp_plant *plant, const double *nu);

/** The system's parameters have other values now; what was evaluated before no longer holds. */
void kmp_plant_renew_parameters(kmp_plant *plant);

/** Takes h, J and h_t (NULL: none) at (t, q) from elsewhere, which keeps them until the next kmp_plant_closure. M, C
 * and jdqd need one of those before them. */
void kmp_plant_lend_closure(kmp_plant *plant, double t, const double *q, const double *h, const double *jacobian,
                            const double *h_t);

/** J with the rows in `left_out` (m) zero, of the last closure, into room for all entries of J. */
void kmp_plant_mask(const kmp_plant *plant, const bool *left_out, double *masked);

/** Of a system whose numbers are rounded the rows that a choice drops, or that are open widest at the last
 * kmp_plant_closure: nothing closes them, so that they no longer count as open (kmp_plant_misfit does). */
void kmp_plant_drop(kmp_plant *plant, int count, const int *rows);
void kmp_plant_drop_widest(kmp_plant *plant);

/** Sets the charts of the spherical joints (constraints/closing/charts.h); what was evaluated before no longer holds.
 */
void kmp_plant_set_charts(kmp_plant *plant, const double *chart);

/** first - second of each condition at (t, q, qd); NULL when the model has none. A condition holds where it is
 * negative. */
const double *kmp_plant_changes(kmp_plant *plant, double t, const double *q, const double *qd);

/** The same with those that depend on accelerations and multipliers, which are zero there; `change`: one a condition.
 */
void kmp_plant_all_changes(kmp_plant *plant, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda, double *change);

/** Holds the conditions as they are at (t, q, qd), whatever state is evaluated later, until `frozen` is taken back.
 *  kmp_plant_set_mode changes one that is held. */
void kmp_plant_freeze(kmp_plant *plant, double t, const double *q, const double *qd);
void kmp_plant_set_mode(kmp_plant *plant, int condition, bool holds);

/** Which branch of a kink counts (kmp_tree_kink); 0, until it is set, whichever does. kmp_plant_set_mode leaves it. */
void kmp_plant_set_kink(kmp_plant *plant, int condition, int side);

/** The user's efforts at (t, q, qd), owned by the plant, not finite where they cannot be evaluated; NULL: there are
 * none. */
const double *kmp_plant_effort(kmp_plant *plant, double t, const double *q, const double *qd);

/** Dense copies of the last values, column-major: J is m x n, M n x n and symmetric. */
void kmp_plant_dense_jacobian(const kmp_plant *plant, double *jacobian);
void kmp_plant_dense_mass(const kmp_plant *plant, double *mass);

/** out += M x. */
void kmp_plant_add_mass_times(const kmp_plant *plant, const double *x, double *out);

/** Potential energy at (t, q); power of the non-conservative forces at (t, q, qd); closure forces (3 a closure) at
 * (t, q, lambda). */
double kmp_plant_potential(kmp_plant *plant, double t, const double *q);
double kmp_plant_power(kmp_plant *plant, double t, const double *q, const double *qd);
/** That power with the forces of the last kmp_plant_bias at hand, whose rates qd are. */
double kmp_plant_power_here(kmp_plant *plant, const double *qd);
const double *kmp_plant_reactions(kmp_plant *plant, double t, const double *q, const double *lambda);

/** What outputs show beside the table, in their order (model/output_table.h). */
const double *kmp_plant_shown(kmp_plant *plant, double t, const double *q, const double *qd, const double *qdd,
                              const double *lambda);

/** Power that closures which move in time do at given multipliers, lambda' J qd = -lambda' h_t, with h_t of the last
 * kmp_plant_closure. */
double kmp_plant_drive_power(const kmp_plant *plant, const double *lambda);

/** Kinetic energy qd' M qd / 2 of the last kmp_plant_mass. */
double kmp_plant_kinetic(const kmp_plant *plant, const double *qd);

/** |h| / row scale of a row at the last kmp_plant_closure; the widest of the dropped ones and which, -1: none is open.
 */
double kmp_plant_opening(const kmp_plant *plant, int row);
double kmp_plant_misfit(const kmp_plant *plant, int *row);
/** Whether a row is to be met. */
bool kmp_plant_counts(const kmp_plant *plant, int row);

/** max |h| / row scale of the last kmp_plant_closure, of the rows that count. */
double kmp_plant_residual(const kmp_plant *plant);

/** J qd + h_t (m values) at the last kmp_plant_closure. */
void kmp_plant_rates(const kmp_plant *plant, const double *qd, double *rates);

/** max |J qd + h_t| / row scale, likewise. */
double kmp_plant_rate_residual(const kmp_plant *plant, const double *qd);

#endif
