/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Many instances of one mechanism with different parameters. The equations are derived once, with the varied parameters
 * kept symbolic. Instances run in parallel in the lanes of a vector register, each with its own steps and error
 * control.
 *
 *     kempe_values *values;
 *     kempe_ensemble *ensemble;
 *     kempe_ensemble_result *batch;
 *     kempe_values_read(model, "cranks.csv", &values);
 *     kempe_ensemble_new(model, values, &ensemble);
 *     kempe_ensemble_run(ensemble, &run, 0, &batch);
 *     for (int i = 0; i < kempe_ensemble_result_count(batch); i++)
 *         show(kempe_ensemble_result_outcome(batch, i), kempe_ensemble_result_q(batch, i));
 */
#ifndef KEMPE_ENSEMBLE_H
#define KEMPE_ENSEMBLE_H

#include <kempe/table.h>

KEMPE_BEGIN

/** A table: columns are parameters, and start values as `q.NAME` and `qd.NAME`; rows are instances. */
typedef struct kempe_values kempe_values;

/** Reads a CSV file: a row of names, then a row for each instance; lines that begin with # are skipped. Or a Parquet
 * file
 * (.parquet) of numbers without empty cells, plain and uncompressed, as kempe_table_write makes it. The model must
 * outlive the table. KEMPE_E_INPUT: every error, as file:line:column sentences. */
KEMPE_API kempe_status kempe_values_read(const kempe_model *model, const char *path, kempe_values **values);

/** Copies a table from memory: `columns` names, and `count` rows of `columns` values. KEMPE_E_ARGUMENT: a name is
 * wrong. */
KEMPE_API kempe_status kempe_values_new(const kempe_model *model, int columns, const char *const *names, int count,
                                        const double *rows, kempe_values **values);

/** Samples of distributions. */
typedef struct kempe_sample_options {
    size_t size; /* sizeof(kempe_sample_options) */
    /* Separated by commas: NAME=A:B (uniform), NAME=normal(MEAN, DEVIATION), NAME=normal(MEAN, DEVIATION, LEAST, MOST)
     * (truncated), NAME=triangular(LEAST, MODE, MOST), NAME=IT7 (a tolerance grade of ISO 286 about the model's value:
     * normal, six standard deviations wide, truncated), NAME=IT7(uniform), NAME=A:B:N (N values of a grid). */
    const char *ranges;
    const char *correlations; /* NAME:NAME=R,...: of normal scores (Gaussian copula), -1 < R < 1; NULL: none */
    const char *design;       /* random (default) | latin (hypercube) | sobol (sequence) | grid (full factorial) |
                               * saltelli (for Sobol's indices) */
    int count;                /* number of rows, 0: 1000; a grid has its own; saltelli: up to the next of columns + 2 */
    int seed;                 /* 0: 1; unused by sobol and grid */
} kempe_sample_options;

/** Rows of samples, drawn when they are needed: a table of any length takes no memory. Row k depends only on the
 * options and k. The model must outlive the table. KEMPE_E_ARGUMENT: an option is wrong. */
KEMPE_API kempe_status kempe_values_sample(const kempe_model *model, const kempe_sample_options *options,
                                           kempe_values **values);
KEMPE_API void kempe_values_free(kempe_values *values);
KEMPE_API int kempe_values_count(const kempe_values *values);
KEMPE_API int kempe_values_column_count(const kempe_values *values);
KEMPE_API const char *kempe_values_name(const kempe_values *values, int column);
/** The k-th row, column_count values, owned by the table. A row of samples stays until the next call. */
KEMPE_API const double *kempe_values_row(const kempe_values *values, int k);

typedef struct kempe_ensemble kempe_ensemble;

/** Derives the equations of a model with the columns of a table kept symbolic. Model and table must outlive the
 * ensemble. KEMPE_E_INPUT: as kempe_system_new, or a closure that depends only on symbolic parameters. */
KEMPE_API kempe_status kempe_ensemble_new(const kempe_model *model, const kempe_values *values,
                                          kempe_ensemble **ensemble);

