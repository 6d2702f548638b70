/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of values: from memory, and at random. */
#include "studies/ensemble/values.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/expressions/ranges.h"
#include "model/variant.h"
#include <limits.h>
#include <stdint.h>
#include <string.h>

kempe_values *kmp_values_new(int columns, const char *const *names)
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

double *kmp_values_add(kempe_values *values)
{
    size_t row = (size_t)values->columns * sizeof *values->rows;
    double *rows = values->count < INT_MAX ? kmp_list_room(values->rows, (size_t)values->count, row) : NULL;
    if (!rows)
        return NULL;
    values->rows = rows;
    return values->rows + (size_t)values->count++ * (size_t)values->columns;
}

void kempe_values_free(kempe_values *values)
{
    if (!values)
        return;
    kmp_arena_free(&values->arena);
    kmp_free(values->rows);
    kmp_free(values);
}

KMP_GETTER(int kempe_values_count(const kempe_values *values), values, values->count, 0)
KMP_GETTER(int kempe_values_column_count(const kempe_values *values), values, values->columns, 0)
KMP_GETTER_AT(const char *kempe_values_name(const kempe_values *values, int column), values, column, values->columns,
              values->name[column], "")
KMP_GETTER_AT(const double *kempe_values_row(const kempe_values *values, int k), values, k, values->count,
              values->rows + (size_t)k * (size_t)values->columns, NULL)

/* Reports names that the model does not have, or that occur twice. */
static kempe_status check_names(const kempe_model *model, int columns, const char *const *names)
{
    kempe_status status = kmp_model_check_finished(model);
    for (int k = 0; status == KEMPE_OK && k < columns; k++) {
        kmp_text why = {0};
        KMP_WANTED(model->context, names && names[k], "a column name");
        bool may = kmp_variant_may(model, names[k], &why);
        for (int i = 0; may && i < k; i++)
            if (strcmp(names[i], names[k]) == 0) {
                kmp_text_printf(&why, "'%s' is given twice", names[k]);
                may = false;
            }
        if (!may)
            status = kmp_fail_text(model->context, KEMPE_E_ARGUMENT, &why);
    }
    return status;
}

kempe_status kempe_values_new(const kempe_model *model, int columns, const char *const *names, int count,
                              const double *rows, kempe_values **values)
{
    KMP_WANTED_BOTH(model, values);
    kmp_context_clear(model->context);
    if (columns < 0 || count < 0)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "a table cannot have a negative number of columns or rows");
    KMP_TRY(check_names(model, columns, names));
    KMP_WANTED(model->context, rows || columns == 0 || count == 0, "rows");
    kempe_values *made = kmp_values_new(columns, names);
    if (made)
        made->rows = KMP_NEW(double, (size_t)count *(size_t)columns + 1);
    if (!made || !made->rows) {
        kempe_values_free(made);
        return kmp_fail_memory(model->context);
    }
    if (columns > 0 && count > 0)
        memcpy(made->rows, rows, (size_t)count * (size_t)columns * sizeof *rows);
    made->count = count;
    *values = made;
    return KEMPE_OK;
}

/* -- at random --------------------------------------------------------------------------------------- */

/* Knuth's MMIX generator. */
static double chance(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

static kempe_status draw(const kempe_model *model, const kmp_ranges *ranges, int count, int seed, kempe_values **values)
{
    int columns = ranges->count;
    const char **names = KMP_NEW(const char *, columns);
    uint64_t state = (uint64_t)seed * 2862933555777941757u + 3037000493u;
    kempe_status status = names ? KEMPE_OK : kmp_fail_memory(model->context);
    for (int k = 0; names && k < columns; k++)
        names[k] = ranges->range[k].name;
    kempe_values *made = NULL;
    if (status == KEMPE_OK)
        status = kempe_values_new(model, columns, names, 0, NULL, &made);
    for (int i = 0; made && i < count; i++) {
        double *row = kmp_values_add(made);
        for (int k = 0; row && k < columns; k++)
            row[k] = ranges->range[k].from + (ranges->range[k].to - ranges->range[k].from) * chance(&state);
        if (!row) {
            kempe_values_free(made);
            made = NULL;
            status = kmp_fail_memory(model->context);
        }
    }
    kmp_free(names);
    if (made)
        *values = made;
    return status;
}

kempe_status kempe_values_sample(const kempe_model *model, const char *text, int count, int seed, kempe_values **values)
{
    KMP_WANTED(NULL, model, "model");
    KMP_WANTED(model->context, text, "ranges");
    KMP_WANTED(model->context, values, "values");
    kmp_ranges ranges;
    kmp_context_clear(model->context);
    if (count < 1)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "the number of instances must be at least one");
    kempe_status status = kmp_ranges_read(model->context, text, &ranges);
    if (status != KEMPE_OK)
        return status;
    for (int k = 0; k < ranges.count && status == KEMPE_OK; k++)
        if (ranges.range[k].count != 0)
            status = kmp_fail(model->context, KEMPE_E_ARGUMENT,
                              "sampling '%s' needs a range NAME=A:B; separate several ranges by commas",
                              ranges.range[k].name);
    kempe_values *made = NULL;
    if (status == KEMPE_OK)
        status = draw(model, &ranges, count, seed, &made);
    if (status == KEMPE_OK)
        *values = made;
    kmp_ranges_free(&ranges);
    return status;
}
