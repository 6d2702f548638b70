/* SPDX-License-Identifier: BSD-3-Clause */
/* Parquet files: as they are, and as values of instances of a pendulum. An input that does not begin as such a file has
 * two bytes of the footer's length, then pages and footer, between which the marks and the length are put. */
#include "base/context.h"
#include "base/memory.h"
#include "ensemble/sampling/parquet_reader.h"
#include "fuzz.h"
#include <kempe/ensemble.h>
#include <math.h>

enum { MARK = 4, LENGTH = 4, MOST_CELLS = 1 << 20 };

static void check_file(const kmp_parquet_file *file)
{
    for (int c = 0; c < file->column_count; c++) {
        const kmp_parquet_column *column = &file->column[c];
        fuzz_promise(column->name && column->unit, "a column has a name and a unit");
        fuzz_promise(!column->number || !column->word, "a column has numbers or words");
        fuzz_promise(column->number || column->word || file->rows == 0, "a column has values");
        if ((int64_t)file->rows * file->column_count > MOST_CELLS)
            continue;
        double sum = 0;
        for (int k = 0; k < file->rows; k++)
            if (column->number)
                sum += column->number[k];
            else
                sum += (double)strlen(column->word[k]);
        (void)sum;
    }
    for (int k = 0; k < file->note_count; k++)
        fuzz_promise(file->note[k].key && file->note[k].value, "a note has a key and a value");
}

static void read_both(const uint8_t *data, size_t size)
{
    static kempe_context *context;
    static kempe_model *model;
    static const char text[] =
        "kempe: 1\nparameters: {l: 0.3, m: 1, ax: 0}\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
        "  a: {joint: {name: A, revolute: [ax, 0, 1], at: ground.O}, mass: m, com: [l, 0, 0], inertia: {zz: 1}}\n";
    if (!model) { /* made once; static data keeps it in reach of leak checkers */
        context = fuzz_context_new();
        fuzz_promise(kempe_model_read_text(context, text, "model", &model) == KEMPE_OK, "the model is read");
    }
    kmp_parquet_file file = {0};
    kempe_values *values = NULL;
    fuzz_files_set("values.parquet", data, size);
    kmp_context_clear(context);
    kempe_status status = kmp_parquet_read(context, "values.parquet", &file);
    fuzz_check_sentence(context, status);
    if (status == KEMPE_OK) {
        check_file(&file);
        status = kempe_values_read(model, "values.parquet", &values);
        fuzz_check_sentence(context, status);
        fuzz_promise((status == KEMPE_OK) == (values != NULL), "a table is given when it was read");
        for (int i = 0; values && i < kempe_values_count(values); i++)
            for (int k = 0; k < kempe_values_column_count(values); k++)
                fuzz_promise(isfinite(kempe_values_row(values, i)[k]), "values are finite");
        kempe_values_free(values);
    }
    kmp_parquet_file_free(&file);
    fuzz_files_clear();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 2 || data[0] == 'P') {
        read_both(data, size);
        return 0;
    }
    size_t inside = size - 2, length = ((size_t)data[0] | (size_t)data[1] << 8) % (inside + 1);
    uint8_t *whole = kmp_calloc(inside + 2 * MARK + LENGTH, 1), *end = whole + MARK + inside;
    fuzz_promise(whole, "there is memory");
    memcpy(whole, "PAR1", MARK);
    memcpy(whole + MARK, data + 2, inside);
    for (int k = 0; k < LENGTH; k++)
        end[k] = (uint8_t)(length >> (8 * k));
    memcpy(end + LENGTH, "PAR1", MARK);
    read_both(whole, inside + 2 * MARK + LENGTH);
    kmp_free(whole);
    return 0;
}
