/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * A folder that keeps the programs of equations, so that a model that is read again is ready at once. The library uses
 * none unless its user sets one:
 *
 *     char *folder = kempe_cache_folder();
 *     kempe_context_set_cache(context, folder);
 *     kempe_text_free(folder);
 *
 * Results are the same to the bit with and without it. The key of a file is a digest of the model's files and settings
 * and of the algorithm. It includes the build of Kempe and of the libraries in the process, and the processor's
 * features. A file that is damaged does not count; errors of the folder are not reported, since everything can be
 * computed again. Files hold programs of numbers and machine code: files that others may write are not read. Several
 * processes and threads may share a folder. Above 256 MiB, files go that have not been used for the longest time.
 *
 * Models that are built in code and variants with parameters that vary are always derived again.
 */
#ifndef KEMPE_CACHE_H
#define KEMPE_CACHE_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** Sets the folder of cached results for models that are read from now on; it is made when something is written. NULL:
 * none, as in a new context. */
KEMPE_API kempe_status kempe_context_set_cache(kempe_context *context, const char *folder);

/** The user's folder, which the command uses: KEMPE_CACHE, else XDG_CACHE_HOME/kempe, else HOME/.cache/kempe. NULL
 * where KEMPE_CACHE is "off", where none of these is set, and where there is no memory. Free it with kempe_text_free.
 */
KEMPE_API char *kempe_cache_folder(void);

KEMPE_END
#endif