/** Quantities of each instance, and limits on them (docs/ensemble.md). */
typedef struct kempe_ensemble_options {
    size_t size; /* sizeof(kempe_ensemble_options) */
    /* Separated by commas, each [NAME =] and: EXPRESSION (its value at the end), at(EXPRESSION, TIME),
     * max(EXPRESSION), min(..), range(..), mean(..), rms(..), integral(..), or, with a comparison A < B, first(A < B)
     * (time), count(A < B), duration(A < B). Expressions are as in sensors, or outputs such as energy.total. */
    const char *quantities;
    const char *limits; /* separated by commas: QUANTITY < VALUE, or <=, >, >=; the name of one, or one as above */
} kempe_ensemble_options;

/** The same with quantities. KEMPE_E_INPUT: a quantity or a limit is wrong; the message has its column. */
KEMPE_API kempe_status kempe_ensemble_new_with(const kempe_model *model, const kempe_values *values,
                                               const kempe_ensemble_options *options, kempe_ensemble **ensemble);
KEMPE_API void kempe_ensemble_free(kempe_ensemble *ensemble);

typedef struct kempe_ensemble_result kempe_ensemble_result;

/** Runs every instance to t_end. `threads` of the run share the instances, 0: one for each processor; results have the
 * same bits. `lanes` is the number of instances at a time: 0 the best for this machine, up to 16; -1 a separate run for
 * each. Results depend on `lanes` only by rounding, and from 1 on not at all. KEMPE_E_ARGUMENT: a name or number of the
 * run is wrong, or an option is of rows, references or checkpoints. The result of each instance is in the batch.
 * KEMPE_E_FAILED: no instance reached its end; the batch is given. KEMPE_STOPPED: an interrupt. Unless
 * no_convergence_check is set, instances are repeated at another tolerance, and a warning is logged if one has not
 * converged. */
KEMPE_API kempe_status kempe_ensemble_run(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes,
                                          kempe_ensemble_result **batch);

/** Runs `count` instances from number `first` (from 0) on. Their results are the same as in a run of all. */
KEMPE_API kempe_status kempe_ensemble_run_range(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes,
                                                int first, int count, kempe_ensemble_result **batch);

/** Runs `count` instances with other values, without another derivation: `rows` has `count` rows of the columns of
 * the ensemble's table, which may be empty. They are copied. Results are as for a table with these rows.
 */
KEMPE_API kempe_status kempe_ensemble_run_rows(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes,
                                               int count, const double *rows, kempe_ensemble_result **batch);
KEMPE_API void kempe_ensemble_result_free(kempe_ensemble_result *batch);

/** The number of instances; the outcome of the k-th, and its reason as a sentence ("" when complete). */
KEMPE_API int kempe_ensemble_result_count(const kempe_ensemble_result *batch);
KEMPE_API kempe_outcome kempe_ensemble_result_outcome(const kempe_ensemble_result *batch, int k);
KEMPE_API const char *kempe_ensemble_result_reason(const kempe_ensemble_result *batch, int k);

/** The final state: q and qd (n values), owned by the batch, NaN if there is no state. */
KEMPE_API const double *kempe_ensemble_result_q(const kempe_ensemble_result *batch, int k);
KEMPE_API const double *kempe_ensemble_result_qd(const kempe_ensemble_result *batch, int k);

/** The number of values of the quantities; name and SI unit of one; its value for the k-th instance, NaN without one.
 * An extreme has two values, the second one is its time, NAME.time. */
KEMPE_API int kempe_ensemble_result_quantity_count(const kempe_ensemble_result *batch);
KEMPE_API const char *kempe_ensemble_result_quantity_name(const kempe_ensemble_result *batch, int value);
KEMPE_API const char *kempe_ensemble_result_quantity_unit(const kempe_ensemble_result *batch, int value);
KEMPE_API double kempe_ensemble_result_quantity(const kempe_ensemble_result *batch, int k, int value);

/** "pass" or "fail" by the limits; "" without limits, or where a limited quantity is not known. */
KEMPE_API const char *kempe_ensemble_result_limits(const kempe_ensemble_result *batch, int k);

/** Prints a summary; as JSON with every instance. */
KEMPE_API kempe_status kempe_ensemble_result_print(const kempe_ensemble_result *batch, kempe_format format,
                                                   char **text);

