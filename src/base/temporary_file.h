/* SPDX-License-Identifier: BSD-3-Clause */
/* A file on its way: a temporary one in the folder of its path, which is renamed when it is whole. */
#pragma once

#include "base/context.h"
#include "base/text.h"
#include "platform/platform.h"

/** A new file, open for writing, with its name in `temporary`; -1 and errno: there is none. */
int kmp_temporary_open(const char *path, kmp_text *temporary);

/** Writes the last bytes, and closes in any case. 0 or an errno. */
int kmp_temporary_end(int fd, const char *text, size_t left);

/** The whole of one that will replace a file of this state (NULL: there is none), with its permissions. 0 or an errno;
 * after an error there is no file. */
int kmp_temporary_write(const char *path, const kmp_path_state *old, const char *text, size_t length,
                        kmp_text *temporary);

/** The status of an errno (0: KEMPE_OK), with the path. */
kempe_status kmp_temporary_report(kempe_context *context, const char *path, int error);
