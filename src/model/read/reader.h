/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading a model: the parts of the file in the order in which they refer to each other. No error ends the reading;
 * parts that depend on a faulty one are skipped, and the messages are sorted by place at the end. */
#pragma once

#include "model/read/model_builder.h"

/** Reads the document of a builder into a new model. KEMPE_E_INPUT: sentences that begin with the call. */
kempe_status kmp_builder_read(kempe_context *context, const kmp_builder *builder, const char *label,
                              kempe_model **model);

/** kempe_model_read_set within a computation that has begun. */
kempe_status kmp_model_read_file(kempe_context *context, const char *path, const kempe_setting *list, int count,
                                 kempe_model **model);

/** The same, with another model of its flexible bodies (body_models.h); NULL: their own. */
kempe_status kmp_model_read_as(kempe_context *context, const char *path, const kempe_setting *list, int count,
                               const char *bodies_as, kempe_model **model);

/* Keys of a model, of a body and of an include; other mappings have theirs next to their reader. */
extern const kmp_key kmp_model_keys[];

/** Checks the version of the format; false when the rest means something else in it. */
bool kmp_read_version(kmp_reader *r, const kmp_yaml *root, const char *what);

void kmp_read_wings(kmp_reader *r, kmp_reader_stage stage);