/** The table "instances", a row for each: the columns of the values; status, t, q.NAME, qd.NAME of the final state; the
 * quantities. Names of columns are unique: a value is `value.NAME` if a result has its name, as start values. With
 * limits it has `limits` ("pass", "fail" or "") and `broken`, the limits that are not kept. Then there are steps,
 * rejected, refused, rhs, exchanges; its accuracy: h and hdot (max |h| and |hdot|, scaled), drift (of the energy,
 * relative). The convergence check has difference, for each quantity NAME.difference, and verdict ("converged", "not
 * converged", "the other run did not reach its end", "" without a repeat run). Last are start ("velocities adjusted"
 * where the start values did not satisfy the closures), single_run (why it ran by itself, "": in a lane) and reason.
 * KEMPE_E_ARGUMENT: another name. */
KEMPE_API kempe_status kempe_ensemble_result_table(const kempe_ensemble_result *batch, const char *name,
                                                   kempe_table **table);

typedef struct kempe_statistics kempe_statistics;

/** Statistics of a table "instances", with intervals of a confidence (0: 0.95). The inputs are the columns before
 * `status`; the quantities are the columns between the final state and `steps`, or without any the final coordinates
 * and rates. Instances that did not reach their end are left out. Intervals are for independent samples: of the design
 * saltelli they come from its first two rows in each group. The table may be freed. KEMPE_E_ARGUMENT: it is another
 * table, or the confidence is not between 0 and 1. */
KEMPE_API kempe_status kempe_statistics_new(const kempe_table *instances, double confidence,
                                            kempe_statistics **statistics);
KEMPE_API void kempe_statistics_free(kempe_statistics *statistics);
KEMPE_API kempe_status kempe_statistics_print(const kempe_statistics *statistics, kempe_format format, char **text);

/** "moments": for each quantity its count, mean and standard deviation with their intervals. "quantiles": for each
 * quantity and part the value, with an interval by order statistics, which holds for any distribution. "within": the
 * number of instances within the limits, the yield, and its interval by Clopper and Pearson. "contributions": for each
 * quantity and input the standardised regression coefficient, and the part of the variance that regression explains. Of
 * the design saltelli it has Sobol's indices, first order and total, with their standard errors. "extremes": the least
 * and the largest value with their instances, from 1, and the settings that repeat them in a run. */
KEMPE_API kempe_status kempe_statistics_table(const kempe_statistics *statistics, const char *name,
                                              kempe_table **table);

/** Writes a self-contained HTML page: columns of "instances" over the first varied value. With quantities it has a
 * histogram of each, with bars of what its scatter comes from. KEMPE_E_IO: the path cannot be written. */
KEMPE_API kempe_status kempe_ensemble_result_write_report(const kempe_ensemble_result *batch, const char *path);

/* -- result folders --------------------------------------------------------------------------------- */

/* An ensemble of any size runs into a folder, chunk after chunk, with the memory of one chunk. The folder has a file
 * for each chunk, part-000000.parquet .., with the rows of the table "instances" in SI, and manifest.json, with the
 * options of the run and hashes of the model, the equations and the values. A part has its name only when it is whole
 * and on the disk: whatever ends the process, whole parts stay. The bytes of the parts depend neither on threads nor on
 * the processes that make them. */

/** Time histories of chosen instances, "3,10:12", from 1 on: a table "history" with the column instance and the
 * columns of the table "rows" of a trajectory, instance after instance, with the model's or the run's output_step. Each
 * is a separate run, with the settings of the ensemble. An instance that fails has the rows up to there.
 * KEMPE_E_ARGUMENT: other words, or there is no such instance. */
KEMPE_API kempe_status kempe_ensemble_history(kempe_ensemble *ensemble, const kempe_run_options *run,
                                              const char *instances, kempe_table **table);

typedef struct kempe_folder kempe_folder;

typedef struct kempe_folder_options {
    size_t size; /* sizeof(kempe_folder_options) */
    int chunk;   /* instances of a part; 0: as in the folder, or 256 to 4096 such that there are 64 parts or more */
    int resume;  /* 1: the folder may have parts of this run already; missing instances are run */
    /* Several processes, also on several hosts, run every N-th part from the I-th on: "I/N", 1 <= I <= N. "auto" takes
     * I and N from Slurm, Open MPI or PMI; the jobs of GNU parallel take the next free parts. NULL: all parts that no
     * other process has taken. */
    const char *shard;
    const char *history; /* instances whose histories are written too: kempe_ensemble_history; NULL: none */
} kempe_folder_options;

