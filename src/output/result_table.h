/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables under construction. Running out of memory is sticky: every call after it does nothing, kmp_tabulate_finish
 * reports it. Columns come first, then rows:
 *
 *     kempe_table *t = kmp_tabulate(context, "rows");
 *     kmp_tabulate_columns(t, "t[s] kind[words]");
 *     kmp_tabulate_column(t, unit, "q.%s", name);
 *     kmp_tabulate_row(t);
 *     kmp_tabulate_cells(t, "%g %s %g", time, kind, q);
 *     return kmp_tabulate_finish(context, t, table);
 */
#pragma once

#include "base/context.h"
#include "base/json.h"
#include "output/samples.h"
#include <kempe/table.h>

/** An empty table; NULL: no memory, which the other functions accept. */
kempe_table *kmp_tabulate(kempe_context *context, const char *name);

/** A column more. A unit of NULL: words. The cells of a column are given in SI; in a column of angles, rates or
 * accelerations in rad the table converts them to the unit that the context shows. */
void kmp_tabulate_column(kempe_table *table, const char *unit, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/** Columns more: names with blanks between, each with its unit behind it in brackets, [words] for a column of words. */
void kmp_tabulate_columns(kempe_table *table, const char *columns);

/** The style in which pictures draw the column added last; periodic: a turn is 360. Points belong to the curve of the
 * last column before them that has none of these looks: they are drawn with it, residuals in a separate plot. */
typedef enum kmp_table_look {
    KMP_LOOK_PLAIN,
    KMP_LOOK_LOGARITHMIC,
    KMP_LOOK_PERIODIC,
    KMP_LOOK_POINTS,
    KMP_LOOK_RESIDUALS
} kmp_table_look;
void kmp_tabulate_look(kempe_table *table, kmp_table_look look);
kmp_table_look kmp_table_column_look(const kempe_table *table, int column);

/** True for a column of points, also of residuals; the column whose curve they belong to, -1: none. */
bool kmp_table_has_points(const kempe_table *table, int column);
int kmp_table_curve_of(const kempe_table *table, int column);

/** True for a column of words, even without rows. */
bool kmp_table_has_words(const kempe_table *table, int column);

/** Rows are apart from each other, so that pictures draw points, not curves. */
void kmp_tabulate_apart(kempe_table *table);
bool kmp_table_rows_apart(const kempe_table *table);

/** A row more, whose cells are unknown. */
void kmp_tabulate_row(kempe_table *table);

/** Fills the next cells of the last row by a template: %g, %d and %ld are numbers, %s words. A number that is not
 * finite is unknown. */
void kmp_tabulate_cells(kempe_table *table, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** A row more with its first cells: KMP_TABULATE(table, "%g %s", x, name). */
#define KMP_TABULATE(table, ...) (kmp_tabulate_row(table), kmp_tabulate_cells((table), __VA_ARGS__))
void kmp_tabulate_number(kempe_table *table, double x);
void kmp_tabulate_numbers(kempe_table *table, int count, const double *x);

/** The table cannot be completed, because memory is exhausted. */
void kmp_tabulate_fail(kempe_table *table);

/** The outcome of the result, if it is given: a note of Parquet files. */
void kmp_tabulate_outcome(kempe_table *table, kempe_outcome outcome);
kempe_outcome kmp_table_outcome(const kempe_table *table);

/** A number of a table in SI, whatever the unit of its column. */
double kmp_table_in_si(const kempe_table *table, int row, int column);

/** A number of another table in the unit of a column. */
double kmp_table_in_unit_of(const kempe_table *table, int column, const kempe_table *other, int row, int other_column);

/** False for columns of two tables in units of different dimensions. */
bool kmp_table_is_comparable(const kempe_table *table, int column, const kempe_table *other, int other_column);

/** The system of units in which it was made, "mm" or "us"; NULL: SI. */
const char *kmp_table_system(const kempe_table *table);

/** Gives the table to the caller, or frees it with KEMPE_E_MEMORY. */
kempe_status kmp_tabulate_finish(kempe_context *context, kempe_table *table, kempe_table **out);

kempe_context *kmp_table_context(const kempe_table *table);

/** A table of a result: its name, and what makes its columns and rows. */
typedef struct kmp_table_kind {
    const char *name;
    void (*fill)(kempe_table *table, const void *result);
} kmp_table_kind;

/** The table of a name, out of `kinds` up to one without a name. KEMPE_E_ARGUMENT: there is none of that name. */
kempe_status kmp_tabulate_result(kempe_context *context, const kmp_table_kind *kinds, const void *result,
                                 const char *name, kempe_table **table);

/** The public function TYPE_table of a result, with its kinds of tables: {"rows", fill_rows}, .. */
#define KMP_TABLES(type, result, context, ...)                                                                         \
    kempe_status type##_table(const type *result, const char *name, kempe_table **table)                               \
    {                                                                                                                  \
        static const kmp_table_kind kinds[] = {__VA_ARGS__, {0}};                                                      \
        KMP_WANTED(NULL, result, #result);                                                                             \
        return kmp_tabulate_result((context), kinds, result, name, table);                                             \
    }

/** Appends the rows of a table as CSV, with the line of names or without. */
void kmp_table_put_csv(kmp_text *text, const kempe_table *table, bool head);

/** KEMPE_E_MEMORY if a table under construction has failed. */
kempe_status kmp_tabulate_check(kempe_context *context, const kempe_table *table);
