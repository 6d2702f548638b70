/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of values: from memory, from samples, and from files. */
#include "ensemble/sampling/values.h"
#include "analyses/parts/ranges.h"
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "ensemble/sampling/model_instances.h"
#include "ensemble/sampling/parquet_reader.h"
#include "ensemble/sampling/sampling.h"
#include "model/data/model_context.h"
#include "model/files/csv_reader.h"
#include "model/language/dimension.h"
#include <kempe/ensemble.h>
#include <limits.h>
#include <math.h>
#include <string.h>

const char *kmp_value_name(const char *column)
{
    const size_t size = sizeof KMP_VALUE_PREFIX - 1;
    return strncmp(column, KMP_VALUE_PREFIX, size) == 0 ? column + size : column;
}

/* An empty table with a copy of the names. NULL: no memory. */
static kempe_values *values_new(int columns, const char *const *names)
{
    kempe_values *values = KMP_NEW(kempe_values, 1);
    if (!values)
        return NULL;
    values->columns = columns;
    values->name = KMP_ARENA_NEW(&values->arena, char *, columns);
    for (int k = 0; values->name && k < columns; k++)
        values->name[k] = kmp_arena_strdup(&values->arena, names[k]);
    if (!values->arena.failed)
        return values;
    kempe_values_free(values);
    return NULL;
}

/* A row more, to be filled. NULL: no memory. */
static double *add_row(kempe_values *values)
{
    size_t row = (size_t)values->columns * sizeof *values->rows;
    double *rows = values->count < INT_MAX ? kmp_list_room(values->rows, (size_t)values->count, row) : NULL;
    if (!rows)
        return NULL;
    values->rows = rows;
    return values->rows + (size_t)values->count++ * (size_t)values->columns;
}

KMP_FREES(kempe_values, values, kmp_sampling_free(values->sampling), kmp_arena_free(&values->arena),
          kmp_free(values->rows))

void kmp_values_get(const kempe_values *values, int first, int count, double *rows)
{
    size_t columns = (size_t)values->columns;
    for (int k = 0; values->sampling && k < count; k++)
        kmp_sampling_row(values->sampling, first + k, rows + (size_t)k * columns);
    if (!values->sampling && count > 0 && columns > 0)
        memcpy(rows, values->rows + (size_t)first * columns, (size_t)count * columns * sizeof *rows);
}

static const double *row_of(const kempe_values *values, int k)
{
    if (!values->sampling)
        return values->rows + (size_t)k * (size_t)values->columns;
    kmp_values_get(values, k, 1, values->drawn);
    return values->drawn;
}

KMP_GETTER(int kempe_values_count(const kempe_values *values), values, values->count, 0)
KMP_GETTER(int kempe_values_column_count(const kempe_values *values), values, values->columns, 0)
KMP_GETTER_AT(const char *kempe_values_name(const kempe_values *values, int column), values, column, values->columns,
              values->name[column], "")
KMP_GETTER_AT(const double *kempe_values_row(const kempe_values *values, int k), values, k, values->count,
              row_of(values, k), NULL)

/* Reports names that the model does not have, or that occur twice. */
static kempe_status check_names(const kempe_model *model, int columns, const char *const *names)
{
    kempe_status status = kmp_model_check_finished(model);
    for (int k = 0; status == KEMPE_OK && k < columns; k++) {
        kmp_text why = {0};
        KMP_WANTED(kmp_model_context(model), names && names[k], "a column name");
        bool may = kmp_instance_may(model, names[k], &why);
        for (int i = 0; may && i < k; i++)
            if (strcmp(names[i], names[k]) == 0) {
                kmp_text_printf(&why, "'%s' is given twice", names[k]);
                may = false;
            }
        if (!may)
            status = kmp_fail_text(kmp_model_context(model), KEMPE_E_ARGUMENT, &why);
    }
    return status;
}

kempe_status kempe_values_new(const kempe_model *model, int columns, const char *const *names, int count,
                              const double *rows, kempe_values **values)
{
    KMP_WANTED(NULL, model, "model");
    kempe_context *context = kmp_model_context(model);
    KMP_WANTED(context, values, "values");
    kmp_context_clear(context);
    if (columns < 0 || count < 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "a table cannot have a negative number of columns or rows");
    KMP_TRY(check_names(model, columns, names));
    KMP_WANTED(context, rows || columns == 0 || count == 0, "rows");
    kempe_values *made = values_new(columns, names);
    if (made)
        made->rows = KMP_NEW(double, (size_t)count *(size_t)columns + 1);
    if (!made || !made->rows) {
        kempe_values_free(made);
        return kmp_fail_memory(context);
    }
    if (columns > 0 && count > 0)
        memcpy(made->rows, rows, (size_t)count * (size_t)columns * sizeof *rows);
    made->count = count;
    *values = made;
    return KEMPE_OK;
}

