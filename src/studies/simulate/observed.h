/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs of a mechanism, whether or not its model requests them, at states that are known already: one program with a
 * value for each column. */
#pragma once

#include "backend/machine.h"
#include "constraints/evaluation/present_inputs.h"
#include "dynamics/equations.h"
#include "model/data/variant.h"
#include "studies/simulate/trajectory.h"
#include <kempe/output_handles.h>

/** The source of a column's value: number `index` of a quantity, or (KMP_QUANTITIES) of the outputs in addition to the
 * table. It is component `part` of output `output`. */
typedef struct kmp_column {
    kmp_quantity quantity;
    int index, output, component;
} kmp_column;

typedef struct kmp_columns {
    int count;
    char **name;
    const char **unit; /* SI, "" where a sensor has none */
    kmp_column *of;    /* of the first, which is time: output -1 */
    kmp_arena arena;
} kmp_columns;

/** Columns of the outputs of a model with the coordinates and rows of a system: its own or a copy with other outputs.
 * `parts`: by output, a bit for each requested component; NULL: all. false: no memory. */
bool kmp_columns_init(kmp_columns *columns, const kempe_system *system, const kempe_model *model,
                      const unsigned *parts);
void kmp_columns_free(kmp_columns *columns);

/** The values (count) of a row; NaN where there is none. */
void kmp_columns_fill(const kmp_samples *table, const kmp_columns *columns, kmp_evaluator *eval, int row,
                      double *values);

typedef struct kmp_output_program {
    const kempe_system *system;
    kmp_variant *variant; /* a copy of the model with these outputs */
    kmp_columns columns;
    kmp_program *program;
    kmp_machine *machine;
    kmp_present_inputs inputs;
    kmp_arena arena;
    double *zero; /* n + m */
    bool late;    /* a value depends on accelerations or multipliers */
    int left_out; /* outputs of the model that are not observed */
} kmp_output_program;

/** Further stages: their counts and outputs, from the columns without time and their values. */
typedef struct kmp_output_program_stages {
    void *user;
    void (*make)(void *user, const kmp_equations *eq, int count, const kmp_ref *value, int *counts,
                 const kmp_ref **groups);
} kmp_output_program_stages;

/** `words`: as `outputs` in the file, each with a component if only one is requested; NULL: outputs of the model, then
 * all others of up to `most` columns. `more`: NULL for none. KEMPE_E_ARGUMENT: a wrong word. */
kempe_status kmp_output_program_init(kmp_output_program *observed, const kempe_system *system, const char *words,
                                     int most, const kmp_output_program_stages *more);
void kmp_output_program_free(kmp_output_program *observed);

/** The values at a state (NULL: zero) with its inputs, without time. */
void kmp_output_program_at(kmp_output_program *observed, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda, double *values);

/** All columns (columns.count) at a row of samples. */
void kmp_output_program_fill(kmp_output_program *observed, const kmp_samples *samples, int row, double *values);

/** True if a value depends on accelerations or multipliers. */
bool kmp_outputs_are_late(const kempe_outputs *outputs);

/** Values at a row (q, qd, qdd, lambda) with the inputs of a run there. */
void kmp_outputs_with_inputs(kempe_outputs *outputs, const kmp_present_inputs *inputs, double t, const double *row,
                             double *values);
