/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of columns, one array each, and their writers: CSV, JSON, text, and arrays of binary formats. */
#include "output/result_table.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "output/named_arrays.h"
#include "output/parquet.h"
#include "output/print.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* One of the two arrays holds the cells. */
typedef struct table_column {
    char *name, *unit; /* unit NULL: words */
    double factor;     /* from SI to the unit */
    kmp_table_look look;
    double *number;
    char **word;
} table_column;

static char unknown_word[] = "";

struct kempe_table {
    kempe_context *context;
    kmp_arena arena; /* names and words */
    const char *name;
    char *system[1]; /* of its units; NULL: SI */
    kempe_outcome outcome;
    int columns, rows, row_room, next; /* next: cell of the last row */
    bool failed, units_named, apart;
    table_column *column;
};

/* -- construction ------------------------------------------------------------------------------------ */

kempe_table *kmp_tabulate(kempe_context *context, const char *name)
{
    kempe_table *t = KMP_NEW(kempe_table, 1);
    if (t) {
        t->context = context;
        t->name = kmp_arena_strdup(&t->arena, name);
        const char *system = kmp_context_system(context);
        t->system[0] = system ? kmp_arena_strdup(&t->arena, system) : NULL;
    }
    return t;
}

void kempe_table_free(kempe_table *table)
{
    if (!table)
        return;
    for (int c = 0; c < table->columns; c++) {
        kmp_free(table->column[c].number);
        kmp_free(table->column[c].word);
    }
    kmp_free(table->column);
    kmp_arena_free(&table->arena);
    kmp_free(table);
}

static bool is_usable(kempe_table *t)
{
    return t && !t->failed && !t->arena.failed;
}

void kmp_tabulate_column(kempe_table *table, const char *unit, const char *format, ...)
{
    if (!is_usable(table))
        return;
    table_column *column = kmp_list_room(table->column, (size_t)table->columns, sizeof *column);
    table->failed = !column;
    if (!column)
        return;
    table->column = column;
    kmp_text name = {0};
    KMP_TEXT_ARGUMENTS(&name, format);
    kmp_shown shown = unit ? kmp_shown_as(table->context, unit) : (kmp_shown){0};
    table->column[table->columns++] = (table_column){
        .name = kmp_arena_strdup(&table->arena, name.s ? name.s : ""),
        .unit = unit ? kmp_arena_strdup(&table->arena, shown.unit) : NULL,
        .factor = shown.factor,
    };
    table->failed = name.failed;
    kmp_text_free(&name);
}

void kmp_tabulate_columns(kempe_table *table, const char *columns)
{
    for (const char *s = columns, *end; *s; s = end + strspn(end, "] ")) {
        int length = (int)strcspn(s, " [");
        char unit[16] = "";
        end = s + length;
        if (*end == '[') {
            end += strcspn(end, "]");
            (void)snprintf(unit, sizeof unit, "%.*s", (int)(end - s) - length - 1, s + length + 1);
        }
        kmp_tabulate_column(table, strcmp(unit, "words") == 0 ? NULL : unit, "%.*s", length, s);
    }
}

void kmp_tabulate_look(kempe_table *table, kmp_table_look look)
{
    if (is_usable(table) && table->columns > 0)
        table->column[table->columns - 1].look = look;
}

void kmp_tabulate_apart(kempe_table *table)
{
    if (table)
        table->apart = true;
}

static bool grow(kempe_table *t)
{
    int room = 2 * t->row_room + 16;
    for (int c = 0; c < t->columns; c++) {
        table_column *column = &t->column[c];
        void *old = column->unit ? (void *)column->number : (void *)column->word;
        void *cells = kmp_realloc(old, (size_t)room, column->unit ? sizeof(double) : sizeof(char *));
        if (!cells)
            return false;
        column->number = column->unit ? cells : NULL;
        column->word = column->unit ? NULL : cells;
    }
    t->row_room = room;
    return true;
}

void kmp_tabulate_row(kempe_table *table)
{
    if (!is_usable(table))
        return;
    table->failed = table->rows == table->row_room && !grow(table);
    if (table->failed)
        return;
    for (int c = 0; c < table->columns; c++)
        if (table->column[c].number)
            table->column[c].number[table->rows] = NAN;
        else
            table->column[c].word[table->rows] = unknown_word;
    table->rows++;
    table->next = 0;
}

/* The column of the next cell; NULL: the table has failed, or the row is full. */
static table_column *next_cell(kempe_table *t)
{
    return is_usable(t) && t->next < t->columns ? &t->column[t->next++] : NULL;
}

