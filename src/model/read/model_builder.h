/* SPDX-License-Identifier: BSD-3-Clause */
/* A model under construction: the document that a model file would have been, written call by call. */
#pragma once

#include "model/read/reading.h"
#include <kempe/build.h>

typedef struct kmp_builder {
    kmp_arena arena;
    kmp_yaml *root;
    const char **calls; /* the calls, "body 'crank'": the files, without lines, of their nodes; 0: the model */
    int call_count;
} kmp_builder;

void kmp_builder_free(kmp_builder *builder);

/** Reads the document of a builder into a new model. KEMPE_E_INPUT: sentences that begin with the call. */
kempe_status kmp_builder_read(kempe_context *context, const kmp_builder *builder, const char *label,
                              kempe_model **model);
