/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as CSV: a comment with the units, the names, the rows. */
#include "base/memory.h"
#include "studies/simulate/columns.h"
#include <math.h>

static void write_line(kmp_text *text, const char *before, char *const *word, int count)
{
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%s", k ? "," : before, word[k]);
    kmp_text_put(text, "\n");
}

static void write_row(kmp_text *text, const double *values, int count)
{
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k ? "," : "");
        if (isfinite(values[k]))
            kmp_text_number(text, values[k]);
    }
    kmp_text_put(text, "\n");
}

static void write_all(kmp_text *text, const kempe_trajectory *trajectory, const kmp_columns *columns,
                      kmp_evaluator *eval, double *values)
{
    write_line(text, "# units: ", columns->unit, columns->count);
    write_line(text, "", columns->name, columns->count);
    for (int row = 0; row < trajectory->table.rows; row++) {
        kmp_columns_fill(trajectory, columns, eval, row, values);
        write_row(text, values, columns->count);
    }
}

kempe_status kempe_trajectory_write_csv(const kempe_trajectory *trajectory, const char *path)
{
    KMP_WANTED(NULL, trajectory, "trajectory");
    KMP_WANTED(trajectory->system->context, path, "path");
    const kempe_system *system = trajectory->system;
    kmp_context_clear(system->context);
    kmp_evaluator *eval = kmp_eval_new(system, trajectory->backend);
    if (!eval)
        return KEMPE_E_MEMORY;
    kmp_text text = {0};
    kmp_columns columns;
    bool ok = kmp_columns_init(&columns, system);
    double *values = ok ? KMP_NEW(double, columns.count) : NULL;
    if (values)
        write_all(&text, trajectory, &columns, eval, values);
    ok = ok && values && !text.failed;
    kempe_status status = ok ? kempe_write_file(system->context, path, text.s) : kmp_fail_memory(system->context);
    kmp_columns_free(&columns);
    kmp_eval_free(eval);
    kmp_text_free(&text);
    kmp_free(values);
    return status;
}