void kmp_tabulate_number(kempe_table *table, double x)
{
    table_column *column = next_cell(table);
    if (column && column->number)
        column->number[table->rows - 1] = column->factor * x;
}

void kmp_tabulate_numbers(kempe_table *table, int count, const double *x)
{
    for (int k = 0; k < count; k++)
        kmp_tabulate_number(table, x[k]);
}

static void put_word(kempe_table *t, const char *word)
{
    table_column *column = next_cell(t);
    if (column && column->word)
        column->word[t->rows - 1] = kmp_arena_strdup(&t->arena, word);
}

void kmp_tabulate_cells(kempe_table *table, const char *format, ...)
{
    va_list cells;
    va_start(cells, format);
    for (const char *s = format; *s; s++)
        if (*s == 's')
            put_word(table, va_arg(cells, const char *));
        else if (*s == 'g')
            kmp_tabulate_number(table, va_arg(cells, double));
        else if (*s == 'd')
            kmp_tabulate_number(table, s[-1] == 'l' ? (double)va_arg(cells, long) : va_arg(cells, int));
    va_end(cells);
}

void kmp_tabulate_outcome(kempe_table *table, kempe_outcome outcome)
{
    if (table)
        table->outcome = outcome;
}

kempe_outcome kmp_table_outcome(const kempe_table *table)
{
    return table->outcome;
}

void kmp_tabulate_fail(kempe_table *table)
{
    if (table)
        table->failed = true;
}

kempe_status kmp_tabulate_finish(kempe_context *context, kempe_table *table, kempe_table **out)
{
    if (is_usable(table)) {
        *out = table;
        return KEMPE_OK;
    }
    kempe_table_free(table);
    return kmp_fail_memory(context);
}

kempe_status kmp_tabulate_check(kempe_context *context, const kempe_table *table)
{
    return kmp_made(context, table && !table->failed && !table->arena.failed);
}

kempe_status kmp_tabulate_result(kempe_context *context, const kmp_table_kind *kinds, const void *result,
                                 const char *name, kempe_table **table)
{
    KMP_WANTED(context, name, "name");
    KMP_WANTED(context, table, "table");
    const kmp_table_kind *kind = kinds;
    kmp_context_clear(context);
    while (kind->name && strcmp(kind->name, name) != 0)
        kind++;
    if (kind->name) {
        kempe_table *made = kmp_tabulate(context, name);
        kind->fill(made, result);
        return kmp_tabulate_finish(context, made, table);
    }
    kmp_text sentence = {0};
    kmp_text_printf(&sentence, "there is no table '%s'; the tables are ", name);
    for (kind = kinds; kind->name; kind++)
        kmp_text_printf(&sentence, "%s%s", kind == kinds ? "" : ", ", kind->name);
    return kmp_fail_text(context, KEMPE_E_ARGUMENT, &sentence);
}

double kmp_table_in_si(const kempe_table *table, int row, int column)
{
    return kempe_table_number(table, row, column) / table->column[column].factor;
}

double kmp_table_in_unit_of(const kempe_table *table, int column, const kempe_table *other, int row, int other_column)
{
    const char *shown = kempe_table_unit(table, column);
    kmp_unit unit = {.factor = 1, .divisor = 1};
    (void)kmp_unit_read(shown, strlen(shown), &unit);
    return kmp_table_in_si(other, row, other_column) * unit.divisor / unit.factor;
}

bool kmp_table_is_comparable(const kempe_table *table, int column, const kempe_table *other, int other_column)
{
    const char *own = kempe_table_unit(table, column), *others = kempe_table_unit(other, other_column);
    kmp_unit a, b;
    const bool known = kmp_unit_read(own, strlen(own), &a) && kmp_unit_read(others, strlen(others), &b);
    return !known || kmp_dimension_fits(a.dimension, b.dimension);
}

const char *kmp_table_system(const kempe_table *table)
{
    return table->system[0];
}

kempe_context *kmp_table_context(const kempe_table *table)
{
    return table->context;
}

/* -- reading ----------------------------------------------------------------------------------------- */

KMP_GETTER(const char *kempe_table_name(const kempe_table *table), table, table->name, "")
KMP_GETTER(int kempe_table_row_count(const kempe_table *table), table, table->rows, 0)
KMP_GETTER(int kempe_table_column_count(const kempe_table *table), table, table->columns, 0)
KMP_GETTER_AT(const char *kempe_table_column_name(const kempe_table *table, int column), table, column, table->columns,
              table->column[column].name, "")
