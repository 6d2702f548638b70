/* SPDX-License-Identifier: BSD-3-Clause */
/* Serial vectors of SUNDIALS with arithmetic of our own: what an implicit integrator does to them between two
 * evaluations costs a small mechanism more than its equations. */
#ifndef KMP_INTEGRATORS_SUNDIALS_HOST_VECTOR_H
#define KMP_INTEGRATORS_SUNDIALS_HOST_VECTOR_H

#include "constraints/sundials_compat.h"

/** n numbers; its clones compute likewise. NULL: no memory. Freed by N_VDestroy. */
N_Vector kmp_vector_new(sunindextype n, SUNContext context);

#endif
