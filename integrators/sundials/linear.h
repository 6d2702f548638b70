/* SPDX-License-Identifier: BSD-3-Clause */
/* Direct linear solvers for IDA, one file each: SUNLinearSolvers for compressed-column matrices of one pattern. A
 * singular matrix is a recoverable failure (SUNLS_LUFACT_FAIL), so that the integrator tries a smaller step. */
#ifndef KMP_INTEGRATORS_SUNDIALS_LINEAR_H
#define KMP_INTEGRATORS_SUNDIALS_LINEAR_H

#include "constraints/sundials_compat.h"

#include <sundials/sundials_linearsolver.h>
#include <sunmatrix/sunmatrix_sparse.h>

/** Makes a solver for matrices like a by the name of a row of linear.def, or "auto": dense below 10 x 10, else KLU. All
 * matrices must have the pattern of the first. NULL when the name is unknown or memory is exhausted. SUNLinSolFree
 * frees it. */
SUNLinearSolver kmp_linear_new(const char *name, SUNMatrix a, SUNContext context);

/* Functions of one solver. */
typedef struct kmp_linear_ops {
    int (*setup)(SUNLinearSolver s, SUNMatrix a);
    int (*solve)(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance);
    void (*release)(void *content);
} kmp_linear_ops;

/** `content` begins with a kmp_linear_head. It is freed with the solver, or at once when memory is exhausted. */
typedef struct kmp_linear_head {
    const kmp_linear_ops *ops;
    int last;
} kmp_linear_head;
SUNLinearSolver kmp_linear_wrap(kmp_linear_head *content, const kmp_linear_ops *ops, SUNContext context);

#define KMP_LINEAR(name) SUNLinearSolver kmp_linear_##name(SUNMatrix a, SUNContext context);
#include "integrators/sundials/linear.def"
#undef KMP_LINEAR

#endif
