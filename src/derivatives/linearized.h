/* SPDX-License-Identifier: BSD-3-Clause */
/* A mechanism near one closed state: how everything moves along a small change of the independent coordinates, and the
 * reduced equations, linear in it. With N = dq/du, R = N' (M qdd + C) and lambda from Jv' lambda = (M qdd + C)_v,
 *
 *     dR = Mr dudd + Gr dud + Kr du,     Mr = N' M N,     Gr = N' (C_qd N + M dqdd/dud),
 *     Kr = N' [(M qdd + C - J' lambda)_q N + C_qd dqd/du + M dqdd/du],
 *
 * and where forces depend on multipliers C moves with dlambda, itself of dR's force
 * (constraints/evaluation/pressing.h), so that Mr is neither N' M N nor symmetric. The multipliers' share, lambda times
 * the second derivatives of h, inside (reduction by Wehage and Haug 1982 and Fisette and Samin 1996, eqs. 42-46; the
 * geometric stiffness, d(N')/du F = -N' (J' lambda)_q N with lambda held). No state needs to be an equilibrium. */
#ifndef KMP_DERIVATIVES_LINEARIZED_H
#define KMP_DERIVATIVES_LINEARIZED_H

#include "base/arena.h"
#include "integrators/formulations/reduced_jacobian.h"
#include "linalg/dense/spectrum.h"
#include "model/variant.h"

typedef struct kmp_linear {
    const kempe_system *system;
    kmp_arena arena, choice; /* of all arrays; of those that a choice of coordinates needs */
    kmp_plant *plant;        /* its own, at the state */
    kmp_partition part;
    kmp_reduction red;
    kmp_tangents tangents;
    const double *d; /* values of the tangents at the state */
    int looks;       /* states so far */
    int n, m, p;
    bool chosen;                        /* part and red are there */
    bool held;                          /* the caller sets: conditions of the model stay as the plant holds them */
    bool plain;                         /* likewise: the state alone is wanted, nothing of small changes */
    double t, *q, *qd, *qdd, *lambda;   /* the state: n, n, n, m */
    double *force;                      /* n: M qdd + C */
    double *residual;                   /* p: R */
    double *mass, *damping, *stiffness; /* p x p, column-major: Mr, Gr, Kr, since kmp_linear_matrices */
    double *inertia;                    /* likewise N' M N, where Mr is another; otherwise NULL */
    double *unit, *work;                /* n, 5 n + m */
    double *pressed;                    /* p x p: LU of Mr, where forces depend on multipliers; otherwise NULL */
    int *pivot;                         /* p */
    bool factored;                      /* it has been, at the state */
} kmp_linear;

/** Makes room. The tangents are evaluated number by number at first, and derived when that has happened often. No
 * independent coordinates are chosen yet. KEMPE_E_MEMORY. */
kempe_status kmp_linear_init(kmp_linear *linear, const kempe_system *system, const char *backend);

/** Also of one that was never made, all zero. */
void kmp_linear_free(kmp_linear *linear);

/** Derives the tangents now, for who will look at hundreds of states: each look is then several times as fast. Without
 * memory for it all stays as it is. */
void kmp_linear_derive(kmp_linear *linear);

/** The system's parameters have other values now. */
void kmp_linear_renew_parameters(kmp_linear *linear);

/** Gives the parameters of a variant, of which the system is, these values; `linear` follows if it is made.
 *  KEMPE_E_FAILED: the model cannot have them, and why. */
kempe_status kmp_linear_vary(kmp_linear *linear, kempe_system *system, kmp_variant *variant, const double *values);

/** Chooses u at (t, q), closed; `wish`: those that the caller wants (count 0: none). KEMPE_E_FAILED: the wish is not
 *  possible, and why. The state is then none. */
kempe_status kmp_linear_choose(kmp_linear *linear, double t, const double *q, const int *wish, int wish_count);

/** Takes a choice made elsewhere, which is its own from now on. KEMPE_E_MEMORY, KEMPE_E_FAILED. */
kempe_status kmp_linear_take(kmp_linear *linear, kmp_partition *part);

/** Goes by another plant of the same system, not owned, until the own one is given back; nothing is chosen then. */
void kmp_linear_lend(kmp_linear *linear, kmp_plant *plant);

/** Where a coordinate stands in u; -1: it is not independent. */
int kmp_linear_place(const kmp_linear *linear, int coordinate);

/** The state for who evaluates something else there. */
kmp_instant kmp_linear_instant(const kmp_linear *linear);

/** Takes the state with rates ud (NULL: zero) and accelerations udd (NULL: zero): q (n) is taken on its u and closed
 * from where it is. Conditions of the model hold as they do there. KEMPE_E_FAILED without message: Jv is singular, or
 * the loops do not close. */
kempe_status kmp_linear_at(kmp_linear *linear, double t, const double *q, const double *ud, const double *udd);

/** The same with the accelerations that the equations give: R = 0. KEMPE_E_FAILED without message also where the
 * reduced mass is not positive. */
kempe_status kmp_linear_at_motion(kmp_linear *linear, double t, const double *q, const double *ud);

/** Either of these, `motion` the latter, with the rates of u among those of all coordinates (n). */
kempe_status kmp_linear_at_rates(kmp_linear *linear, double t, const double *q, const double *qd, bool motion);

/** kmp_follow at the last state, accelerations as given. */
void kmp_linear_follow(kmp_linear *linear, const kmp_change *change, const kmp_response *response);

/** Puts into udd (p) the change of accelerations that leaves R = 0 with a change dR (may be the same array). After
 * kmp_linear_at_motion alone. */
void kmp_linear_accelerate(kmp_linear *linear, const double *residual, double *udd);

/** Weights of what followed of a small change, each NULL for none. */
typedef struct kmp_weights {
    const double *q, *qd, *qdd, *lambda, *residual;
} kmp_weights;

/** Of what makes one. */
typedef struct kmp_changes_weight {
    double *u, *ud, *udd;             /* p */
    double *h, *rate, *curve, *force; /* m, m, m, n */
} kmp_changes_weight;

/** The same backwards, for all changes at once: what weights on what follows are as weights on the changes, so that
 *  both sums are the same for any change; all of `back` must be there. At the last state. No allocation. */
void kmp_linear_back(kmp_linear *linear, const kmp_weights *weights, const kmp_changes_weight *back);

/** Mr, Gr and Kr of the last state, and N' M N, the latter with the same roundings as in Mr. */
void kmp_linear_matrices(kmp_linear *linear);

/** The latter alone, for who has made the others by kmp_linear_follow. */
void kmp_linear_inertia(kmp_linear *linear);

/** Eigenvalues and vectors of them; the same whatever u are chosen. KEMPE_E_MEMORY; KEMPE_E_FAILED: Mr is singular, N'
 * M N is not positive, or an iteration did not converge. */
kempe_status kmp_linear_spectrum(const kmp_linear *linear, kmp_spectrum *spectrum);

#endif
