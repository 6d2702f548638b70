/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters of a model, and the inputs that a run may be given. */
#pragma once

#include "model/data/place.h"
#include "model/data/signal.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef struct kmp_parameter {
    const char *name;
    kmp_number number;
    kmp_dimension dimension; /* of its value, as far as it is known */
    const char *unit;        /* of SI by that dimension; "" or NULL: unknown */
    kmp_extent extent;
    bool fixed;      /* a value outside the equations depends on it */
    bool shapes;     /* and such a value is part of them: axes, tables, sections of the model */
    bool used;       /* something other than parameters depends on it */
    bool unused;     /* nothing of the model depends on it, and the user was warned */
    bool varies;     /* of a variant (model/data/variant.h): an input of its equations */
    int marked_next; /* while flags are set: the next one to be followed, from 1 */
} kmp_parameter;

/** A function of time that is given to a run: a constant, or samples. Expressions use it by its name. */
typedef struct kmp_model_input {
    const char *name;
    kmp_place place;
    const char *unit;        /* as written, "" without one */
    kmp_dimension dimension; /* of its values */
    double si;               /* a number in its unit, times this, is in SI */
    double value;            /* the default, in SI; a given constant takes its place */
    kmp_signal signal;       /* in SI; of a constant one sample */
    bool used;               /* some expression has it */
} kmp_model_input;

/** Parameter k of a model, and the number of parameters. */
const kmp_parameter *kmp_model_parameter(const kempe_model *model, int k);
int kmp_model_parameter_count(const kempe_model *model);

/** The number of inputs, with the inputs of delays, which are the last ones; the number of these. */
int kmp_model_all_inputs(const kempe_model *model);
int kmp_model_delay_count(const kempe_model *model);
