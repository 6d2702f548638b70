/* SPDX-License-Identifier: BSD-3-Clause */
/* Models of ROBOTRAN (.mbs) as documents of Kempe's own language: docs/robotran.md says what becomes of what. */
#ifndef KMP_MODEL_FILES_MBS_H
#define KMP_MODEL_FILES_MBS_H

#include "model/files/xml.h"
#include "model/files/yaml.h"

/** The contract of kmp_yaml_load. What is passed over is named in the log. */
kempe_status kmp_mbs_load(kempe_context *context, kmp_arena *arena, const char *file, int number, const char *text,
                          size_t length, const kmp_yaml **root);

/** Names in the log what of a model is passed over: elements that are not known, and force elements whose law is in
 *  user code. false: no memory. */
bool kmp_mbs_note(kempe_context *context, const char *file, const kmp_element *model);

#endif
