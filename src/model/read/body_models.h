/* SPDX-License-Identifier: BSD-3-Clause */
/* Other models of flexible bodies than the models that a file has. */
#pragma once

#include "model/read/reading.h"

/** The bodies as `r->bodies_as` says: rigid, with the stiffening none, first or full, or in segments:N; NULL: as they
 * are. Outputs that not every model of a body has are left out. Before kmp_read_segments. */
void kmp_read_body_models(kmp_reader *r);

/** True for a word of these. */
bool kmp_is_body_model(const char *word);
