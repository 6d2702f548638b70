/* SPDX-License-Identifier: BSD-3-Clause */
/* A model's document, in any file format: Kempe's own YAML, or another one converted to YAML nodes. */
#pragma once

#include "model/files/xml.h"
#include "model/files/yaml.h"

/** The contract of kmp_yaml_load. Text in another format begins with '<' or is in a file whose name ends with ".mbs".
 */
kempe_status kmp_document_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                               size_t length, const kmp_yaml **root);

/** Models of ROBOTRAN (.mbs): docs/robotran.md describes the conversion. Elements that are skipped are named in the
 * log. */
kempe_status kmp_mbs_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                          size_t length, const kmp_yaml **root);

/** Names in the log the parts of such a model that are skipped: unknown elements, and force elements whose law is in
 * user code. False: no memory. */
bool kmp_mbs_note(kempe_context *context, const char *file, const kmp_element *model);
