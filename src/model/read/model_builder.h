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
