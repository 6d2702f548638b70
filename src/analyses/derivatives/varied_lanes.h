/* SPDX-License-Identifier: BSD-3-Clause */
/* A motion with sensitivities (varied.h) at several places at once, in the lanes of vector registers: accelerations of
 * u, and the matrices of their linear equations,
 *
 *     dudd = A (du, dud) + B dp.
 *
 * A row of both is one adjoint of the small change of a state (kmp_linear_back), so that they take as many passes as
 * there are degrees of freedom, whatever the number of parameters. Value k of lane l is at k KMP_STAGE_LANES + l. */
#pragma once

#include "analyses/derivatives/fused_lanes.h"
#include "analyses/derivatives/reduction_lanes.h"
#include "analyses/derivatives/varied.h"
#include "constraints/evaluation/stage_lanes.h"

typedef struct kmp_varied_lanes {
    kmp_sensitivity_equations *v;
    kmp_arena arena, choice;
    kmp_stage_lanes motion, tangent, slope, sum; /* programs; of derivatives by parameters one of both */
    kmp_reduction_lanes red;
    kmp_fused_lanes fused;      /* for the present choice of u, where that is worth */
    long number;                /* of the choice of u that `red` has; -1: none */
    int lasted;                 /* steps with this choice, as far as they are counted */
    bool due;                   /* the program is to be written */
    int *written, writings;     /* choices of this run whose program was written: rows and u, each n + m; number */
    bool closed;                /* the lanes are closed, at these times: */
    bool whole;                 /* by parts: Jv, M and C belong to these places, too */
    kmp_counts count_of_motion; /* operations of its program */
    double cycles_of_tangents;  /* of the programs of tangents and slopes, in lanes */
    double t[KMP_STAGE_LANES];
    double *q, *qd, *qdd, *lambda, *force; /* n, n, n, m, n */
    double *drift, *a0;                    /* n: qd at ud = 0, qdd at udd = 0 */
    double *u, *ud;                        /* p: where v was closed */
    double *udd;                           /* p */
    double *w;                             /* of some rows of the matrices side by side: p */
    double *wq, *wqd, *wqdd;               /* n: on q, qd, qdd */
    double *h, *rate, *curve, *weights;    /* m, m, m, n: on the equations, one after the other; of forces the last */
    const double *mass, *jacobian;         /* of the last run */
    const double *d, *by;                  /* of the last matrices: tangents, derivatives by parameters (NULL: none) */
} kmp_varied_lanes;

/** True if the equations of a system run in lanes here: vector registers, no user-defined force, no forces that depend
 * on multipliers, no delayed signals. The second: and their tangents have been derived as expressions. */
bool kmp_varied_lanes_suit(const kempe_system *system);
bool kmp_varied_lanes_can(const kmp_sensitivity_equations *varied);

/** Makes the lanes, with the machine code of the programs, for as many runs as `varied`, which must outlive them.
 * KEMPE_E_MEMORY; kmp_varied_lanes_free in any case. */
kempe_status kmp_varied_lanes_init(kmp_varied_lanes *lanes, kmp_sensitivity_equations *varied);
void kmp_varied_lanes_free(kmp_varied_lanes *lanes);

/** Writes the program of the motion for the choice of u that a run makes at the start of the system, with these wishes,
 * so that it need not be written there; none where that start cannot be assembled. KEMPE_E_MEMORY. */
kempe_status kmp_varied_lanes_expect(kmp_varied_lanes *lanes, const int *wish, int wish_count);

/** Takes the present evaluator and parameters at the start of a run. No allocation. */
void kmp_varied_lanes_begin(kmp_varied_lanes *lanes);

/** udd (p) at times, u and ud (p), with the loops closed from the last anchor, or from these lanes at the same times:
 * to round-off if `once`, otherwise as exactly as sweeps at these times need, which converge. KMP_GO, or KMP_RETRY
 * where loops do not close; KMP_HALT: no memory. Allocates only after an exchange of u, and where a joint takes
 * another chart. */
int kmp_varied_lanes_run(kmp_varied_lanes *lanes, bool once, const double *t, const double *u, const double *ud,
                         double *udd);

/** About the processor cycles of kmp_varied_lanes_run, and of the matrices, by counted operations. */
double kmp_varied_lanes_cycles(const kmp_varied_lanes *lanes);
double kmp_varied_lanes_matrix_cycles(const kmp_varied_lanes *lanes);

/** q (n) of the last lane, where the last run was at t there. false: it was elsewhere. */
bool kmp_varied_lanes_last(const kmp_varied_lanes *lanes, double t, double *q);

/** Predictions of positions begin at the place of a lane of the last run from now on. */
void kmp_varied_lanes_anchor(const kmp_varied_lanes *lanes, int lane);

/** The matrices at the places of the last run: a (p x 2 p), b (p x count; NULL: not requested), column-major. Results
 * as of that. */
int kmp_varied_lanes_matrices(kmp_varied_lanes *lanes, double *a, double *b);

/** out = b' weights (p) for the parameters of the sum (kmp_slopes_sum), at the places of the last matrices, without b:
 * for any number of them this takes as long as one row of the matrices. */
void kmp_varied_lanes_weigh(kmp_varied_lanes *lanes, const double *weights, double *out);
