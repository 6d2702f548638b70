/* SPDX-License-Identifier: BSD-3-Clause */
/* Operands made in the call itself, as in kmp_sub(g, kmp_mul(g, a, b), kmp_mul(g, c, d)). C leaves the order in which
 * they are evaluated to the compiler (C11, 6.5.2.2): gcc for x86-64 begins with the last one, clang and gcc for arm64
 * with the first. Nodes are numbered as they are made, and their numbers order the terms of sums and products, so
 * equations and the rounding of results would depend on the compiler. These macros evaluate the last operand first. */
#pragma once

/** f(g, a, b). */
#define KMP_LAST_FIRST(f, g, a, b)       KMP_LAST_FIRST_OF(__COUNTER__, f, g, a, b)
#define KMP_LAST_FIRST_OF(n, f, g, a, b) KMP_LAST_FIRST_AS(kmp_last_, n, f, g, a, b)
/* Each call has a separate name for its last operand: calls are nested. */
#define KMP_LAST_FIRST_AS(name, n, f, g, a, b)                                                                         \
    __extension__({                                                                                                    \
        __auto_type name##n = (b);                                                                                     \
        f(g, a, name##n);                                                                                              \
    })

/** f(g, x, a, b). */
#define KMP_LAST_FIRST_3(f, g, x, a, b)       KMP_LAST_FIRST_OF_3(__COUNTER__, f, g, x, a, b)
#define KMP_LAST_FIRST_OF_3(n, f, g, x, a, b) KMP_LAST_FIRST_AS_3(kmp_last_, kmp_before_, n, f, g, x, a, b)
#define KMP_LAST_FIRST_AS_3(name, before, n, f, g, x, a, b)                                                            \
    __extension__({                                                                                                    \
        __auto_type name##n = (b);                                                                                     \
        __auto_type before##n = (a);                                                                                   \
        f(g, x, before##n, name##n);                                                                                   \
    })
