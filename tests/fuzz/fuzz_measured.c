/* SPDX-License-Identifier: BSD-3-Clause */
/* Measured motions of a pendulum, and results of a search as the start of another one: the same text as both. */
#include "base/context.h"
#include "ensemble/fit/bounded.h"
#include "ensemble/fit/measured.h"
#include "fuzz.h"
#include <math.h>

static void read_motions(const kempe_context *context, const kempe_model *model)
{
    kmp_measured measured;
    kempe_status status = kmp_measured_begin(model, "input.csv", NULL, &measured);
    fuzz_check_sentence(context, status);
    for (int k = 0; status == KEMPE_OK && k < measured.rows; k++)
        fuzz_promise(measured.t[k] >= 0 && (k == 0 || measured.t[k] > measured.t[k - 1]), "times ascend");
    if (status == KEMPE_OK)
        kmp_measured_free(&measured);
}

static void read_start(kempe_context *context)
{
    static char length[] = "l", mass[] = "m";
    char *names[] = {length, mass};
    double start[2] = {0}, low[] = {-INFINITY, -INFINITY}, high[] = {INFINITY, INFINITY};
    const kmp_box_bounds bounded = {2, names, low, high};
    kempe_status status = kmp_box_bounds_read_start(context, "input.csv", &bounded, start);
    fuzz_check_sentence(context, status);
    if (status == KEMPE_OK)
        fuzz_promise(isfinite(start[0]) && isfinite(start[1]), "values are finite");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static kempe_context *context;
    static kempe_model *model;
    static const char text[] =
        "kempe: 1\nparameters: {l: 0.3, m: 1}\nbodies:\n"
        "  a: {joint: {name: A, revolute: z, at: ground}, mass: m, com: [l, 0, 0], points: {P: [l, 0, 0]}}\n";
    if (!model) { /* made once; static data keeps it in reach of leak checkers */
        context = fuzz_context_new();
        fuzz_check_status(context, kempe_model_read_text(context, text, "model", &model));
        fuzz_promise(model, "the model is read");
    }
    fuzz_files_set("input.csv", data, size);
    kmp_context_clear(context);
    read_motions(context, model);
    kmp_context_clear(context);
    read_start(context);
    fuzz_files_clear();
    return 0;
}
