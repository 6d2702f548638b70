/* SPDX-License-Identifier: BSD-3-Clause */
/* A motion and its sensitivities to parameters: evaluated at any (t, u, ud) with the loops closed, from the assembled
 * start. Sensitivities are derivatives of q and qd, s = dq/dp and sd = dqd/dp; their rows of u and ud determine all
 * others by
 *
 *     s = N s_u - (0; Jv^-1 h_p)
 *     dud_u/dt = -Mr^-1 (Kr s_u + Gr s_ud + N' R_p)
 *
 * (analyses/derivatives/linearized.h, analyses/derivatives/parameter_slopes.h), so that another choice of u selects
 * other rows of the same matrices. */
#pragma once

#include "analyses/derivatives/linearized.h"
#include "analyses/derivatives/parameter_slopes.h"
#include "base/arena.h"
#include "integrators/steppers/ode.h"
#include "model/data/force.h"

/** A state that positions are predicted from. */
typedef struct kmp_sensitivity_equations_place {
    double t, *q, *drift; /* n; n x (2 + p): drift, curve and x, with q' = x u' + drift and q'' = x u'' + curve */
} kmp_sensitivity_equations_place;

typedef struct kmp_sensitivity_equations {
    const kempe_system *system;
    kmp_arena arena;
    kmp_linear linear;
    kmp_slopes *slopes;  /* not owned */
    kmp_slopes_sum *sum; /* the same weighted, for integration backwards; NULL: none. Not owned */
    bool weighted;       /* it takes the place of the slopes now */
    int n, m, count;     /* parameters */
    int columns;  /* directions that are followed: count, unless the caller has others, which change no parameter */
    double *part; /* 3 m + n: the change of the equations by one parameter */
    double *held; /* columns x m: derivatives of the distances at which rows of friction are held; NULL: none is */
    double *q;    /* n: where closing begins */
    kmp_sensitivity_equations_place
        anchor[2];          /* the last two of kmp_sensitivity_equations_anchor, the last one first */
    double *udd, *residual; /* p; n: room */
    double *shift;          /* 2 n + m: room */
    double *zero, *base;    /* n + m zeros; n: room */
    double *shown;          /* room for values of the outputs */
} kmp_sensitivity_equations;

/** The parameter derivatives are of this system and include its outputs. KEMPE_E_MEMORY. */
kempe_status kmp_sensitivity_equations_init(kmp_sensitivity_equations *varied, const kempe_system *system,
                                            const char *backend, kmp_slopes *slopes);
void kmp_sensitivity_equations_free(kmp_sensitivity_equations *varied);

/** Chooses u at a closed (t, q), from where positions are predicted. */
kempe_status kmp_sensitivity_equations_choose(kmp_sensitivity_equations *varied, double t, const double *q,
                                              const double *qd, const int *wish, int wish_count);

/** Takes a choice of u made elsewhere at such a state (kmp_linear_take). */
kempe_status kmp_sensitivity_equations_take(kmp_sensitivity_equations *varied, double t, const double *q,
                                            kmp_partition *part);

/** q (n) at (t, u), closed. KMP_GO or KMP_RETRY. */
int kmp_sensitivity_equations_position(kmp_sensitivity_equations *varied, double t, const double *u, double *q);

/** Takes the state (t, u, ud), with accelerations, multipliers and, unless linear.plain, tangents and parameter
 * derivatives. KMP_GO, or KMP_RETRY where loops do not close. No allocation, also in the functions below. */
int kmp_sensitivity_equations_at(kmp_sensitivity_equations *varied, double t, const double *u, const double *ud);

/** Closes the loops at (t, u) within an accepted step into varied->q, in parts on the way from its nearer end: for a
 * place from which the prediction is too far away, as within a step of half a turn of a driven motion. False: they do
 * not close, or only with jumps. */
bool kmp_sensitivity_equations_walk(kmp_sensitivity_equations *varied, double t, const double *u);

/** Takes a state like kmp_sensitivity_equations_at, with q (n) near the closed state in place of the prediction. */
int kmp_sensitivity_equations_near(kmp_sensitivity_equations *varied, double t, const double *q, const double *ud);

/** The same only of q and qd: no accelerations (kmp_linear_close). */
int kmp_sensitivity_equations_close(kmp_sensitivity_equations *varied, double t, const double *q, const double *ud);

/** dudd by u and by ud (p x 2 p) at the last state, at constant parameters. */
void kmp_sensitivity_equations_matrix(kmp_sensitivity_equations *varied, double *matrix);

/** Predictions of positions begin at the last state from now on; or at a place that the caller then fills. */
void kmp_sensitivity_equations_anchor(kmp_sensitivity_equations *varied);
kmp_sensitivity_equations_place *kmp_sensitivity_equations_next_anchor(kmp_sensitivity_equations *varied);

/** The distance of the last state from the prediction of the last anchor, scaled: the largest of all coordinates. */
double kmp_sensitivity_equations_miss(kmp_sensitivity_equations *varied, const double *u);

/** A column of changes with time, in place of a parameter; equations that are timed have it. */
enum { KMP_COLUMN_OF_TIME = -1 };

/** The change of the equations, at the state of their derivatives, by column k: a parameter, time, or nothing. */
kmp_change kmp_sensitivity_equations_change(kmp_sensitivity_equations *varied, int k);

/** dudd (p) by column k where (u, ud) have moved by (su, sud) (p each). */
void kmp_sensitivity_equations_accelerate(kmp_sensitivity_equations *varied, int k, const double *su, const double *sud,
                                          double *sudd);

/** The sensitivities of the whole mechanism that follow, each NULL when it is not needed: n, n, n, m values. */
void kmp_sensitivity_equations_follow(kmp_sensitivity_equations *varied, int k, const double *su, const double *sud,
                                      double *q, double *qd, double *qdd, double *lambda);

/** The changes of J' w (columns x n) where q moves by dq (columns x n), each parameter by one, and time with it by
 * `time` (columns; NULL: not). Of the instant q, t and conditions count. Tangents and parameter derivatives then belong
 * to another state. */
void kmp_sensitivity_equations_pull(kmp_sensitivity_equations *varied, const kmp_instant *at, const double *w,
                                    const double *dq, const double *time, double *out);

/** Rates of the accelerations (n) and multipliers (m) along the motion. Only where the slopes are timed. */
void kmp_sensitivity_equations_rates(kmp_sensitivity_equations *varied, double *qddd, double *lambda);

/** The name of the joint that is too near to its singular position for derivatives; NULL: none. */
const char *kmp_sensitivity_equations_singular(const kmp_sensitivity_equations *varied);

/** The start of kempe_assembly_new and its derivative for each parameter: q, qd (n), dq, dqd (n x count).
 * KEMPE_E_FAILED: it cannot be assembled, or its derivative depends on choices that the model leaves open; the message
 * lists coordinates to hold. */
kempe_status kmp_sensitivity_equations_start(kmp_sensitivity_equations *varied, double *q, double *qd, double *dq,
                                             double *dqd);
