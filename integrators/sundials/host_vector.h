/* SPDX-License-Identifier: BSD-3-Clause */
/* Replaces the operations of SUNDIALS' serial vector that dominate IDA's steps by vectorised ones. Sums are taken in
 * eight fixed interleaved parts, so that every vector width gives the same bits; a combination of many vectors is
 * one pass. */
#pragma once

#include "integrators/sundials/sundials_host.h"

/** A serial vector of n numbers with Kempe's arithmetic (host_vector.c), and its clones. For a small mechanism the
 * vector operations of an implicit integrator between two evaluations cost more than the equations. NULL: no memory.
 * N_VDestroy frees it. */
N_Vector kmp_vector_new(sunindextype n, SUNContext context);
