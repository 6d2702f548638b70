/* SPDX-License-Identifier: BSD-3-Clause */
/* Values of instances of a four-bar. */
#include "base/context.h"
#include "ensemble/sampling/values.h"
#include "fuzz.h"
#include <kempe/ensemble.h>
#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static kempe_context *context;
    static kempe_model *model;
    kempe_values *values = NULL;
    static const char text[] =
        "kempe: 1\nparameters: {l: 0.3, m: 1, ax: 0}\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
        "  a: {joint: {name: A, revolute: [ax, 0, 1], at: ground.O}, mass: m, com: [l, 0, 0], inertia: {zz: 1}}\n";
    if (!model) { /* made once; static data keeps it in reach of leak checkers */
        context = fuzz_context_new();
        fuzz_promise(kempe_model_read_text(context, text, "model", &model) == KEMPE_OK, "the model is read");
    }
    fuzz_files_set("values.csv", data, size);
    kempe_status status = kempe_values_read(model, "values.csv", &values);
    fuzz_check_status(context, status);
    if (status == KEMPE_OK)
        for (int i = 0; i < kempe_values_count(values); i++)
            for (int k = 0; k < kempe_values_column_count(values); k++)
                fuzz_promise(isfinite(kempe_values_row(values, i)[k]), "values are finite");
    fuzz_promise((status == KEMPE_OK) == (values != NULL), "a table is given when it was read");
    kempe_values_free(values);
    fuzz_files_clear();
    return 0;
}
