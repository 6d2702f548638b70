/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as NumPy reads it: one array a column group, and the names and units as text. */
#include "base/memory.h"
#include "output/npz.h"
#include "studies/simulate/columns.h"

static void add_rows(kmp_npz *npz, const kempe_trajectory *trajectory, const kmp_columns *columns, kmp_evaluator *eval)
{
    int rows = trajectory->table.rows;
    double *row = KMP_NEW(double, columns->count);
    kmp_npy *a = row ? kmp_npz_values(npz, "values", rows, columns->count) : NULL;
    npz->failed = !a;
    for (int r = 0; a && r < rows; r++) {
        kmp_columns_fill(trajectory, columns, eval, r, row);
        for (int k = 0; k < columns->count; k++)
            kmp_npy_put(a, (size_t)r * (size_t)columns->count + (size_t)k, row[k]);
    }
    kmp_free(row);
}

kempe_status kempe_trajectory_write_npz(const kempe_trajectory *trajectory, const char *path)
{
    KMP_WANTED(NULL, trajectory, "trajectory");
    KMP_WANTED(trajectory->system->context, path, "path");
    const kempe_system *system = trajectory->system;
    kmp_context_clear(system->context);
    kmp_evaluator *eval = kmp_eval_new(system, trajectory->backend);
    if (!eval)
        return KEMPE_E_MEMORY;
    kmp_columns columns;
    kmp_npz npz = {0};
    npz.failed = !kmp_columns_init(&columns, system);
    kmp_npz_words(&npz, "names", columns.count, columns.name);
    kmp_npz_words(&npz, "units", columns.count, columns.unit);
    if (!npz.failed)
        add_rows(&npz, trajectory, &columns, eval);
    kempe_status status = kmp_npz_write(system->context, &npz, path);
    kmp_npz_free(&npz);
    kmp_columns_free(&columns);
    kmp_eval_free(eval);
    return status;
}
