/* SPDX-License-Identifier: BSD-3-Clause */
/* Forward sensitivities: a motion with the sensitivities of its state to each parameter, as a separate formulation. A
 * runner (integrators/run/run.h) integrates them together, with error control over all of them, and handles events,
 * exchanges and spherical joints. Without parameters it is only the motion. When u becomes ill-conditioned, other
 * coordinates are chosen between steps, and the sensitivities continue as other rows of dq/dp. When a joint is centred,
 * they are converted to its new angles. When a condition of the model changes, at t_e(p) with g = 0, rates of the
 * sensitivities jump with the accelerations:
 *
 *     sd_u+ = sd_u- + (udd- - udd+) dt_e/dp      dt_e/dp = -(g_q s + g_qd sd + g_p) / (dg/dt along the motion)
 *
 * Where states take next values y+ = r(t, q, qd) with such an event, or at a sample, where t_e depends on no parameter,
 * the derivatives along the event, s + xd- dt_e/dp, are mapped by r. The sensitivities after it are less xd+ dt_e/dp.
 *
 * (Rozenvasser 1967; Hiskens and Pai, IEEE Trans. Circuits and Systems I 47 (2000) 204, eqs. 36-38). */
#pragma once

#include "analyses/derivatives/varied_lanes.h"
#include "constraints/evaluation/charts.h"
#include "integrators/run/run.h"
#include "model/data/force.h"

/** A row: the state, and its derivatives by each parameter (`count` times n, n, n, m, shown). */
typedef struct kmp_sensitivity_equations_row {
    double t;
    const double *q, *qd, *qdd, *lambda, *shown;
    const double *dq, *dqd, *dqdd, *dlambda, *dshown;
} kmp_sensitivity_equations_row;

/** A scalar: the sum of these weights times the values of a row; each NULL for none. */
typedef struct kmp_forward_target {
    const double *q, *qd, *qdd, *lambda, *shown;
} kmp_forward_target;

/** A requirement of the derivatives by parameters at an event, without which its map does not hold for them: `off`, by
 * the columns of the map, vanishes for them to the part `part` of their size. That is the sum of the sizes of their
 * terms, and `rounding` over the size of a parameter. */
typedef struct kmp_forward_requirement {
    const double *off, *term; /* terms x columns */
    int terms;
    double part, rounding;
    const char *reason; /* why there is no derivative otherwise */
    const struct kmp_forward_requirement *before;
} kmp_forward_requirement;

/** The state of a motion without sensitivities before and after an event or a change of its unknowns, or several at
 * one time: u, ud and the distances at which friction is held. Rows among `held` that are not held count as zero. At
 * the start, which is the first map, nothing is before (p = 0), and all columns are parameters. A change of the
 * independent coordinates without an event has no columns: its map follows from the state. */
typedef struct kmp_forward_map {
    double t;
    int p, held;                /* before */
    const int *row;             /* the rows of the equations, held */
    const double *q;            /* before: n */
    const double *mode, *chart; /* of the conditions and of the spherical joints, before */
    int columns;                /* by parameters, u, ud and held distances, in this order, as far as they go */
    const kmp_partition *part;  /* behind it */
    int p_after;
    const double *u_after, *ud_after, *held_after, *integral_after; /* columns x (p_after, p_after, held, 1) */
    const kmp_forward_requirement *requirement;                     /* the last one */
} kmp_forward_map;

/** Callbacks. Each may be NULL; a nonzero result ends the run with KEMPE_E_MEMORY. */
typedef struct kmp_sensitivity_equations_watch {
    void *user;
    int (*row)(void *user, const kmp_sensitivity_equations_row *row);
    /** After each step: the first of the runner's unknowns are u and ud (p each). */
    kmp_step_fn *step;
    /** A map of a motion without sensitivities; `again`: no step has ended since the last one, which it replaces. */
    int (*map)(void *user, const kmp_forward_map *map, bool again);
} kmp_sensitivity_equations_watch;

typedef struct kmp_forward {
    const kmp_run_spec *spec;            /* resolved; formulation and form do not count */
    const kmp_forward_target *integrand; /* whose integral over time is requested; NULL: none */
    bool alone;                          /* without sensitivities, except of the start and of changes */
    kmp_varied_lanes *lanes;             /* of these equations, for the stages of a step; NULL: one after the other */
    kmp_sensitivity_equations_watch watch;
} kmp_forward;

typedef struct kmp_forward_report {
    kmp_run_report run; /* its reason is to be freed (kmp_free) */
    double integral;    /* of the integrand up to the end of the run */
    int redundant;      /* closure rows that are: multipliers are not unique */
} kmp_forward_report;

/** Runs. `sizes` (count): of the parameters, for the weights of their sensitivities; `integral` (count, may be NULL)
 * receives the derivative of the integral. KEMPE_OK, KEMPE_STOPPED and KEMPE_E_FAILED with report->run.reason,
 * other errors by message. */
kempe_status kmp_forward_run(kmp_sensitivity_equations *varied, const kmp_forward *options, const double *sizes,
                             double *integral, kmp_forward_report *report);

/** kmp_target_value: the target's value at the last state of a motion, in the charts there. The second function: of
 * a row. */
double kmp_target_value(const kmp_forward_target *target, kmp_sensitivity_equations *varied);
double kmp_target_of_row(const kmp_forward_target *target, const kmp_sensitivity_equations *varied,
                         const kmp_sensitivity_equations_row *row);