/* -- samples ----------------------------------------------------------------------------------------- */

/* A table of the samples, without rows. It owns the sampling from then on, also after a failure. */
static kempe_status wrap(const kempe_model *model, kmp_sampling *sampling, const kempe_sample_options *options,
                         kempe_values **values)
{
    kempe_values *made = values_new(sampling->columns, sampling->name);
    if (!made) {
        kmp_sampling_free(sampling);
        return kmp_fail_memory(kmp_model_context(model));
    }
    made->sampling = sampling;
    made->count = sampling->count;
    made->drawn = KMP_ARENA_NEW(&made->arena, double, made->columns);
    made->ranges = kmp_arena_strdup(&made->arena, options->ranges);
    made->correlations = kmp_arena_strdup(&made->arena, options->correlations ? options->correlations : "");
    made->design = kmp_arena_strdup(&made->arena, options->design ? options->design : "random");
    made->seed = options->seed ? options->seed : 1;
    kempe_status status = kmp_made(kmp_model_context(model), !made->arena.failed);
    return KMP_GIVE_OR_FREE(status, values, made, kempe_values_free);
}

kempe_status kempe_values_sample(const kempe_model *model, const kempe_sample_options *options, kempe_values **values)
{
    KMP_WANTED(NULL, model, "model");
    kempe_context *context = kmp_model_context(model);
    KMP_WANTED(context, values, "values");
    KMP_OPTIONS(context, kempe_sample_options, options);
    KMP_WANTED(context, options->ranges, "ranges");
    kmp_sampling *sampling = NULL;
    kmp_context_clear(context);
    KMP_TRY(kmp_model_check_finished(model));
    KMP_TRY(kmp_sampling_new(model, options, &sampling));
    kempe_status status = check_names(model, sampling->columns, sampling->name);
    if (status == KEMPE_OK)
        return wrap(model, sampling, options, values);
    kmp_sampling_free(sampling);
    return status;
}

/* -- from files --------------------------------------------------------------------------------------- */

/* CSV: a header of names, then a row an instance; Parquet: a column for each name. */
typedef struct reader {
    const kempe_model *model;
    kempe_values *values;
    kmp_dimension *dimension; /* of the units of the columns */
} reader;

static bool check_name(kmp_csv *csv, const char *at, const char *name)
{
    const reader *r = csv->user;
    kmp_text why = {0};
    if (!*name)
        kmp_text_put(&why, "a name is expected here: a parameter, or q.NAME or qd.NAME of a coordinate");
    else
        (void)kmp_instance_may(r->model, name, &why);
    bool ok = !why.failed;
    if (ok && why.length)
        kmp_csv_complain(csv, at, "%s", why.s);
    kmp_text_free(&why);
    return ok;
}

static bool begin_dimensions(reader *r)
{
    return (r->dimension = KMP_ARENA_NEW(&r->values->arena, kmp_dimension, r->values->columns)) != NULL;
}

/* The units must fit; an angle without one may be meant in degrees. */
static kempe_status check_units(const reader *r, const char *path)
{
    const kempe_values *v = r->values;
    kempe_status status = KEMPE_OK;
    for (int c = 0; c < v->columns && status == KEMPE_OK; c++) {
        kmp_range range = {
            .name = v->name[c], .from = INFINITY, .to = -INFINITY, .dimension = r->dimension[c], .column = true};
        if (range.dimension.kind == KMP_DIMENSION_FREE)
            range.dimension.kind = KMP_DIMENSION_BARE;
        for (int row = 0; row < v->count; row++) {
            range.from = fmin(range.from, v->rows[(ptrdiff_t)row * v->columns + c]);
            range.to = fmax(range.to, v->rows[(ptrdiff_t)row * v->columns + c]);
        }
        status = kmp_range_fits_variable(r->model, path, &range);
    }
    return status == KEMPE_E_ARGUMENT ? KEMPE_E_INPUT : status;
}

static bool read_header(kmp_csv *csv, const char *line)
{
    reader *r = csv->user;
    kmp_arena arena = {0};
    char **names = KMP_ARENA_NEW(&arena, char *, csv->columns);
    bool ok = names;
    int k = 0;
    for (const char *s = line; ok && s; k++) {
        kmp_csv_field f = kmp_csv_name(&s);
        names[k] = KMP_ARENA_NEW(&arena, char, f.length + 1);
        ok = names[k];
        if (ok)
            ok = check_name(csv, f.s, memcpy(names[k], f.s, f.length));
    }
    if (ok)
        ok = (r->values = values_new(csv->columns, (const char *const *)names)) && begin_dimensions(r);
    for (int c = 0; ok && c < csv->columns; c++)
        r->dimension[c] = csv->unit[c].dimension;
    kmp_arena_free(&arena);
    return ok;
}

