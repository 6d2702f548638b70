/* SPDX-License-Identifier: BSD-3-Clause */
/* Linkage of small functions in headers of the library that generated simulators have too: C99. */
#pragma once

#if defined(__GNUC__)
#define KMP_INLINE static inline __attribute__((always_inline, unused))
#else
#define KMP_INLINE static inline
#endif
