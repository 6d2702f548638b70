/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * How results move with parameters of the model: exact derivatives, through the loops.
 *
 *     kempe_sensitivity_options ask = {.parameters = "crank,base", .outputs = "q(rocker)", .run =
 * kempe_run_options_default()}; kempe_sensitivity *s; kempe_sensitivity_new(model, &ask, &s); int last =
 * kempe_sensitivity_row_count(s) - 1; double by_crank = kempe_sensitivity_slope(s, last, 0, 0);
 */
#ifndef KEMPE_SENSITIVITY_H
#define KEMPE_SENSITIVITY_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** What is asked; zeros and NULL mean defaults. */
typedef struct kempe_sensitivity_options {
    const char *of;         /* trajectory (default) */
    const char *parameters; /* names with commas between, start values as q.NAME and qd.NAME among them; NULL: all plain
                             * numbers among the parameters that may vary */
    const char *outputs;    /* "position(b.P).x,q(A)"; NULL: those of the model */
    const char *method;     /* forward: rows over time; adjoint: the end alone, at a cost that does not grow with the
                             * number of parameters; NULL: forward, and of integrals whichever does less */
    int integral;           /* the outputs integrated from 0 to t_end instead */
    const char *at;         /* start | equilibrium: the state, where it is no trajectory */
    kempe_run_options run; /* tolerances, t_end, output_step, independent, back end; integrator: dop853, dopri5, radau5,
                              radau9, erk */
} kempe_sensitivity_options;

typedef struct kempe_sensitivity kempe_sensitivity;

/** Derives the equations with the parameters kept open, and finds the derivatives. Those of a trajectory are found once
 *  more at another tolerance, unless the run's `once`: a warning is logged when they do not hold. KEMPE_E_ARGUMENT: a
 * name or number; KEMPE_E_FAILED, with the message, and KEMPE_STOPPED: rows up to there are given all the same. The
 * model outlives it.
 */
KEMPE_API kempe_status kempe_sensitivity_new(const kempe_model *model, const kempe_sensitivity_options *ask,
                                             kempe_sensitivity **sensitivity);
KEMPE_API void kempe_sensitivity_free(kempe_sensitivity *sensitivity);

KEMPE_API int kempe_sensitivity_parameter_count(const kempe_sensitivity *sensitivity);
KEMPE_API const char *kempe_sensitivity_parameter(const kempe_sensitivity *sensitivity, int k);
/** Its value, SI. */
KEMPE_API double kempe_sensitivity_parameter_value(const kempe_sensitivity *sensitivity, int k);

/** What is differentiated: "q.rocker", "position.b.P.x"; "" beyond the last. */
KEMPE_API int kempe_sensitivity_column_count(const kempe_sensitivity *sensitivity);
KEMPE_API const char *kempe_sensitivity_column(const kempe_sensitivity *sensitivity, int column);

/** Rows; where each stands: its time, of a trajectory. */
KEMPE_API int kempe_sensitivity_row_count(const kempe_sensitivity *sensitivity);
KEMPE_API double kempe_sensitivity_at(const kempe_sensitivity *sensitivity, int row);

/** The value of a column, and its derivative by a parameter; NaN where there is none. */
KEMPE_API double kempe_sensitivity_value(const kempe_sensitivity *sensitivity, int row, int column);
KEMPE_API double kempe_sensitivity_slope(const kempe_sensitivity *sensitivity, int row, int column, int parameter);

/** "forward" or "adjoint", where there is a choice; else "". */
KEMPE_API const char *kempe_sensitivity_method(const kempe_sensitivity *sensitivity);

/** Work of the integrator; evaluations backwards included. */
typedef struct kempe_slope_work {
    long steps, rejected, refused, rhs, exchanges;
} kempe_slope_work;
KEMPE_API kempe_slope_work kempe_sensitivity_work(const kempe_sensitivity *sensitivity);

/** The last row and what it cost, as text or JSON. */
KEMPE_API kempe_status kempe_sensitivity_print(const kempe_sensitivity *sensitivity, kempe_format format, char **text);

/** Writes a row a line as CSV, whole or not at all: t, each column, and behind it COLUMN/PARAMETER for each. */
KEMPE_API kempe_status kempe_sensitivity_write_csv(const kempe_sensitivity *sensitivity, const char *path);

#ifdef __cplusplus
}
#endif
#endif
