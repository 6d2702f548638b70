/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Sensitivities of results with respect to parameters of the model: exact derivatives, through the loops.
 *
 *     kempe_sensitivity_options ask = {.parameters = "crank,base", .outputs = "q(rocker)"};
 *     ask.run = kempe_run_options_default();
 *     kempe_sensitivity *s;
 *     kempe_sensitivity_new(model, &ask, &s);
 *     int last = kempe_sensitivity_row_count(s) - 1;
 *     double by_crank = kempe_sensitivity_slope(s, last, 0, 0);
 */
#ifndef KEMPE_SENSITIVITY_H
#define KEMPE_SENSITIVITY_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** Options; zeros and NULL mean defaults. */
typedef struct kempe_sensitivity_options {
    const char *of;         /* trajectory (default) */
    const char *parameters; /* names, comma-separated, start values among them as q.NAME and qd.NAME; NULL: all
                             * parameters that are plain numbers and may vary */
    const char *outputs;    /* "position(b.P).x,q(A)"; NULL: those of the model */
    const char *method;     /* forward: rows over time; adjoint: the end alone, at a cost that does not grow with the
                             * number of parameters. NULL: forward, and for integrals the cheaper one */
    int integral;           /* 1: the outputs are integrated from 0 to t_end */
    const char *at;         /* start | equilibrium: the state, if `of` is not a trajectory */
    kempe_run_options run; /* tolerances, t_end, output_step, independent, back end; integrator: dop853, dopri5, radau5,
                              radau9, erk */
} kempe_sensitivity_options;

typedef struct kempe_sensitivity kempe_sensitivity;

/** Derives the equations with the parameters kept symbolic, and computes the derivatives. Derivatives of a trajectory
 * are repeated at another tolerance, unless the run's no_convergence_check is set: a warning is logged when they
 * differ. The model must outlive the sensitivity. KEMPE_E_ARGUMENT: a name or number is wrong. KEMPE_E_FAILED, with the
 * message, and KEMPE_STOPPED: rows up to that point are given. */
KEMPE_API kempe_status kempe_sensitivity_new(const kempe_model *model, const kempe_sensitivity_options *ask,
                                             kempe_sensitivity **sensitivity);
KEMPE_API void kempe_sensitivity_free(kempe_sensitivity *sensitivity);

KEMPE_API int kempe_sensitivity_parameter_count(const kempe_sensitivity *sensitivity);
KEMPE_API const char *kempe_sensitivity_parameter(const kempe_sensitivity *sensitivity, int k);
/** Value of the k-th parameter, SI. */
KEMPE_API double kempe_sensitivity_parameter_value(const kempe_sensitivity *sensitivity, int k);

/** Names of the differentiated quantities: "q.rocker", "position.b.P.x"; "" beyond the last. */
KEMPE_API int kempe_sensitivity_column_count(const kempe_sensitivity *sensitivity);
KEMPE_API const char *kempe_sensitivity_column(const kempe_sensitivity *sensitivity, int column);

/** The number of rows; the time of a row, for a trajectory. */
KEMPE_API int kempe_sensitivity_row_count(const kempe_sensitivity *sensitivity);
KEMPE_API double kempe_sensitivity_at(const kempe_sensitivity *sensitivity, int row);

/** The value of a column, and its derivative by a parameter; NaN for an index that does not exist. */
KEMPE_API double kempe_sensitivity_value(const kempe_sensitivity *sensitivity, int row, int column);
KEMPE_API double kempe_sensitivity_slope(const kempe_sensitivity *sensitivity, int row, int column, int parameter);

/** "forward" or "adjoint", if there is a choice; else "". */
KEMPE_API const char *kempe_sensitivity_method(const kempe_sensitivity *sensitivity);

/** Work of the integrator; evaluations of the adjoint included. */
typedef struct kempe_slope_work {
    long steps, rejected, refused, rhs, exchanges;
} kempe_slope_work;
KEMPE_API kempe_slope_work kempe_sensitivity_work(const kempe_sensitivity *sensitivity);

/** Prints the last row and its cost, as text or JSON. */
KEMPE_API kempe_status kempe_sensitivity_print(const kempe_sensitivity *sensitivity, kempe_format format, char **text);

/** Writes a CSV file with a line for each row, whole or not at all: t, and each column followed by COLUMN/PARAMETER for
 * each parameter. */
KEMPE_API kempe_status kempe_sensitivity_write_csv(const kempe_sensitivity *sensitivity, const char *path);

KEMPE_END
#endif