/** Runs the instances of an ensemble into a folder, which is made where it is missing. Processes with `resume` or a
 * `shard` share one folder. An interrupt returns KEMPE_STOPPED, the folder has all whole parts. KEMPE_E_INPUT: the
 * folder has results without `resume` or `shard`, or results of another model, of other values, options, or another
 * version; the message says which. KEMPE_E_IO: a part cannot be written (a full disk); those before it stay.
 * KEMPE_E_FAILED: no instance reached its end; the folder is given. */
KEMPE_API kempe_status kempe_ensemble_run_folder(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes,
                                                 const char *path, const kempe_folder_options *options,
                                                 kempe_folder **folder);

/** Opens a folder that has results. KEMPE_E_INPUT: it has no manifest, or a damaged one. */
KEMPE_API kempe_status kempe_folder_open(kempe_context *context, const char *path, kempe_folder **folder);
KEMPE_API void kempe_folder_free(kempe_folder *folder);

/** The number of instances; of parts; of parts that were whole when the folder was opened, or when its run ended. */
KEMPE_API int kempe_folder_instance_count(const kempe_folder *folder);
KEMPE_API int kempe_folder_part_count(const kempe_folder *folder);
KEMPE_API int kempe_folder_whole_count(const kempe_folder *folder);

/** Reads all parts that are there, and checks their sums, their numbers and the hash of their run. KEMPE_E_FAILED:
 * parts are missing or damaged; the message says which, and how to make them. */
KEMPE_API kempe_status kempe_folder_check(kempe_folder *folder);

/** The rows of a part (from 0 on), a table "instances". KEMPE_E_INPUT: it is damaged. KEMPE_E_IO: it is missing. */
KEMPE_API kempe_status kempe_folder_part(const kempe_folder *folder, int part, kempe_table **table);

/** Checks all parts as kempe_folder_check, and writes one table, whole or not at all: the formats are as in
 * kempe_table_write. Files .csv and .parquet take the memory of some parts, others of all. `units` 1: columns of
 * .csv are named with their units. */
KEMPE_API kempe_status kempe_folder_write(kempe_folder *folder, const char *path, int units);

/** The same for the histories of the folder (kempe_ensemble_history). KEMPE_E_ARGUMENT: it has none. */
KEMPE_API kempe_status kempe_folder_write_history(kempe_folder *folder, const char *path, int units);

/** Checks all parts likewise, and writes the page that kempe_ensemble_result_write_report writes of a run in one piece.
 * `model` belongs to the run; it has the memory of all rows. KEMPE_E_INPUT: it is another model. KEMPE_E_FAILED: parts
 * are missing or damaged. KEMPE_E_IO: as kempe_ensemble_result_write_report. */
KEMPE_API kempe_status kempe_folder_write_report(kempe_folder *folder, const kempe_model *model, const char *path);

/** The model with the values of an instance (from 0 on), which its part has; freed before `model`, which must be the
 * model of the folder. KEMPE_E_INPUT: it is another one. KEMPE_E_FAILED: the part is missing, or the model cannot have
 * these values. */
KEMPE_API kempe_status kempe_folder_model(const kempe_folder *folder, const kempe_model *model, int instance,
                                          kempe_model **made);

/** Options of the run of the folder: formulation, integrator, independent coordinates, tolerances, end, bound on steps,
 * convergence check, time between rows of histories (0: as in the model). The texts belong to the folder. */
KEMPE_API void kempe_folder_run_options(const kempe_folder *folder, kempe_run_options *run);

/** The file of the model, as the run had it; owned by the folder. */
KEMPE_API const char *kempe_folder_model_file(const kempe_folder *folder);

/** Prints the state of the folder, and work and accuracy of the run that gave it. After a check of a complete folder
 * with quantities also their statistics, with the commands that repeat the extreme instances. */
KEMPE_API kempe_status kempe_folder_print(const kempe_folder *folder, kempe_format format, char **text);

KEMPE_END
#endif
