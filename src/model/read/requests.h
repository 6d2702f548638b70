/* SPDX-License-Identifier: BSD-3-Clause */
/* Lists of words separated by commas, by which users request outputs of a model from outside its file. They are checked
 * like the words of the file, with the list's name in place of file, line and column. */
#pragma once

#include "model/data/model.h"
#include "model/read/reading.h"
#include <kempe/kempe.h>

/** A reader of words outside a file: the list's name takes the place of the file's. */
typedef struct kmp_request {
    kmp_reader r;
    kempe_model model; /* a copy, except for the names of its files, and its arena */
    const char *label[1];
    kmp_place place; /* of the words; no line: they are named only by the label */
    int count;
    char **word;
} kmp_request;

/** Begins to read the words of a list, whose name is `what`; what has begun is ended in any case. It ends with the
 * status of its errors. */
kempe_status kmp_request_begin(kmp_request *request, const kempe_model *model, const char *what, const char *words);
kempe_status kmp_request_end(kmp_request *request, kempe_status status);

/** Sets the outputs of a copy of a model (model/data/variant.h): "position(b.P).x,q(A),energy.total", the words of
 * `outputs` in the file, each with a component if only one is requested. `*parts` (in the copy's arena): for each
 * output a bit for every component. KEMPE_E_ARGUMENT: the word, and the valid ones. */
kempe_status kmp_requested_outputs(kempe_model *copy, const char *words, unsigned **parts);

/** The same for words at a place of a text (its file is number 0), with the name of that text in messages. */
kempe_status kmp_requested_outputs_at(kempe_model *copy, const char *label, kmp_place place, const char *words,
                                      unsigned **parts);
