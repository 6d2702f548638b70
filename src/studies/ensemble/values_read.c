/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of values from CSV files: a header of names, then a row an instance. */
#include "model/variant.h"
#include "output/csv_reader.h"
#include "studies/ensemble/values.h"
#include <kempe/ensemble.h>
#include <string.h>

typedef struct reader {
    const kempe_model *model;
    kempe_values *values;
} reader;

static bool check_name(kmp_csv *csv, const char *at, const char *name, int column, char *const *names)
{
    const reader *r = csv->user;
    kmp_text why = {0};
    if (!*name)
        kmp_text_put(&why, "a name is expected here: a parameter, or q.NAME or qd.NAME of a coordinate");
    else
        (void)kmp_variant_may(r->model, name, &why);
    for (int k = 0; !why.length && k < column; k++)
        if (strcmp(names[k], name) == 0)
            kmp_text_put(&why, "duplicate column");
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
            ok = check_name(csv, f.s, memcpy(names[k], f.s, f.length), k, names);
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
    kempe_status status = kmp_csv_read(&csv);
    if (status == KEMPE_OK && r.values->count == 0) {
        kmp_csv_complain(&csv, csv.line_text, "there are no rows below the header line");
        status = KEMPE_E_INPUT;
    }
    if (status == KEMPE_OK)
        status = kmp_made(model->context, (r.values->file = kmp_arena_strdup(&r.values->arena, path)) != NULL);
    return KMP_GIVE_OR_FREE(status, values, r.values, kempe_values_free);
}
