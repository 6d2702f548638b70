/* SPDX-License-Identifier: BSD-3-Clause */
/* Sentences of the command and of a context as members of JSON: level, text, and file, line and column where they have
 * them, as javascript/kempe.mjs gives them. */
#pragma once

#include "base/json.h"

/** Why a text of a request is refused. */
#define KMP_SERVED_NO_TEXT                                                                                             \
    "the text has half of a surrogate pair (\\ud800 to \\udfff) or a zero character, which a text in UTF-8 cannot "    \
    "have: remove it"

/** Writes the member "messages" of an open object: a message for each line that is not blank. `folder`, with its
 * separator, is left out of the names of files. */
void kmp_put_messages(kmp_json *json, const char *lines, const char *folder);
