/* SPDX-License-Identifier: BSD-3-Clause */
/* The rows of output_kinds.def, and the names of an output and its columns. */
#pragma once

#include "base/text.h"
#include "model/data/output.h"
#include "model/language/nearest.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef enum kmp_output_argument {
    KMP_OUTPUT_OF_NOTHING,
    KMP_OUTPUT_OF_MAYBE_COORDINATE,
    KMP_OUTPUT_OF_MAYBE_STATE,
    KMP_OUTPUT_OF_MAYBE_LOOP,
    KMP_OUTPUT_OF_LOOP,
    KMP_OUTPUT_OF_CUT,   /* of model->cut_coordinates */
    KMP_OUTPUT_OF_JOINT, /* of the tree, by the body that it carries, less one */
    KMP_OUTPUT_OF_MAYBE_BODY,
    KMP_OUTPUT_OF_MAYBE_BODY_ABOUT, /* and the point of a moment: "arm about ground.O", "about ground.O" */
    KMP_OUTPUT_OF_POINT,
    KMP_OUTPUT_OF_FORCE,
    KMP_OUTPUT_OF_OUTLINED, /* a contact with outlines, or its friction */
    KMP_OUTPUT_OF_SENSOR,
    KMP_OUTPUT_OF_BEARING,
    KMP_OUTPUT_OF_WHEEL,
    KMP_OUTPUT_OF_TYRE,
    KMP_OUTPUT_OF_ROPE,
    KMP_OUTPUT_OF_SHEAVE /* of a rope: its place is in kmp_output.about, from 1 */
} kmp_output_argument;

typedef struct kmp_output_row {
    const char *word, *unit;
    kmp_output_argument argument;
    int width;
} kmp_output_row;

extern const kmp_output_row kmp_output_rows[KMP_OUTPUT_KINDS];

/** True if the word by itself is an output. */
bool kmp_output_stands_alone(kmp_output_kind kind);

bool kmp_output_equal(const kmp_output *a, const kmp_output *b);

/** True if `a` has all columns of `b`: an equal output, or all of q, qd, qdd or lambda. */
bool kmp_output_includes(const kmp_output *a, const kmp_output *b);

/** The names that an argument is one of; of points, without the names of their bodies. */
kmp_name_list kmp_output_names(const kempe_model *model, kmp_output_argument argument);

/** Why an output of a point of a body that is not fit for it is refused, "is rigid": words after the body's name. NULL:
 * it is known. */
const char *kmp_output_obstacle(const kempe_model *model, kmp_output_kind kind, int point);

/** Values a row that are computed for an output; 0: it is in the table of every run. */
int kmp_output_width(const kempe_model *model, const kmp_output *output);

/** The number of computed values per row for the outputs of a model, in addition to its table. */
int kmp_outputs_width(const kempe_model *model);

/** "velocity(crank.B)" */
void kmp_output_print(kmp_text *text, const kempe_model *model, const kmp_output *output);

/** Name of the column of computed value k: "velocity.crank.B.x", "energy.kinetic". */
void kmp_output_column(kmp_text *text, const kempe_model *model, const kmp_output *output, int k);

/** SI unit of computed value k; "": a pure number, or a sensor, whose unit is the unit of its expression. */
const char *kmp_output_unit(const kempe_model *model, const kmp_output *output, int k);
