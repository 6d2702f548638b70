/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Assembly modes of a mechanism: the configurations in which its loops close with the held coordinates fixed.
 */
#ifndef KEMPE_BRANCHES_H
#define KEMPE_BRANCHES_H

#include <kempe/kempe.h>

KEMPE_BEGIN

typedef struct kempe_branches kempe_branches;

/** Finds other assembly modes by assembling from many random starts with the held coordinates fixed. If fewer
 * coordinates are held than there are degrees of freedom, further independent ones are fixed. Sampling may miss some
 * modes. `seed` chooses the starts; the same seed gives the same result. */
KEMPE_API kempe_status kempe_branches_new(const kempe_system *system, int seed, kempe_branches **branches);
KEMPE_API void kempe_branches_free(kempe_branches *branches);

/** The number of modes, and q of the k-th (n values, owned by the branches). The first mode is the model's. */
KEMPE_API int kempe_branches_count(const kempe_branches *branches);
KEMPE_API const double *kempe_branches_q(const kempe_branches *branches, int k);
KEMPE_API kempe_status kempe_branches_print(const kempe_branches *branches, kempe_format format, char **text);

KEMPE_END
#endif
