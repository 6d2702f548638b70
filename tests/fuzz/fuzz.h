/* SPDX-License-Identifier: BSD-3-Clause */
/* Common parts of the targets. A target is a file fuzz_NAME.c with the function that libFuzzer calls; replay.c calls it
 * too, with the inputs of corpus/NAME. An input that breaks a promise of the library ends the process by abort(). */
#ifndef KEMPE_FUZZ_H
#define KEMPE_FUZZ_H

#include <kempe/kempe.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/** Ends the process with a sentence on standard error when `kept` is false. */
void fuzz_promise(bool kept, const char *sentence);

/* -- files in memory (memory_files.c): no other can be read while there are any --------------------------------- */

/** The input is the file `name`, up to a line that begins with `#== NAME` and the end of that line: there the file
 *  NAME begins, and so on. Nothing is copied. */
void fuzz_files_set(const char *name, const uint8_t *data, size_t size);
void fuzz_files_clear(void);

/* -- what a user does with a model (walk.c) -------------------------------------------------------------- */

kempe_context *fuzz_context_new(void);

/** A status that may be, with a message that goes with it: complaints of inputs have a file, a line and a column. */
void fuzz_check_status(const kempe_context *context, kempe_status status);

/** The same where complaints may be of the whole file, without a line. */
void fuzz_check_sentence(const kempe_context *context, kempe_status status);

/** Reads the file and prints the model; does with one of `share` models what the command does, as far as that is quick.
 *  Equations take most of the time where most inputs are models, and a reader writes none. */
void fuzz_walk_file(const char *path, unsigned share);

/** Works with a model that was read, and frees it. `choice` selects one of several computations, always the same one.
 */
void fuzz_walk_model(kempe_context *context, kempe_model *model, unsigned choice);

bool fuzz_is_json(const char *text);

/** A number of the bytes. */
unsigned fuzz_hash(const uint8_t *data, size_t size);

/** A small model with loops that other files are about. NULL: no memory. */
kempe_system *fuzz_four_bar(kempe_context *context, kempe_model **model);

#endif
