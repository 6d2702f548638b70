/* SPDX-License-Identifier: BSD-3-Clause */
/* Serial vectors of SUNDIALS with Kempe's arithmetic. For a small mechanism the vector operations of an implicit
 * integrator between two evaluations cost more than the equations. */
#ifndef KMP_INTEGRATORS_SUNDIALS_HOST_VECTOR_H
#define KMP_INTEGRATORS_SUNDIALS_HOST_VECTOR_H

#include "constraints/sundials_compat.h"

/** Makes a vector of n numbers; its clones have the same operations. NULL: no memory. N_VDestroy frees it. */
N_Vector kmp_vector_new(sunindextype n, SUNContext context);

#endif
