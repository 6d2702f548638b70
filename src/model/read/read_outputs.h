/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensors, which are named expressions, and the outputs of a run: the rows of output_kinds.def. */
#pragma once

#include "model/data/place.h"
#include "model/read/reading.h"
#include <kempe/kempe.h>

void kmp_read_sensors(kmp_reader *r);
void kmp_read_outputs(kmp_reader *r, const kmp_yaml *list);

/** The NAME of "word(NAME)"; NULL when `text` is not of that form. */
const char *kmp_read_argument(kmp_reader *r, const char *text, const char *word);

/* Lists of words separated by commas, by which users request outputs of a model from outside its file. They are checked
 * like the words of the file, with the list's name in place of file, line and column. */

/** Sets the outputs of a copy of a model (model/data/variant.h): "position(b.P).x,q(A),energy.total", the words of
 * `outputs` in the file, each with a component if one alone is requested. `*parts` (in the copy's arena): for each
 * output a bit for every component. KEMPE_E_ARGUMENT: the word, and the valid ones. */
kempe_status kmp_requested_outputs(kempe_model *copy, const char *words, unsigned **parts);

/** The same for words at a place of a text (its file is number 0), with the name of that text in messages. */
kempe_status kmp_requested_outputs_at(kempe_model *copy, const char *label, kmp_place place, const char *words,
                                      unsigned **parts);

/** Makes room for one more output of such a copy, the position of a point, without requested components; its number,
 * -1: no memory. */
int kmp_requested_position(kempe_model *copy, int point, unsigned **parts);

typedef enum kmp_requested_kind {
    KMP_REQUESTED_EFFORT,    /* on a coordinate */
    KMP_REQUESTED_FORCE,     /* at a point, along an axis of the ground */
    KMP_REQUESTED_DRIVE,     /* the value of a drive's function */
    KMP_REQUESTED_INPUT,     /* of the model */
    KMP_REQUESTED_PARAMETER, /* not looked up */
} kmp_requested_kind;

/** Something that acts on a model. */
typedef struct kmp_requested_input {
    kmp_requested_kind kind;
    int index, axis; /* coordinate, point, closure or input; x, y, z of a force */
    char *name;      /* "force(b.P.x)" */
} kmp_requested_input;

typedef struct kmp_requested_inputs {
    int count;
    kmp_requested_input *input;
} kmp_requested_inputs;

/** Reads "effort(A),force(b.P.x),force(b.P),drive(m),k": the third of these is three inputs. KEMPE_E_ARGUMENT: the
 * invalid word. */
kempe_status kmp_requested_inputs_read(const kempe_model *model, const char *words, kmp_requested_inputs *inputs);
void kmp_requested_inputs_free(kmp_requested_inputs *inputs);
