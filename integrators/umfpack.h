/* SPDX-License-Identifier: BSD-3-Clause */
/* A direct SUNLinearSolver around UMFPACK for compressed-column matrices of a fixed pattern. */
#ifndef KMP_INTEGRATORS_UMFPACK_H
#define KMP_INTEGRATORS_UMFPACK_H

#include "constraints/sundials_compat.h"

#include <sundials/sundials_linearsolver.h>

/** For n x n matrices. The pattern of the first matrix it meets must be that of all. NULL when there is no
 *  memory. Freed by SUNLinSolFree. */
SUNLinearSolver kmp_umfpack_solver(long n, SUNContext context);

#endif
