/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Optimisation: dimensions, springs, masses, drives of a model for which a quantity of its runs is least or largest,
 * under limits.
 *
 *     kempe_optimum_options ask = {.minimize = "max(lambda(C))", .limits = "range(q(rocker)) > 0.8",
 *                                   .parameters = "crank:0.2:0.4,base:0.8:1", .starts = 10};
 *     kempe_optimum *optimum;
 *     kempe_optimum_new(model, &ask, &optimum);
 *
 * The solvers are from NLopt. A library that was built without it refuses.
 */
#ifndef KEMPE_OPTIMIZE_H
#define KEMPE_OPTIMIZE_H

#include <kempe/table.h>

KEMPE_BEGIN

/** Options; zeros and NULL mean defaults. */
typedef struct kempe_optimum_options {
    size_t size;            /* sizeof this struct; 0: its size in version 0.1 */
    const char *minimize;   /* a quantity, as in kempe_ensemble_options: an expression at the end, max(..), rms(..) */
    const char *maximize;   /* instead */
    const char *limits;     /* QUANTITY < VALUE, or <=, >, >=, separated by commas; NULL: none */
    const char *parameters; /* NAME:LOW:HIGH,..: both bounds are needed; start values as q.NAME and qd.NAME */
    const char *start;      /* CSV file: the table "parameters" of another search, from where the first one begins */
    int starts;         /* searches: the first from the model's values, others from a Sobol sequence in the bounds; 0: 1
                         */
    int pool;           /* places of the sequence that are tried for each start, of which the best are taken; 0: 8 */
    const char *method; /* slopes: exact ones; values: without; NULL: slopes where they exist */
    double tolerance;   /* relative, of the quantity and of the parameters over their ranges; 0: 1e-8 */
    int most;           /* evaluations of a search; 0: 500 */
    const kempe_run_options *run; /* as in kempe_sensitivity_options; max_steps 0: 10000; `threads` share the starts and
                                   * the searches, 0: one for each processor; results have the same bits */
} kempe_optimum_options;

typedef struct kempe_optimum kempe_optimum;

/** Searches. The model must outlive the optimum. A trial at which the model does not run shortens the step; such trials
 * are counted. Warnings are logged: limits that are not kept, a search that has not converged. KEMPE_E_ARGUMENT: a
 * name or number is wrong. KEMPE_E_INPUT: a quantity or a limit is wrong. KEMPE_E_FAILED: the model runs at no start.
 * KEMPE_STOPPED: an interrupt; the best place so far is given, after the first run. */
KEMPE_API kempe_status kempe_optimum_new(const kempe_model *model, const kempe_optimum_options *options,
                                         kempe_optimum **optimum);
KEMPE_API void kempe_optimum_free(kempe_optimum *optimum);

/** Number of parameters; name and value (SI) at the optimum; the quantity there, and 1 if all limits are kept. */
KEMPE_API int kempe_optimum_count(const kempe_optimum *optimum);
KEMPE_API const char *kempe_optimum_name(const kempe_optimum *optimum, int k);
KEMPE_API double kempe_optimum_value(const kempe_optimum *optimum, int k);
KEMPE_API double kempe_optimum_quantity(const kempe_optimum *optimum);
KEMPE_API int kempe_optimum_is_kept(const kempe_optimum *optimum);

/** "slopes" or "values": the method. */
KEMPE_API const char *kempe_optimum_method(const kempe_optimum *optimum);

/** Prints the result, as text or JSON. */
KEMPE_API kempe_status kempe_optimum_print(const kempe_optimum *optimum, kempe_format format, char **text);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "parameters": parameter, value, start, lower, upper, state: "", "lower", "upper" (at that bound), unit; "": SI.
 * "limits": limit, value, bound, state: "", "broken", unit. "starts", a row for each search: search, quantity, broken
 * (the largest part by which a limit is not kept), evaluations, refused, outcome, the parameters. "history", a row for
 * each evaluation: evaluation, search, quantity, broken, best. */
KEMPE_API kempe_status kempe_optimum_table(const kempe_optimum *optimum, const char *name, kempe_table **table);

/** Writes a self-contained HTML page: the mechanism moving with the parameters of the optimum, its outputs over
 * time, the printed result. KEMPE_E_IO: the path cannot be written. */
KEMPE_API kempe_status kempe_optimum_write_report(const kempe_optimum *optimum, const char *path);

KEMPE_END
#endif
