/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * The assembly modes of a mechanism: the ways in which its loops close with the held coordinates as they are.
 */
#ifndef KEMPE_BRANCHES_H
#define KEMPE_BRANCHES_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct kempe_branches kempe_branches;

/** Other assembly modes, found by assembling from many random starts with the held coordinates kept (where
 *  these are fewer than the degrees of freedom, with further independent ones). Sampling may miss some.
 *  `seed` chooses the starts; the same seed gives the same result. */
KEMPE_API kempe_status kempe_branches_new(const kempe_system *system, int seed, kempe_branches **branches);
KEMPE_API void kempe_branches_free(kempe_branches *branches);

/** How many; q of the k-th, n values, owned by the branches. The first is the model's. */
KEMPE_API int kempe_branches_count(const kempe_branches *branches);
KEMPE_API const double *kempe_branches_q(const kempe_branches *branches, int k);
KEMPE_API kempe_status kempe_branches_print(const kempe_branches *branches, kempe_format format, char **text);

#ifdef __cplusplus
}
#endif
#endif
