/* SPDX-License-Identifier: BSD-3-Clause */
/* The manifest of a result folder: a JSON object of plain members, one a line, each key once. It is written once and
 * compared line by line. */
#pragma once

#include "ensemble/result_folder.h"

/** The manifest of a run with these options, the library's copy of them; history: words of the chosen instances. */
kempe_status kmp_manifest_put(kempe_ensemble *ensemble, const kempe_run_options *run, int lanes, int chunk,
                              const char *history, kmp_text *text);

/** The hash of all that was read to make a model; of a model built in code, of its print. */
kempe_status kmp_manifest_hash_model(const kempe_model *model, char hash[KMP_HASH_SIZE + 1]);

/** The hash of all members of a manifest that count. */
void kmp_manifest_hash_text(const char *manifest, char hash[KMP_HASH_SIZE + 1]);

/** True if the hash written in a manifest is the hash of its text. */
bool kmp_manifest_is_whole(const char *manifest, const char *written);

/** The value of a key in a manifest, a string without quotes; false: it has none. */
bool kmp_manifest_text(const char *manifest, const char *key, kmp_text *value);
bool kmp_manifest_int(const char *manifest, const char *key, int low, int high, int *value);
bool kmp_manifest_double(const char *manifest, const char *key, double *value);

/** True if two manifests describe the same run; otherwise `why` has a sentence about the first difference. */
bool kmp_manifest_same(const char *there, const char *here, kmp_text *why);

/** Reads the manifest of a folder. *text is freed by the caller; NULL: there is none. */
kempe_status kmp_manifest_read(kempe_context *context, const char *folder, char **text);
