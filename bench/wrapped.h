/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions of the library between two calls of a bench: the linker leads calls of NAME to __wrap_NAME (--wrap,
 * bench/CMakeLists.txt). The bench defines enter(to), which returns the place that it leaves, and leave(from), for
 * places of its enumeration. */
#ifndef KEMPE_BENCH_WRAPPED_H
#define KEMPE_BENCH_WRAPPED_H

#define REAL(name) __real_##name
#define OURS(name) __wrap_##name

/** A function with a value; `parameters` and `arguments` in parentheses. */
#define TIMED(to, type, name, parameters, arguments)                                                                   \
    type REAL(name) parameters;                                                                                        \
    type OURS(name) parameters;                                                                                        \
    type OURS(name) parameters                                                                                         \
    {                                                                                                                  \
        int from = enter(to);                                                                                          \
        type result = REAL(name) arguments;                                                                            \
        leave(from);                                                                                                   \
        return result;                                                                                                 \
    }

/** A function without one. */
#define TIMED_VOID(to, name, parameters, arguments)                                                                    \
    void REAL(name) parameters;                                                                                        \
    void OURS(name) parameters;                                                                                        \
    void OURS(name) parameters                                                                                         \
    {                                                                                                                  \
        int from = enter(to);                                                                                          \
        REAL(name) arguments;                                                                                          \
        leave(from);                                                                                                   \
    }

#endif
