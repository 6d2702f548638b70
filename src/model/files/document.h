/* SPDX-License-Identifier: BSD-3-Clause */
/* A model's document, in any file format: Kempe's own YAML, or another one converted to YAML nodes. */
#pragma once

#include "model/files/yaml.h"

/** The contract of kmp_yaml_load. Text in another format begins with '<', is in a file with one of the endings in
 * formats.def, or has one of the keys there; `base` is the support of its root. */
kempe_status kmp_document_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                               size_t length, kmp_base base, const kmp_yaml **root);
