/* SPDX-License-Identifier: BSD-3-Clause */
/* Reference values of a four-bar. */
#include "base/context.h"
#include "fuzz.h"
#include "output/reference.h"
#include <kempe/kempe.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static kempe_context *context;
    static kempe_model *model;
    static kempe_system *system;
    kmp_reference reference;
    if (!system) { /* made once; static data keeps it in reach of leak checkers */
        context = fuzz_context_new();
        system = fuzz_four_bar(context, &model);
    }
    fuzz_files_set("reference.csv", data, size);
    kmp_context_clear(context);
    kempe_status status = kmp_reference_read(system, "reference.csv", &reference);
    fuzz_check_status(context, status);
    if (status == KEMPE_OK) {
        for (int k = 0; k < reference.rows; k++)
            fuzz_promise(reference.t[k] >= 0 && (k == 0 || reference.t[k] > reference.t[k - 1]), "times ascend");
        kmp_samples_free(&reference);
    }
    fuzz_files_clear();
    return 0;
}