KMP_GETTER_AT(const char *kempe_table_unit(const kempe_table *table, int column), table, column, table->columns,
              table->column[column].unit ? table->column[column].unit : "", "")
KMP_GETTER_AT(const double *kempe_table_values(const kempe_table *table, int column), table, column, table->columns,
              table->column[column].number, NULL)

kmp_table_look kmp_table_column_look(const kempe_table *table, int column)
{
    return table->column[column].look;
}

bool kmp_table_has_points(const kempe_table *table, int column)
{
    kmp_table_look look = table->column[column].look;
    return look == KMP_LOOK_POINTS || look == KMP_LOOK_RESIDUALS;
}

int kmp_table_curve_of(const kempe_table *table, int column)
{
    while (column >= 0 && kmp_table_has_points(table, column))
        column--;
    return column;
}

bool kmp_table_rows_apart(const kempe_table *table)
{
    return table->apart;
}

int kempe_table_find(const kempe_table *table, const char *name)
{
    KMP_GIVEN(table && name, -1);
    for (int c = 0; c < table->columns; c++)
        if (strcmp(table->column[c].name, name) == 0)
            return c;
    return -1;
}

double kempe_table_number(const kempe_table *table, int row, int column)
{
    const double *values = kempe_table_values(table, column);
    return values && row >= 0 && row < table->rows ? values[row] : NAN;
}

const char *kempe_table_word(const kempe_table *table, int row, int column)
{
    bool words = table && column >= 0 && column < table->columns && table->column[column].word;
    return words && row >= 0 && row < table->rows ? table->column[column].word[row] : "";
}

/* -- CSV --------------------------------------------------------------------------------------------- */

static bool has_units(const kempe_table *t)
{
    for (int c = 0; c < t->columns; c++)
        if (*kempe_table_unit(t, c))
            return true;
    return false;
}

/* RFC 4180: in quotes where a comma, a quote or a line break is inside. */
static void csv_word(kmp_text *text, const char *word)
{
    if (!strpbrk(word, ",\"\n")) {
        kmp_text_put(text, word);
        return;
    }
    kmp_text_put(text, "\"");
    for (const char *s = word; *s; s++)
        kmp_text_printf(text, "%s%c", *s == '"' ? "\"" : "", *s == '\n' ? ' ' : *s);
    kmp_text_put(text, "\"");
}

/* "q.crank [deg]" where units are wanted or the column is not in SI, else "q.crank". */
static void csv_name(kmp_text *text, const kempe_table *t, const table_column *c)
{
    kmp_text name = {0};
    kmp_text_put(&name, c->name);
    if (c->unit && *c->unit && (t->units_named || c->factor != 1 || strncmp(c->unit, "deg", 3) == 0))
        kmp_text_printf(&name, " [%s]", c->unit);
    csv_word(text, name.s ? name.s : "");
    kmp_text_free_part(text, &name);
}

void kmp_table_put_csv(kmp_text *text, const kempe_table *t, bool head)
{
    for (int c = 0; head && c < t->columns; c++) {
        kmp_text_put(text, c ? "," : "");
        csv_name(text, t, &t->column[c]);
    }
    kmp_text_put(text, head ? "\n" : "");
    for (int row = 0; row < t->rows; row++) {
        for (int c = 0; c < t->columns; c++) {
            kmp_text_put(text, c ? "," : "");
            if (t->column[c].word)
                csv_word(text, t->column[c].word[row]);
            else if (isfinite(t->column[c].number[row]))
                kmp_text_number(text, t->column[c].number[row]);
        }
        kmp_text_put(text, "\n");
    }
}

void kempe_table_name_units(kempe_table *table)
{
    if (table)
        table->units_named = true;
}

/* -- JSON and text ----------------------------------------------------------------------------------- */

static void put_json(kmp_text *text, const void *result)
{
    const kempe_table *t = result;
    kmp_json json = kmp_json_begin(text);
    kmp_json_put(&json, "{ name %s", t->name);
    if (t->system[0])
        kmp_json_put(&json, "system %s", t->system[0]);
    kmp_json_array(&json, "columns");
    for (int c = 0; c < t->columns; c++)
        kmp_json_string(&json, NULL, t->column[c].name);
    kmp_json_put(&json, "] units [");
    for (int c = 0; c < t->columns; c++)
        kmp_json_string(&json, NULL, kempe_table_unit(t, c));
    kmp_json_put(&json, "] data [");
    for (int row = 0; row < t->rows; row++) {
        kmp_json_array(&json, NULL);
        for (int c = 0; c < t->columns; c++)
            if (t->column[c].word)
                kmp_json_string(&json, NULL, t->column[c].word[row]);
            else
                kmp_json_number(&json, NULL, t->column[c].number[row]);
        kmp_json_end(&json);
    }
    kmp_json_put(&json, "] }");
}

