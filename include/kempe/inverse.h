/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Inverse dynamics with the loops closed: actuator forces and torques of chosen coordinates for a prescribed motion
 * (docs/inverse.md).
 *
 *     kempe_inverse *inverse = NULL;
 *     kempe_inverse_options ask = {.actuators = "slide1,slide2", .motion = "motion.csv"};
 *     kempe_table *rows = NULL;
 *     kempe_status status = kempe_inverse_new(system, &ask, &inverse);
 *     if (status == KEMPE_OK)
 *         status = kempe_inverse_table(inverse, "rows", &rows);
 *     if (status == KEMPE_OK)
 *         printf("%g N\n", kempe_table_number(rows, 0, kempe_table_find(rows, "tau.slide1")));
 *     kempe_table_free(rows);
 *     kempe_inverse_free(inverse);
 */
#ifndef KEMPE_INVERSE_H
#define KEMPE_INVERSE_H

#include <kempe/table.h>
#include <kempe/workspace.h>

KEMPE_BEGIN

/** NULL and 0 take the defaults. */
typedef struct kempe_inverse_options {
    size_t size;           /* sizeof this struct; 0: its size in version 0.1 */
    const char *actuators; /* coordinates, comma-separated; NULL: driven by the model's drives */
    const char *weights;   /* NAME=W,..: weights of their generalized forces if there are more actuators than degrees of
                            * freedom; 1 if not given */
    const char *motion;    /* CSV with t, q.NAME and, if known, qd.NAME and qdd.NAME; NULL: the model's drives, or
                            * without drives its start */
    const char *independent;  /* for the start: coordinates whose accelerations are zero, comma-separated */
    const char *backend;      /* as in kempe_run_options */
    double t_end;             /* s: end of the drives' motion; of a table at most its last time */
    double output_step;       /* s between rows; with a table, 0: its own rows */
    int no_convergence_check; /* 1: no check of rates and accelerations derived from a table's rows */
    const char *loads;        /* of joints and loops that redundant constraints share: least-norm; NULL: one
                               * solution */
} kempe_inverse_options;

typedef struct kempe_inverse kempe_inverse;

/** Computes the actuator forces row by row. If a table lacks rates or accelerations, the motion is repeated with every
 * second row, unless no_convergence_check is set: a warning is logged when the forces differ. KEMPE_E_FAILED: the
 * motion is impossible, or impossible with these actuators. `*inverse` is then given up to that row, with the reason;
 * so it is on KEMPE_STOPPED. KEMPE_E_INPUT: the table is wrong; the message has file:line:column. KEMPE_E_ARGUMENT: a
 * name or number is wrong, or there are no actuators. */
KEMPE_API kempe_status kempe_inverse_new(const kempe_system *system, const kempe_inverse_options *options,
                                         kempe_inverse **inverse);
KEMPE_API void kempe_inverse_free(kempe_inverse *inverse);

/** Its outcome, and the reason as a sentence ("" when complete). */
KEMPE_API kempe_outcome kempe_inverse_outcome(const kempe_inverse *inverse);
KEMPE_API const char *kempe_inverse_reason(const kempe_inverse *inverse);

/** Degrees of freedom to be actuated, and the rank of the actuators on them, both at the worst row. Rows with singular
 * loops, which have more degrees of freedom, do not count, here and below. */
KEMPE_API int kempe_inverse_dof(const kempe_inverse *inverse);
KEMPE_API int kempe_inverse_rank(const kempe_inverse *inverse);

/** Largest |M qdd + C - J' lambda - S tau| of all rows, relative to the size of its terms. */
KEMPE_API double kempe_inverse_residual(const kempe_inverse *inverse);

/** Components of the loads of joints and loops that redundant constraints share, and that are not unique, by name, as
 * "A: x, y, mz; B: x"; "": none. */
KEMPE_API const char *kempe_inverse_loads_not_unique(const kempe_inverse *inverse);

KEMPE_API kempe_status kempe_inverse_print(const kempe_inverse *inverse, kempe_format format, char **text);

/** The table "rows": t, tau.NAME and power.NAME of the actuators (N m or N, W), q.NAME, qd.NAME, qdd.NAME,
 * lambda.CLOSURE.k (zero in redundant rows), reaction.LOOP.x .. and moment.LOOP.x ... The table "reactions": the
 * largest ones of all joints and loops, as in kempe_trajectory_table. Free it with kempe_table_free.
 * KEMPE_E_ARGUMENT: another name. */
KEMPE_API kempe_status kempe_inverse_table(const kempe_inverse *inverse, const char *name, kempe_table **table);

/** Writes a self-contained HTML page: the prescribed motion, all columns of "rows" as curves. KEMPE_E_IO: the path
 * cannot be written. */
KEMPE_API kempe_status kempe_inverse_write_report(const kempe_inverse *inverse, const char *path);

/** Names the actuators of a workspace: `count` coordinates on which they act, with weights of their forces (positive;
 * NULL: all 1), which decide where there are more actuators than degrees of freedom. Another call replaces them.
 * KEMPE_E_ARGUMENT, with the reason in the message of the workspace: a name does not name a coordinate, or is given
 * twice; a weight is not positive; the model has contacts, or its friction may stick. KEMPE_E_MEMORY. */
KEMPE_API kempe_status kempe_workspace_add_actuators(kempe_workspace *workspace, int count, const char *const *names,
                                                     const double *weights);

/** The number of actuators of a workspace. */
KEMPE_API int kempe_workspace_actuator_count(const kempe_workspace *workspace);

/** Computed torque at a closed state: the forces tau of the actuators (kempe_workspace_actuator_count) that give the
 * accelerations qdd (n), through the loops. The sum of weight tau^2 is
 * the least possible, with forces in N times the characteristic length of the system. Dependent accelerations
 * follow from the independent ones, and are not read. Rows of drives and locks do not act: their forces are the
 * actuators'. `lambda` (m; NULL: not required): the multipliers; of friction that slips its force. KEMPE_E_ARGUMENT:
 * there are no actuators. KEMPE_E_FAILED, with the reason: the loops are open or singular; the actuators cannot produce
 * the accelerations, and tau is the least-squares solution. No allocation while the independent coordinates serve. */
KEMPE_API kempe_status kempe_workspace_actuator_forces(kempe_workspace *workspace, double t, const double *q,
                                                       const double *qd, const double *qdd, double *tau,
                                                       double *lambda);

/** The equations of closed motions in the p independent coordinates u: mass udd + bias = X' Q, and qdd = X udd + drift;
 * column-major, NULL: not required. */
typedef struct kempe_closed_equations {
    double *mass, *bias; /* p x p, p */
    double *X, *drift;   /* n x p, n */
} kempe_closed_equations;

/** The same at a closed state, with the independent coordinates of kempe_workspace_independent. For operational-space
 * control, together with kempe_outputs_closed_jacobian. KEMPE_E_FAILED: these coordinates do not describe the motion
 * there.
 */
KEMPE_API kempe_status kempe_workspace_closed_equations(kempe_workspace *workspace, double t, const double *q,
                                                        const double *qd, const kempe_closed_equations *out);

KEMPE_END
#endif