static bool read_row(kmp_csv *csv, const char *line)
{
    reader *r = csv->user;
    double *row = add_row(r->values);
    const char *s = line;
    for (int k = 0; row && s && k < r->values->columns; k++) {
        kmp_csv_field f = kmp_csv_next(&s);
        if (!kmp_csv_number(csv, k, f, &row[k]))
            kmp_csv_complain(csv, f.s, "a finite number is expected here");
    }
    kmp_csv_check_row(csv, line);
    return row;
}

/* -- Parquet ----------------------------------------------------------------------------------------- */

/* False: there is no such unit. "SI": of a parameter that has none in its file. */
static bool read_unit(const kmp_parquet_column *column, kmp_unit *unit)
{
    *unit = (kmp_unit){1, 1, KMP_DIM_ANY, 0};
    return !*column->unit || strcmp(column->unit, "SI") == 0 || kmp_unit_read(column->unit, strlen(column->unit), unit);
}

static kempe_status check_columns(const kempe_model *model, const char *path, const kmp_parquet_file *file)
{
    kempe_status status = KEMPE_OK;
    kempe_context *context = kmp_model_context(model);
    if (file->rows == 0 || file->column_count == 0)
        status = kmp_complain(context, path, 0, 0, "the table has no rows or no columns");
    for (int c = 0; c < file->column_count; c++) {
        const kmp_parquet_column *column = &file->column[c];
        kmp_text why = {0};
        if (!column->number)
            kmp_text_printf(&why, "column '%s' has words; values are numbers", column->name);
        else
            (void)kmp_instance_may(model, column->name, &why);
        for (int i = 0; i < c && !why.length; i++)
            if (strcmp(file->column[i].name, column->name) == 0)
                kmp_text_printf(&why, "column '%s' is given twice", column->name);
        kmp_unit unit;
        if (!why.length && !read_unit(column, &unit))
            kmp_text_printf(&why, "column '%s' has the unknown unit '%s'", column->name, column->unit);
        for (int row = 0; column->number && row < file->rows && !why.length; row++)
            if (!isfinite(column->number[row]))
                kmp_text_printf(&why, "column '%s', row %d: a finite number is expected", column->name, row + 1);
        if (why.length)
            status = kmp_complain(context, path, 0, 0, "%s", why.s);
        if (why.failed)
            status = kmp_fail_memory(context);
        kmp_text_free(&why);
    }
    return status;
}

static kempe_status take_columns(reader *r, const kmp_parquet_file *file)
{
    kmp_arena arena = {0};
    const char **names = KMP_ARENA_NEW(&arena, const char *, file->column_count);
    for (int c = 0; names && c < file->column_count; c++)
        names[c] = file->column[c].name;
    bool ok = names && (r->values = values_new(file->column_count, names)) && begin_dimensions(r);
    for (int row = 0; ok && row < file->rows; row++) {
        double *numbers = add_row(r->values);
        ok = numbers;
        for (int c = 0; ok && c < file->column_count; c++) {
            const kmp_parquet_column *column = &file->column[c];
            kmp_unit unit;
            (void)read_unit(column, &unit);
            r->dimension[c] = unit.dimension;
            numbers[c] = column->number[row] * unit.factor / unit.divisor;
        }
    }
    kmp_arena_free(&arena);
    return kmp_made(kmp_model_context(r->model), ok);
}

static kempe_status read_parquet(reader *r, const char *path)
{
    kmp_parquet_file file = {0};
    KMP_TRY(kmp_parquet_read(kmp_model_context(r->model), path, &file));
    kempe_status status = check_columns(r->model, path, &file);
    if (status == KEMPE_OK)
        status = take_columns(r, &file);
    kmp_parquet_file_free(&file);
    return status;
}

/* -- CSV --------------------------------------------------------------------------------------------- */

static const kmp_csv_form form = {"the header line with names of parameters is missing",
                                  "no rows follow the header line", read_header, read_row, false};

kempe_status kempe_values_read(const kempe_model *model, const char *path, kempe_values **values)
{
    KMP_WANTED(NULL, model, "model");
    kempe_context *context = kmp_model_context(model);
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, values, "values");
    reader r = {.model = model};
    kmp_context_clear(context);
    KMP_TRY(kmp_model_check_finished(model));
    bool is_parquet = strcmp(kmp_file_ending(path), ".parquet") == 0;
    kempe_status status = is_parquet ? read_parquet(&r, path) : kmp_csv_read(context, path, &form, &r);
    if (status == KEMPE_OK && r.values->count == 0)
        status = kmp_complain(context, path, 0, 0, "the file has no rows");
    if (status == KEMPE_OK)
        status = check_units(&r, path);
    if (status == KEMPE_OK)
        status = kmp_made(context, (r.values->file = kmp_arena_strdup(&r.values->arena, path)) != NULL);
    return KMP_GIVE_OR_FREE(status, values, r.values, kempe_values_free);
}
