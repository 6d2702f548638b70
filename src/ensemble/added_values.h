/* SPDX-License-Identifier: BSD-3-Clause */
/* Values that users request of a model from outside its file, each one number at a state: an expression in the words of
 * the model's sensors, or an output with its component. */
#pragma once

#include "model/data/model.h"

typedef struct kmp_added_value {
    const char *text;
    int column;     /* of its first character, in messages */
    bool condition; /* the text is a comparison: the value is negative where it holds */
    /* found: */
    bool or_equal;    /* a condition that holds at zero too */
    bool rates, late; /* it depends on rates; on accelerations or multipliers */
    int shown;        /* its number among the computed outputs of the copy (kmp_eval_shown), or -1 - a coordinate's
                       * number among q, qd and qdd */
    const char *unit; /* SI, in the copy's arena */
} kmp_added_value;

/** An argument of a function within the values (model/language/expression.h). */
typedef struct kmp_added_argument {
    kmp_argument_kind kind;
    int of;    /* the value that it belongs to */
    int shown; /* as of a value */
} kmp_added_argument;

typedef struct kmp_added_arguments {
    int count;
    kmp_added_argument *of; /* in the copy's arena */
    int outputs;            /* of them, the last ones of the copy */
    bool turns;             /* some value is a wave of the angles of the mechanism, as positions and loads are */
} kmp_added_arguments;

/** Makes the values, and the arguments of their functions behind them, the outputs of a copy of a model
 * (model/data/variant.h). KEMPE_E_ARGUMENT: sentences that begin with `label` and a column. */
kempe_status kmp_add_values(kempe_model *copy, const char *label, int count, kmp_added_value *values,
                            kmp_added_arguments *arguments);

/** A number of parameters with a dimension, such as a time, read as in the file. KEMPE_E_ARGUMENT as above. */
kempe_status kmp_added_number(kempe_model *copy, const char *label, const char *text, int column, const char *what,
                              kmp_dimension dimension, double *number);
