/* SPDX-License-Identifier: BSD-3-Clause */
/* Linearisation about a closed state: the response of all quantities to a small change of the independent coordinates,
 * and the linearised reduced equations. With N = dq/du, R = N' (M qdd + C) and lambda from Jv' lambda = (M qdd + C)_v,
 *
 *     dR = Mr dudd + Gr dud + Kr du,     Mr = N' M N,     Gr = N' (C_qd N + M dqdd/dud),
 *     Kr = N' [(M qdd + C - J' lambda)_q N + C_qd dqd/du + M dqdd/du].
 *
 * If forces depend on multipliers, C changes with dlambda, which itself depends on dR's force
 * (constraints/evaluation/load_multipliers.h), so that Mr is neither N' M N nor symmetric. The terms include the
 * multipliers' share, lambda times the second derivatives of h (reduction by Wehage and Haug 1982 and Fisette and Samin
 * 1996, eqs. 42-46). This is the geometric stiffness, d(N')/du F = -N' (J' lambda)_q N at constant lambda. The state
 * need not be an equilibrium. */
#pragma once

#include "analyses/derivatives/spectrum.h"
#include "base/arena.h"
#include "constraints/partition/small_change.h"
#include "model/data/force.h"
#include "model/data/variant.h"

typedef struct kmp_linear {
    const kempe_system *system;
    kmp_arena arena, choice; /* of all arrays; of the matrices for the choice of coordinates */
    kmp_evaluator *eval;     /* its own, at the state */
    kmp_partition part;
    kmp_reduction red;
    kmp_tangents tangents;
    const double *d; /* values of the tangents at the state */
    int looks;       /* states so far */
    long number;     /* of the choice of coordinates: how many there have been */
    int n, m, p;
    bool chosen;                        /* part and red are there */
    bool held;                          /* set by the caller: conditions of the model keep the evaluator's values */
    bool switches;                      /* it has been doubted for a condition that changes at a state */
    bool plain;                         /* set by the caller: only the state is needed, no small changes */
    double t, *q, *qd, *qdd, *lambda;   /* the state: n, n, n, m */
    double *force;                      /* n: M qdd + C */
    double *residual;                   /* p: R */
    double *mass, *damping, *stiffness; /* p x p, column-major: Mr, Gr, Kr, since kmp_linear_matrices */
    double *inertia;     /* p x p: N' M N, since kmp_linear_matrices, where it differs from Mr; otherwise NULL */
    double *unit, *work; /* n, 5 n + m */
    double *pressed;     /* p x p: LU of Mr, where forces depend on multipliers; otherwise NULL */
    int *pivot;          /* p */
    bool factored;       /* `pressed` is factored at the state */
} kmp_linear;

/** Makes room. The tangents are evaluated number by number at first, and derived when that has happened often. No
 * independent coordinates are chosen yet. KEMPE_E_MEMORY. */
kempe_status kmp_linear_init(kmp_linear *linear, const kempe_system *system, const char *backend);

/** Frees its arrays; a zeroed object is allowed. */
void kmp_linear_free(kmp_linear *linear);

/** Derives the tangents as expressions now, for callers that evaluate hundreds of states: each evaluation is then
 * several times as fast. Without enough memory nothing changes. */
void kmp_linear_derive(kmp_linear *linear);

/** The system's parameters have other values now. */
void kmp_linear_renew_parameters(kmp_linear *linear);

/** Gives the parameters of a variant, of which the system is, these values; `linear` follows if it is made.
 *  KEMPE_E_FAILED: the model cannot have them, and why. */
kempe_status kmp_linear_vary(kmp_linear *linear, kempe_system *system, kmp_variant *variant, const double *values);

/** Chooses u at (t, q), closed; `wish`: coordinates that the caller requests (count 0: none). KEMPE_E_FAILED, with the
 * reason: the requested choice is impossible. No state is set then. */
kempe_status kmp_linear_choose(kmp_linear *linear, double t, const double *q, const int *wish, int wish_count);

/** Chooses u at (t, q), closed, with as many of the coordinates `liked` (count) as possible. KEMPE_E_MEMORY,
 * KEMPE_E_FAILED. */
kempe_status kmp_linear_prefer(kmp_linear *linear, double t, const double *q, int count, const int *liked);

/** Takes a choice made elsewhere, which is its own from now on. KEMPE_E_MEMORY, KEMPE_E_FAILED. */
kempe_status kmp_linear_take(kmp_linear *linear, kmp_partition *part);

/** Uses another evaluator of the same system, not owned, until its own is restored; no coordinates are chosen then. */
void kmp_linear_lend(kmp_linear *linear, kmp_evaluator *eval);

