/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Many instances of one mechanism with different parameters. The equations are derived once, with what varies kept
 * open; instances run side by side in the lanes of a vector register, each with its own steps and its own error
 * control.
 *
 *     kempe_values *values;
 *     kempe_ensemble *ensemble;
 *     kempe_batch *batch;
 *     kempe_values_read(model, "cranks.csv", &values);
 *     kempe_ensemble_new(model, values, &ensemble);
 *     kempe_ensemble_run(ensemble, &run, 0, &batch);
 *     for (int i = 0; i < kempe_batch_count(batch); i++)
 *         show(kempe_batch_status(batch, i), kempe_batch_q(batch, i));
 */
#ifndef KEMPE_ENSEMBLE_H
#define KEMPE_ENSEMBLE_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A table: columns are parameters, and start values as `q.NAME` and `qd.NAME`; rows are instances. */
typedef struct kempe_values kempe_values;

/** From a CSV file: names, then a row an instance; lines that begin with # are passed over. The model outlives it.
 *  KEMPE_E_INPUT: every mistake found, as file:line:column sentences. */
KEMPE_API kempe_status kempe_values_read(const kempe_model *model, const char *path, kempe_values **values);

/** From memory: `columns` names, and `count` rows of as many values, which are copied. KEMPE_E_ARGUMENT: a name. */
KEMPE_API kempe_status kempe_values_new(const kempe_model *model, int columns, const char *const *names, int count,
                                        const double *rows, kempe_values **values);

/** `count` rows evenly at random from ranges "NAME=A:B,...", the same for the same seed. KEMPE_E_ARGUMENT: a range. */
KEMPE_API kempe_status kempe_values_sample(const kempe_model *model, const char *ranges, int count, int seed,
                                           kempe_values **values);
KEMPE_API void kempe_values_free(kempe_values *values);
KEMPE_API int kempe_values_count(const kempe_values *values);
KEMPE_API int kempe_values_column_count(const kempe_values *values);
KEMPE_API const char *kempe_values_name(const kempe_values *values, int column);
/** One row, column_count values, owned by the table. */
KEMPE_API const double *kempe_values_row(const kempe_values *values, int k);

typedef struct kempe_ensemble kempe_ensemble;

/** Derives the equations of a model with the columns of a table kept open. Both outlive it. KEMPE_E_INPUT: as
 *  kempe_system_new, and a closure that hangs on open parameters alone. */
KEMPE_API kempe_status kempe_ensemble_new(const kempe_model *model, const kempe_values *values,
                                          kempe_ensemble **ensemble);
KEMPE_API void kempe_ensemble_free(kempe_ensemble *ensemble);

typedef struct kempe_batch kempe_batch;

/** Runs every instance to t_end; of `run` the formulation, tolerances, t_end and max_steps count. `lanes`: instances at
 * a time, 0 as many as this machine does best, up to 8; -1: none, a run for each. The answers do not depend on it but
 *  for rounding, and not at all from 1 on. KEMPE_E_ARGUMENT: a name or number of the run. What becomes of an
 *  instance is in the batch; KEMPE_E_FAILED when none came to its end, with the batch; KEMPE_STOPPED after an
 *  interrupt. Unless the run's `once` is set, instances are run again at another tolerance, and a warning is logged
 *  where one has not converged. */
KEMPE_API kempe_status kempe_ensemble_run(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes,
                                          kempe_batch **batch);
KEMPE_API void kempe_batch_free(kempe_batch *batch);

/** How many instances; of the k-th "ok", "stopped" or "failed", and the sentence that goes with it ("" when ok). */
KEMPE_API int kempe_batch_count(const kempe_batch *batch);
KEMPE_API const char *kempe_batch_status(const kempe_batch *batch, int k);
KEMPE_API const char *kempe_batch_reason(const kempe_batch *batch, int k);

/** Where it came to: s; q and qd (n values), owned by the batch, NaN where there is no state. */
KEMPE_API double kempe_batch_t(const kempe_batch *batch, int k);
KEMPE_API const double *kempe_batch_q(const kempe_batch *batch, int k);
KEMPE_API const double *kempe_batch_qd(const kempe_batch *batch, int k);

/** Whether it comes out the same at another tolerance: "converged", "not converged", "the other run did not come to its
 *  end"; "" where it was not run again (the run's `once`, or a status that is not "ok"). */
KEMPE_API const char *kempe_batch_verdict(const kempe_batch *batch, int k);

/** How it came there, and how good its end is. */
typedef struct kempe_ensemble_stats {
    const char *alone; /* why by a run of its own; "": in a lane */
    long steps, rejected, refused, rhs, exchanges;
    double h, hdot; /* max |h| and |hdot|, scaled */
    double drift;   /* of the energy, in parts of its size */
} kempe_ensemble_stats;
KEMPE_API kempe_ensemble_stats kempe_batch_effort(const kempe_batch *batch, int k);

/** A summary; as JSON with every instance. */
KEMPE_API kempe_status kempe_batch_print(const kempe_batch *batch, kempe_format format, char **text);

/** Writes a row an instance as CSV, whole or not at all: the columns of the table, then status, t, q.NAME, qd.NAME,
 *  steps, rejected, refused, rhs, exchanges, h, hdot, drift, difference, verdict, alone, reason. */
KEMPE_API kempe_status kempe_batch_write_csv(const kempe_batch *batch, const char *path);

#ifdef __cplusplus
}
#endif
#endif
