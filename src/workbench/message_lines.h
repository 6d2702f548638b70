/* SPDX-License-Identifier: BSD-3-Clause */
/* Sentences of the command and of a context as members of JSON: level, text, and file, line and column where they have
 * them, as javascript/kempe.mjs gives them. */
#pragma once

#include "base/json.h"

/** Writes the member "messages" of an open object: a message for each line that is not blank. `folder`, with its
 * separator, is left out of the names of files. */
void kmp_put_messages(kmp_json *json, const char *lines, const char *folder);