/** The index of a coordinate in u; -1: it is not independent. */
int kmp_linear_place(const kmp_linear *linear, int coordinate);

/** Doubts the state by the conditions that end runs and the tables that it leaves, each once; `rates` as of
 * kmp_eval_doubt_state. */
void kmp_linear_doubt_state(const kmp_linear *linear, bool rates);

/** The state, for evaluating other programs there. */
kmp_instant kmp_linear_instant(const kmp_linear *linear);

/** Takes the state with rates ud (NULL: zero) and accelerations udd (NULL: zero): its u are taken from q (n), and
 * the loops are closed from q. Conditions of the model have their values there. KEMPE_E_FAILED without message: Jv is
 * singular, or the loops do not close. */
kempe_status kmp_linear_at(kmp_linear *linear, double t, const double *q, const double *ud, const double *udd);

/** Takes the state as kmp_linear_at does with udd = 0, only for the residual. Tangents, and what follows small
 * changes, belong to the state before. */
kempe_status kmp_linear_residual_at(kmp_linear *linear, double t, const double *q, const double *ud);

/** Takes the state with the accelerations of the equations of motion, R = 0; otherwise as kmp_linear_at. KEMPE_E_FAILED
 * without message also where the reduced mass is not positive. */
kempe_status kmp_linear_at_motion(kmp_linear *linear, double t, const double *q, const double *ud);

/** Takes only q, closed, and qd of a state, with the factors and the tangent of the closures. Errors as kmp_linear_at.
 */
kempe_status kmp_linear_close(kmp_linear *linear, double t, const double *q, const double *ud);

/** Calls kmp_linear_at_motion if `motion`, otherwise kmp_linear_at, with the rates of u taken from the rates of
 * all coordinates (n). */
kempe_status kmp_linear_at_rates(kmp_linear *linear, double t, const double *q, const double *qd, bool motion);

/** kmp_follow at the last state, accelerations as given. */
void kmp_linear_follow(kmp_linear *linear, const kmp_change *change, const kmp_response *response);

/** Puts into udd (p) the change of accelerations that leaves R = 0 with a change dR (may be the same array). Only
 * after kmp_linear_at_motion. */
void kmp_linear_accelerate(kmp_linear *linear, const double *residual, double *udd);

/** Its transpose: weights on udd (p) become weights on R. */
void kmp_linear_accelerate_back(kmp_linear *linear, const double *udd, double *residual);

/** Weights of the results of a small change, each NULL for none. */
typedef struct kmp_weights {
    const double *q, *qd, *qdd, *lambda, *residual;
} kmp_weights;

/** Weights of the small changes themselves. */
typedef struct kmp_changes_weight {
    double *u, *ud, *udd;             /* p */
    double *h, *rate, *curve, *force; /* m, m, m, n */
} kmp_changes_weight;

/** The adjoint of kmp_linear_follow, for all changes at once: converts weights of results to weights of changes, so
 * that both weighted sums agree for any change. All of `back` must be present. At the last state. No allocation. */
void kmp_linear_back(kmp_linear *linear, const kmp_weights *weights, const kmp_changes_weight *back);

/** Mr, Gr and Kr of the last state, and N' M N, with the same roundings as in Mr. */
void kmp_linear_matrices(kmp_linear *linear);

/** Only N' M N, for callers that have made the other matrices by kmp_linear_follow. */
void kmp_linear_inertia(kmp_linear *linear);

/** The number of unknowns u that move in small motions: all but states that are constant (held, model/data/model.h).
 * Nothing but themselves moves these. `place` (p; NULL: not requested): the number of each among u. */
int kmp_linear_moving(const kmp_linear *linear, int *place);

/** Entries of a matrix `from` (`rows` rows) in the given rows and columns (NULL: all), into `to`, which may be `from`
 * where both ascend. */
void kmp_linear_squeeze(int rows, int row_count, const int *row, int column_count, const int *column,
                        const double *from, double *to);

/** The states x of the first-order form: the unknowns u that are not states of the model, then all rates of u that are
 * not held. `place` (2 p): the place of each among u and their rates (from p on). Their number. */
int kmp_linear_entries(const kmp_linear *linear, int *place);

/** A of x' = A x (width x width). 0; -1: no memory; -3: Mr is singular. */
int kmp_linear_first_order(const kmp_linear *linear, int width, const int *place, double *a);

/** Eigenvalues and vectors of Mr, Gr and Kr, without the values of held states, where the vectors are zero, and without
 * the zeros of integrals of states; independent of the choice of u. KEMPE_E_MEMORY; KEMPE_E_FAILED: Mr is singular, N'
 * M N is not positive, or an iteration did not converge. */
kempe_status kmp_linear_spectrum(const kmp_linear *linear, kmp_spectrum *spectrum);
