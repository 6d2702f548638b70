/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of values from files: CSV, a header of names, then a row an instance; Parquet, a column for each name. */
#include "base/file.h"
#include "model/expressions/dimension.h"
#include "model/model_instances.h"
#include "output/csv_reader.h"
#include "output/formats/parquet_reader.h"
#include "studies/ensemble/sampling/values.h"
#include <kempe/ensemble.h>
#include <math.h>
#include <string.h>

typedef struct reader {
    const kempe_model *model;
    kempe_values *values;
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
        ok = (r->values = kmp_values_new(csv->columns, (const char *const *)names));
    kmp_arena_free(&arena);
    return ok;
}

static bool read_row(kmp_csv *csv, const char *line)
{
    reader *r = csv->user;
    double *row = kmp_values_add(r->values);
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

static kempe_status check_columns(const kempe_model *model, const char *path, const kmp_parquet_file *file)
{
    kempe_status status = KEMPE_OK;
    if (file->rows == 0 || file->column_count == 0)
        status = kmp_complain(model->context, path, 0, 0, "the table has no rows or no columns");
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
        if (!why.length && *column->unit && !kmp_unit_read(column->unit, strlen(column->unit), &unit))
            kmp_text_printf(&why, "column '%s' has the unknown unit '%s'", column->name, column->unit);
        for (int row = 0; column->number && row < file->rows && !why.length; row++)
            if (!isfinite(column->number[row]))
                kmp_text_printf(&why, "column '%s', row %d: a finite number is expected", column->name, row + 1);
        if (why.length)
            status = kmp_complain(model->context, path, 0, 0, "%s", why.s);
        if (why.failed)
            status = kmp_fail_memory(model->context);
        kmp_text_free(&why);
    }
    return status;
}

static kempe_status take_columns(const kempe_model *model, const kmp_parquet_file *file, kempe_values **values)
{
    kmp_arena arena = {0};
    const char **names = KMP_ARENA_NEW(&arena, const char *, file->column_count);
    for (int c = 0; names && c < file->column_count; c++)
        names[c] = file->column[c].name;
    bool ok = names && (*values = kmp_values_new(file->column_count, names));
    for (int row = 0; ok && row < file->rows; row++) {
        double *numbers = kmp_values_add(*values);
        ok = numbers;
        for (int c = 0; ok && c < file->column_count; c++) {
            const kmp_parquet_column *column = &file->column[c];
            kmp_unit unit = {.factor = 1, .divisor = 1};
            if (*column->unit)
                (void)kmp_unit_read(column->unit, strlen(column->unit), &unit);
            numbers[c] = column->number[row] * unit.factor / unit.divisor;
        }
    }
    kmp_arena_free(&arena);
    return kmp_made(model->context, ok);
}

static kempe_status read_parquet(const kempe_model *model, const char *path, kempe_values **values)
{
    kmp_parquet_file file = {0};
    KMP_TRY(kmp_parquet_read(model->context, path, &file));
    kempe_status status = check_columns(model, path, &file);
    if (status == KEMPE_OK)
        status = take_columns(model, &file, values);
    kmp_parquet_file_free(&file);
    return status;
}

/* -- CSV --------------------------------------------------------------------------------------------- */

kempe_status kempe_values_read(const kempe_model *model, const char *path, kempe_values **values)
{
    KMP_WANTED_BOTH(model, path);
    KMP_WANTED(model->context, values, "values");
    reader r = {.model = model};
    kmp_csv csv = {.context = model->context,
                   .path = path,
                   .lacks_header = "the header line with names of parameters is missing",
                   .user = &r,
                   .header = read_header,
                   .row = read_row};
    kmp_context_clear(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    bool is_parquet = strcmp(kmp_file_ending(path), ".parquet") == 0;
    kempe_status status = is_parquet ? read_parquet(model, path, &r.values) : kmp_csv_read(&csv);
    if (status == KEMPE_OK && r.values->count == 0) {
        kmp_csv_complain(&csv, csv.line_text, "there are no rows below the header line");
        status = KEMPE_E_INPUT;
    }
    if (status == KEMPE_OK)
        status = kmp_made(model->context, (r.values->file = kmp_arena_strdup(&r.values->arena, path)) != NULL);
    return KMP_GIVE_OR_FREE(status, values, r.values, kempe_values_free);
}
