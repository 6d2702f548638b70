/* SPDX-License-Identifier: BSD-3-Clause */
/* The values of an ensemble's instances (kempe/ensemble.h). */
#pragma once

#include "base/arena.h"
#include "model/data/model.h"
#include <kempe/ensemble.h>

/* Instances of a model: other values of its parameters and start values. Most are variables of the equations
 * (model/data/variant.h). Parameters that shape the equations (tracks, tables, axes) have other equations for each
 * value: the file of the model is read again with them. */

/** True if a name may differ between instances; otherwise `why` (empty before) receives the reason. */
bool kmp_instance_may(const kempe_model *model, const char *name, kmp_text *why);

/** True if other values of this name are other equations. */
bool kmp_instance_reads(const kempe_model *model, const char *name);

/** The model read again, with values of parameters that shape the equations. KEMPE_E_FAILED: it cannot have these
 * values; KEMPE_E_INPUT: its files have changed. */
kempe_status kmp_model_read_again(const kempe_model *model, int count, const char *const *names, const double *values,
                                  kempe_model **again);

/** A model with other values of its parameters and start values: its own object, freed by kempe_model_free before the
 * model that it was made of. KEMPE_E_ARGUMENT: a name must not differ, or is given twice. KEMPE_E_FAILED, KEMPE_E_INPUT
 * as above. */
kempe_status kmp_model_instance(const kempe_model *model, int count, const char *const *names, const double *values,
                                kempe_model **instance);

struct kmp_sampling;

struct kempe_values {
    int columns, count;
    kmp_arena arena;
    char **name;                   /* columns */
    double *rows;                  /* count x columns; NULL: each row is drawn when it is needed */
    struct kmp_sampling *sampling; /* NULL: rows that are given */
    double *drawn;                 /* columns: the row drawn last */
    /* Origin: options of the sample, "" for those not given, or the file; NULL: neither. */
    const char *ranges, *correlations, *design, *file;
    int seed;
};

/** Copies or draws rows first .. first + count - 1, which the table has. */
void kmp_values_get(const kempe_values *values, int first, int count, double *rows);

/** The name of the value of a column of results, which is behind this prefix if a result has the same name. */
#define KMP_VALUE_PREFIX "value."
const char *kmp_value_name(const char *column);
