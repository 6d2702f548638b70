/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of numbers from CSV files. */
#include "model/files/csv_reader.h"
#include "model/language/dimension.h"
#include "output/result_table.h"
#include <kempe/table.h>
#include <math.h>
#include <string.h>

static bool take_header(kmp_csv *csv, const char *line)
{
    int column = 0;
    for (const char *s = line; s; column++) {
        const kmp_csv_field name = kmp_csv_name(&s);
        kmp_text unit = {0};
        if (csv->unit[column].dimension.kind == KMP_DIMENSION_KNOWN)
            kmp_dimension_put_unit(&unit, csv->unit[column].dimension);
        kmp_tabulate_column(csv->user, unit.s ? unit.s : "", "%.*s", (int)name.length, name.s);
        const bool good = !unit.failed;
        kmp_text_free(&unit);
        if (!good)
            return false;
        if (name.length == 0)
            kmp_csv_complain(csv, name.s, "column %d has no name", column + 1);
    }
    return true;
}

static bool take_row(kmp_csv *csv, const char *line)
{
    kmp_csv_check_row(csv, line);
    kmp_tabulate_row(csv->user);
    int column = 0;
    for (const char *s = line; s && column < csv->columns; column++) {
        const kmp_csv_field f = kmp_csv_next(&s);
        double x = NAN;
        if (f.length > 0 && !kmp_csv_number(csv, column, f, &x))
            kmp_csv_complain(csv, f.s, "this is not a number; write a number, or leave the field empty");
        kmp_tabulate_number(csv->user, x);
    }
    for (; column < csv->columns; column++)
        kmp_tabulate_number(csv->user, NAN);
    return true;
}

static const kmp_csv_form form = {"the header line is missing; it has the names of the columns", NULL, take_header,
                                  take_row, false};

kempe_status kempe_table_read(kempe_context *context, const char *path, kempe_table **table)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, table, "table");
    *table = NULL;
    KMP_WANTED(context, path, "path");
    kempe_table *made = kmp_tabulate(context, path);
    KMP_TRY(kmp_made(context, made));
    const kempe_status status = kmp_csv_read(context, path, &form, made);
    if (status == KEMPE_OK)
        return kmp_tabulate_finish(context, made, table);
    kempe_table_free(made);
    return status;
}
