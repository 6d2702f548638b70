/* SPDX-License-Identifier: BSD-3-Clause */
/* Models of ROBOTRAN (.mbs) as documents of Kempe's own language: docs/robotran.md describes the conversion. */
#ifndef KMP_MODEL_FILES_MBS_H
#define KMP_MODEL_FILES_MBS_H

#include "model/files/xml.h"
#include "model/files/yaml.h"

/** The contract of kmp_yaml_load. Elements that are skipped are named in the log. */
kempe_status kmp_mbs_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                          size_t length, const kmp_yaml **root);

/** Names in the log the parts of a model that are skipped: unknown elements, and force elements whose law is in user
 * code. False: no memory. */
bool kmp_mbs_note(kempe_context *context, const char *file, const kmp_element *model);

#endif
