/* SPDX-License-Identifier: BSD-3-Clause */
/* Direct linear solvers for IDA, one file each: SUNLinearSolvers for compressed-column matrices of one pattern. A
 * singular matrix is a recoverable failure (SUNLS_LUFACT_FAIL), so that the integrator tries a smaller step. */
#pragma once

#include "base/arena.h"
#include "constraints/sundials_compat.h"

#include <sundials/sundials_linearsolver.h>
#include <sunmatrix/sunmatrix_sparse.h>

/** Makes a solver for matrices like a by the name of a row of linear.def, or "auto": dense below 10 x 10 and where the
 * factors of the pattern of a are nearly full, otherwise KLU. All matrices must have the pattern of the first. NULL
 * when the name is unknown or memory is exhausted. SUNLinSolFree frees it. */
SUNLinearSolver kmp_linear_new(const char *name, SUNMatrix a, SUNContext context);

/** Entries of the factors L and U of a solver made by kmp_linear_new, once it has factored. */
int64_t kmp_linear_fill(SUNLinearSolver solver);

/** One kind of solver. Functions return 0 or a code of sundials_compat.h. */
typedef struct kmp_linear_kind {
    const char *name;

    /** Why a library that is loaded at its first use is not there; NULL: it is. NULL: no such library. */
    const char *(*missing)(void);
    /** Makes the data for matrices like a, arrays in the arena. NULL: no memory. */
    void *(*create)(SUNMatrix a, kmp_arena *arena);
    int (*factor)(void *self, SUNMatrix a);
    int (*solve)(void *self, SUNMatrix a, double *x, const double *b); /* x may be b */
    void (*release)(void *self);                                       /* data that are not in the arena; NULL: none */
    int64_t (*fill)(void *self);                                       /* entries of L and U, once factored */
} kmp_linear_kind;

#define KMP_LINEAR(name) extern const kmp_linear_kind kmp_linear_##name;
#include "integrators/sundials/linear.def"
#undef KMP_LINEAR

/** The linear solver in row k of linear.def, NULL after the last. */
const char *kmp_linear_name(int k);

/** The name in the table of the linear solver of that name (also "auto"); NULL: there is none. All names,
 * comma-separated. */
const char *kmp_linear_find(const char *name);
/** Why a linear solver of the table cannot be used here; NULL: it can. */
const char *kmp_linear_missing(const char *name);
const char *kmp_linear_names(void);
