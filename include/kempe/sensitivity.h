/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Sensitivities of results with respect to parameters of the model: exact derivatives, through the loops.
 *
 *     kempe_sensitivity_options ask = {.parameters = "crank,base", .outputs = "q(rocker)"};
 *     kempe_sensitivity *s;
 *     kempe_sensitivity_new(model, &ask, &s);
 *     kempe_table *rows;
 *     kempe_sensitivity_table(s, "rows", &rows);
 *     int last = kempe_table_row_count(rows) - 1;
 *     double by_crank = kempe_table_number(rows, last, kempe_table_find(rows, "q.rocker/crank"));
 */
#ifndef KEMPE_SENSITIVITY_H
#define KEMPE_SENSITIVITY_H

#include <kempe/table.h>

KEMPE_BEGIN

/** Options; zeros and NULL mean defaults. */
typedef struct kempe_sensitivity_options {
    size_t size;            /* sizeof this struct; 0: its size in version 0.1 */
    const char *of;         /* trajectory (default) */
    const char *parameters; /* names, comma-separated, constant inputs and start values (q.NAME, qd.NAME) among them;
                             * NULL: all parameters that are plain numbers and may vary */
    const char *outputs;    /* "position(b.P).x,q(A)"; NULL: as in the model */
    const char *method;     /* forward: rows over time; adjoint: only the end, at a cost that does not grow with the
                             * number of parameters. NULL: forward, and for integrals the cheaper one */
    int integral;           /* 1: the outputs are integrated from 0 to t_end */
    const char *at;         /* start | equilibrium: the state, if `of` is not a trajectory */
    const kempe_run_options *run; /* tolerances, t_end, output_step, independent, back end; integrator: radau, dop853,
                                   * dopri5, radau5, radau9, erk; NULL: as in the model, or radau where the stages of
                                   * its steps share vector registers, dop853 elsewhere */
} kempe_sensitivity_options;

typedef struct kempe_sensitivity kempe_sensitivity;

/** Derives the equations with the parameters kept symbolic, and computes the derivatives. Derivatives of a trajectory
 * are repeated at another tolerance, unless the run's no_convergence_check is set: a warning is logged when they
 * differ. The model must outlive the sensitivity. KEMPE_E_ARGUMENT: a name or number is wrong, or the run has an option
 * that is not obeyed here, as the formulation. KEMPE_E_FAILED, with the message, and KEMPE_STOPPED: rows up to that
 * point are given. */
KEMPE_API kempe_status kempe_sensitivity_new(const kempe_model *model, const kempe_sensitivity_options *options,
                                             kempe_sensitivity **sensitivity);
KEMPE_API void kempe_sensitivity_free(kempe_sensitivity *sensitivity);

/** "forward" or "adjoint", if there is a choice; else "". */
KEMPE_API const char *kempe_sensitivity_method(const kempe_sensitivity *sensitivity);

/** Work of the integrator; evaluations of the adjoint included. */
typedef struct kempe_slope_work {
    long steps, rejected, refused, rhs, exchanges;
} kempe_slope_work;
KEMPE_API kempe_slope_work kempe_sensitivity_work(const kempe_sensitivity *sensitivity);

/** Prints the last row and its cost, as text or JSON. */
KEMPE_API kempe_status kempe_sensitivity_print(const kempe_sensitivity *sensitivity, kempe_format format, char **text);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "rows": t of a trajectory, otherwise "row"; then each differentiated quantity, such as q.rocker or position.b.P.x,
 * followed by its derivatives by the parameters, q.rocker/PARAMETER.
 * "parameters": parameter, its name; value, unit; "": SI. */
KEMPE_API kempe_status kempe_sensitivity_table(const kempe_sensitivity *sensitivity, const char *name,
                                               kempe_table **table);

KEMPE_END
#endif
