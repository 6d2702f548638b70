/* SPDX-License-Identifier: BSD-3-Clause */
/* The needs of all decisions: tolerances, the C library, and the linkage of small functions in headers that generated
 * simulators have too. C99. */
#pragma once

#include "constraints/tolerances.h"
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#if defined(__GNUC__)
#define KMP_INLINE static inline __attribute__((always_inline, unused))
#else
#define KMP_INLINE static inline
#endif
