/* SPDX-License-Identifier: BSD-3-Clause */
/* Requested outputs, and sensors. */
#pragma once

#include "model/data/place.h"
#include "model/language/expression.h"

/** A named expression of the state, for outputs. */
typedef struct kmp_sensor {
    const char *name;
    const kmp_expr *expr;
    kmp_place place;
} kmp_sensor;

/* The rows of output_kinds.def. */
typedef enum kmp_output_kind {
#define KMP_OUTPUT(kind, ...) KMP_OUTPUT_##kind,
#include "model/data/output_kinds.def"
#undef KMP_OUTPUT
    KMP_OUTPUT_KINDS
} kmp_output_kind;

/** `index`: of its point, loop, force, sensor, body or coordinate; -1 for all of them or none. */
typedef struct kmp_output {
    kmp_output_kind kind;
    int index;
    int about; /* 1 + the point about which an angular momentum is; 0: the centre of mass. Of a wrap: 1 + its place */
    bool unasked; /* the model names no outputs, and has this one for that */
} kmp_output;
