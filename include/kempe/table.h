/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Results as tables: columns with a name and a unit, rows of numbers or words. Every study gives its results so, each
 * table by a name that the study's header lists:
 *
 *     kempe_trajectory *trajectory = NULL;
 *     kempe_table *table = NULL;
 *     if (kempe_simulate(system, NULL, &trajectory) == KEMPE_OK &&
 *         kempe_trajectory_table(trajectory, "rows", &table) == KEMPE_OK) {
 *         int crank = kempe_table_find(table, "q.crank");
 *         for (int row = 0; row < kempe_table_row_count(table); row++)
 *             printf("%g\n", kempe_table_number(table, row, crank));
 *         kempe_table_write(table, "motion.csv");
 *     }
 *     kempe_table_free(table);
 *     kempe_trajectory_free(trajectory);
 */
#ifndef KEMPE_TABLE_H
#define KEMPE_TABLE_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** A table (kempe.h) is a copy: it stays when the result that gave it is freed. The context must outlive it. */
KEMPE_API void kempe_table_free(kempe_table *table);

KEMPE_API const char *kempe_table_name(const kempe_table *table);
KEMPE_API int kempe_table_row_count(const kempe_table *table);
KEMPE_API int kempe_table_column_count(const kempe_table *table);

/** Name and unit of a column; the unit is "" for a pure number and for words. Owned by the table. */
KEMPE_API const char *kempe_table_column_name(const kempe_table *table, int column);
KEMPE_API const char *kempe_table_unit(const kempe_table *table, int column);

/** The first column of a name as in the CSV file, "q.crank" or "position.coupler.P.x"; -1: there is none. */
KEMPE_API int kempe_table_find(const kempe_table *table, const char *name);

/** One cell: NaN where it is a word or unknown; "" where it is a number. Owned by the table. */
KEMPE_API double kempe_table_number(const kempe_table *table, int row, int column);
KEMPE_API const char *kempe_table_word(const kempe_table *table, int row, int column);

/** All rows of a column of numbers, owned by the table; NULL for a column of words. */
KEMPE_API const double *kempe_table_values(const kempe_table *table, int column);

/** Aligned columns as text, or JSON: {"name", "columns": [..], "units": [..], "data": [[row], ..]}. Free the text with
 * kempe_text_free. */
KEMPE_API kempe_status kempe_table_print(const kempe_table *table, kempe_format format, char **text);

/** Writes a file, whole or not at all, in the format of its ending: .csv or none, .json, .parquet, .npz for NumPy, .mat
 * for MATLAB and Octave. In .csv empty cells are unknown, .json is as above. In .parquet unknown numbers are NaN, and
 * the metadata have a key `unit.NAME` for each unit. The last two have arrays `names`, `units` and `values`, rows x
 * columns, of the columns of numbers, and an array of text for each column of words. KEMPE_E_ARGUMENT: another ending.
 */
KEMPE_API kempe_status kempe_table_write(const kempe_table *table, const char *path);

/** Reads a CSV file: a header with the names of the columns, then rows of numbers; empty fields are unknown (NaN). A
 * unit follows its name, "q.crank [deg]"; without one a column is in SI. The name of the table is the path.
 * KEMPE_E_INPUT: errors as file:line:column. KEMPE_E_IO: the file cannot be read. */
KEMPE_API kempe_status kempe_table_read(kempe_context *context, const char *path, kempe_table **table);

/** Columns of a CSV file of this table are named with their units: "q.crank [rad]". Without this call only those
 * columns are that are not in SI: "q.crank [deg]". */
KEMPE_API void kempe_table_name_units(kempe_table *table);

/** Draws columns: a plot for each unit, curves, or points where rows are apart from each other (an ensemble). Ending
 * .png: a bitmap by librsvg, KEMPE_E_FAILED where it is not installed; else SVG. `x`: the column of the horizontal axis
 * (NULL: the first one of numbers). `y`: names of the others, with commas between (NULL: all); an output with several
 * components means all of them. Names are names of columns, "position.coupler.C.x", or of outputs,
 * "position(coupler.C).x". KEMPE_E_ARGUMENT: there is no such column. KEMPE_E_FAILED: there are no rows. */
KEMPE_API kempe_status kempe_table_write_picture(const kempe_table *table, const char *x, const char *y,
                                                 const char *path);

/** The same picture with dashed curves of an earlier table behind the curves of this one: of its columns with the names
 * of drawn columns, over its column with the name of the horizontal axis. KEMPE_E_INPUT: it has no such columns, or one
 * in a unit of another dimension. */
KEMPE_API kempe_status kempe_table_write_picture_against(const kempe_table *table, const kempe_table *earlier,
                                                         const char *x, const char *y, const char *path);

KEMPE_END
#endif
