/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Parameters of a model from measured motions: masses, friction, springs, lengths, start values. Nonlinear least
 * squares with bounds; the derivatives are exact, by kempe_sensitivity_new.
 *
 *     kempe_fit_options ask = {.data = "measured.csv", .parameters = "slider_mass:0:10,friction:0:5"};
 *     kempe_fit *fit;
 *     kempe_fit_new(model, &ask, &fit);
 *     kempe_table *estimates;
 *     kempe_fit_table(fit, "parameters", &estimates);
 *     double mass = kempe_table_number(estimates, 0, kempe_table_find(estimates, "value"));
 *
 * The solver is from MINPACK (cminpack). A library that was built without it refuses.
 */
#ifndef KEMPE_FIT_H
#define KEMPE_FIT_H

#include <kempe/table.h>

KEMPE_BEGIN

/** Options; zeros and NULL mean defaults. */
typedef struct kempe_fit_options {
    size_t size;      /* sizeof this struct; 0: its size in version 0.1 */
    const char *data; /* CSV file: t, and columns as in the tables of a run, q.crank or position.b.P.x [mm]; cells may
                       * be empty */
    /* Separated by commas: NAME, NAME:LOW:HIGH or NAME=LOW:HIGH, NAME:LOW: or NAME::HIGH. Names as in
     * kempe_sensitivity_options, start values among them; numbers may have units. The search begins at the model's
     * values. */
    const char *parameters;
    const char *columns;    /* "q.crank,..": columns of the data that are fitted; NULL: all */
    const char *deviations; /* "q.crank=0.01,..": standard deviations of the noise, which weight the columns; NULL: they
                             * follow from the residuals of each column */
    const char *start;      /* CSV file: the table "parameters" of another fit, whose values are the start */
    double confidence;      /* of the intervals; 0: 0.95 */
    int most;               /* runs of the model in a search; 0: 200 */
    int starts;             /* searches: others than the first begin at places of a Sobol sequence between the bounds,
                             * which all parameters need then; 0: 8, or 1 where a parameter lacks a bound */
    /* Tolerances, independent, back end, integrator: as kempe_sensitivity_options. `threads` share the searches, 0: one
     * for each processor; results have the same bits. */
    const kempe_run_options *run;
    /* Further data files, each with a separate run; `data` is number 1. They share the parameters, but for one named
     * NAME@K, which belongs only to the run of file K. A column has one deviation in all files. */
    const char *const *files;
    int file_count;
    const char *own; /* "load@2=3,q.crank@1=0.2": values of parameters and start values in single runs */
} kempe_fit_options;

typedef struct kempe_fit kempe_fit;

/** Finds the parameters. The model must outlive the fit. A trial at which the model does not assemble, or does not
 * reach the last measurement, shortens the step; such trials are counted. Warnings are logged: parameters that the data
 * does not determine, a search that has not converged. KEMPE_E_ARGUMENT: a name or number is wrong, or the run has an
 * option that is not obeyed here, as t_end. KEMPE_E_INPUT: the data are wrong. KEMPE_E_IO: a file of the data cannot be
 * read. KEMPE_E_FAILED: the model does not run with the values of the start, or there are fewer measurements than
 * parameters. KEMPE_STOPPED: an interrupt; the best values so far are given, after the first run. */
KEMPE_API kempe_status kempe_fit_new(const kempe_model *model, const kempe_fit_options *options, kempe_fit **fit);
KEMPE_API void kempe_fit_free(kempe_fit *fit);

/** Number of parameters; name, estimate (SI), its standard error, and the ends of its interval. NaN: it is at a bound,
 * or the data does not determine it. */
KEMPE_API int kempe_fit_count(const kempe_fit *fit);
KEMPE_API const char *kempe_fit_name(const kempe_fit *fit, int k);
KEMPE_API double kempe_fit_value(const kempe_fit *fit, int k);
KEMPE_API double kempe_fit_error(const kempe_fit *fit, int k);
KEMPE_API double kempe_fit_low(const kempe_fit *fit, int k);
KEMPE_API double kempe_fit_high(const kempe_fit *fit, int k);

/** The rank of the scaled Jacobian: the number of combinations of parameters that the data determines. */
KEMPE_API int kempe_fit_rank(const kempe_fit *fit);

/** Prints the estimates, as text or JSON. */
KEMPE_API kempe_status kempe_fit_print(const kempe_fit *fit, kempe_format format, char **text);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "parameters": parameter, value, error, low, high, start, lower, upper, state: "", "lower", "upper" (at that bound),
 * "open" (not determined by the data); unit of these numbers, "": SI. "correlation": parameter, and a column for each
 * parameter. "columns": column, count, rms (of the residuals), deviation (of a measurement, which gives its weight),
 * unit. "rows": t, and for each column the fitted motion, COLUMN.measured, and COLUMN.residual, measured less fitted;
 * with several data files first `file`, its number. "first": those rows of the first file. */
KEMPE_API kempe_status kempe_fit_table(const kempe_fit *fit, const char *name, kempe_table **table);

/** Writes a self-contained HTML page: the mechanism moving with the estimates, the fitted motion with the data,
 * residuals, and the printed result. KEMPE_E_IO: the path cannot be written. */
KEMPE_API kempe_status kempe_fit_write_report(const kempe_fit *fit, const char *path);

KEMPE_END
#endif
