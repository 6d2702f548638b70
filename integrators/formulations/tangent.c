/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact tangents of the residual: forward differentiation column by column, or composite bodies where these take fewer
 * operations. Entries that are zero for every state are left out, and the others listed by column, as sparse matrices
 * have them. */
#include "integrators/formulations/tangent.h"
#include "backend/native.h"