enum { NUMBER_WIDTH = 13 };

static int width_of(const table_column *c, int rows)
{
    size_t width = strlen(c->name);
    for (int row = 0; c->word && row < rows; row++)
        width = strlen(c->word[row]) > width ? strlen(c->word[row]) : width;
    return c->number && width < NUMBER_WIDTH ? NUMBER_WIDTH : (int)width;
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_table *t = result;
    for (int row = has_units(t) ? -2 : -1; row < t->rows; row++) {
        for (int c = 0; c < t->columns; c++) {
            const table_column *column = &t->column[c];
            int width = width_of(column, t->rows);
            kmp_text_put(text, c ? "  " : "");
            if (row < 0)
                kmp_text_printf(text, "%*s", column->number ? width : -width,
                                (row == -1) == has_units(t) ? kempe_table_unit(t, c) : column->name);
            else if (column->word)
                kmp_text_printf(text, "%-*s", width, column->word[row]);
            else if (column->number && isfinite(column->number[row]))
                kmp_text_printf(text, "%*.6g", width, column->number[row]);
            else
                kmp_text_printf(text, "%*s", width, "-");
        }
        kmp_text_put(text, "\n");
    }
}

kempe_status kempe_table_print(const kempe_table *table, kempe_format format, char **text)
{
    KMP_WANTED(NULL, table, "table");
    return kmp_print_result(table->context, format, format == KEMPE_JSON ? put_json : put_text, table, text);
}

bool kmp_table_has_words(const kempe_table *table, int column)
{
    return !table->column[column].unit;
}

/* -- files ------------------------------------------------------------------------------------------- */

/* Arrays of the columns of numbers, and one of each column of words; `name`, `unit`: room for the texts of all columns,
 * `values` for all numbers. */
static void list_arrays(kmp_arrays *arrays, const kempe_table *t, char **name, char **unit, double *values)
{
    size_t rows = (size_t)t->rows;
    int count = 0;
    for (int c = 0; c < t->columns; c++)
        if (t->column[c].unit) {
            if (rows > 0)
                memcpy(values + rows * (size_t)count, t->column[c].number, rows * sizeof *values);
            name[count] = t->column[c].name;
            unit[count++] = t->column[c].unit;
        }
    kmp_arrays_words(arrays, "names", count, name);
    kmp_arrays_words(arrays, "units", count, unit);
    if (t->system[0])
        kmp_arrays_words(arrays, "system", 1, t->system);
    kmp_arrays_matrix(arrays, "values", t->rows, count, values);
    for (int c = 0; c < t->columns; c++)
        if (!t->column[c].unit)
            kmp_arrays_words(arrays, t->column[c].name, t->rows, t->column[c].word);
}

static kempe_status write_arrays(const kempe_table *t, const char *path)
{
    kmp_arrays arrays = {0};
    char **name = KMP_NEW(char *, t->columns), **unit = KMP_NEW(char *, t->columns);
    double *values = KMP_NEW(double, (size_t)t->columns *(size_t)t->rows + 1);
    arrays.failed = !name || !unit || !values;
    if (!arrays.failed)
        list_arrays(&arrays, t, name, unit, values);
    kempe_status status = kmp_arrays_write(t->context, &arrays, path);
    kmp_free(name);
    kmp_free(unit);
    kmp_free(values);
    return status;
}

kempe_status kempe_table_write(const kempe_table *table, const char *path)
{
    KMP_WANTED_BOTH(table, path);
    kmp_context_clear(table->context);
    const char *ending = kmp_file_ending(path);
    kmp_text text = {0};
    if (kmp_arrays_ending(ending))
        return write_arrays(table, path);
    if (!*ending || strcmp(ending, ".csv") == 0)
        kmp_table_put_csv(&text, table, true);
    else if (strcmp(ending, ".json") == 0)
        put_json(&text, table);
    else if (strcmp(ending, ".parquet") == 0)
        kmp_parquet_put(&text, table, 0, NULL);
    else
        return kmp_fail(table->context, KEMPE_E_ARGUMENT,
                        "%s: a table is written as .csv, .json, .parquet, .npz or .mat", path);
    return kmp_file_write(table->context, path, &text);
}
