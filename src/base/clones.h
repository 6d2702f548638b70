/* SPDX-License-Identifier: BSD-3-Clause */
/* Static functions in several clones: the loader takes the clone for the widest vectors of the machine, all with the
 * same bits. KMP_NO_AVX512 leaves out vectors of eight doubles (-DKEMPE_AVX512=OFF). Sanitizers run before the loader
 * may choose, so they get the plain function. Functions with fma() have a twin for processors that have it as an
 * instruction; the C library's has the same bits. */
#pragma once

#include "platform/platform.h"
#include <stdbool.h>

#if defined(__x86_64__) && KMP_LOADER_CHOOSES && defined(__GNUC__) && !defined(__clang__) &&                           \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#ifdef KMP_NO_AVX512
#define KMP_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define KMP_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
#else
#define KMP_CLONES
#endif

/* Machine code of Kempe takes its arguments in one way, whatever the system's functions do. */
#if defined(__x86_64__) && defined(__GNUC__)
#define KMP_MACHINE_CODE __attribute__((sysv_abi))
#else
#define KMP_MACHINE_CODE
#endif

/* In recursions: variables of rare cases are not on the stack of each level. */
#define KMP_NOINLINE __attribute__((noinline))

#if defined(__x86_64__) && defined(__GNUC__)
#define KMP_MULTIPLY_ADD __attribute__((target("fma")))
#else
#define KMP_MULTIPLY_ADD
#endif

/* Twins with fma() for registers of four doubles, and of eight. */
#if defined(__x86_64__) && defined(__GNUC__)
#define KMP_REDUCED_PROGRAM_FOURS  __attribute__((target("avx2,fma")))
#define KMP_REDUCED_PROGRAM_EIGHTS __attribute__((target("avx512f")))
#else
#define KMP_REDUCED_PROGRAM_FOURS
#define KMP_REDUCED_PROGRAM_EIGHTS
#endif

/** True if functions with KMP_MULTIPLY_ADD run here. */
static inline bool kmp_has_multiply_add(void)
{
#if defined(__x86_64__) && defined(__GNUC__)
    return __builtin_cpu_supports("fma");
#else
    return true;
#endif
}

/** True if functions with KMP_REDUCED_PROGRAM_FOURS run here. */
static inline bool kmp_has_four(void)
{
#if defined(__x86_64__) && defined(__GNUC__)
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
    return false;
#endif
}

/** True if there are registers of eight doubles. */
static inline bool kmp_has_eight(void)
{
#if defined(__x86_64__) && defined(__GNUC__) && !defined(KMP_NO_AVX512)
    return __builtin_cpu_supports("avx512f");
#else
    return false;
#endif
}

/** A function that clones call: it is inlined into each, for its vectors. */
#define KMP_INTO_CLONES inline __attribute__((always_inline))

/** The call of a kernel f(size_t w, ...) with the usual widths as constants. */
#define KMP_OF_WIDTH(kernel, width, ...)                                                                               \
    do {                                                                                                               \
        if ((width) == 16)                                                                                             \
            kernel(16, __VA_ARGS__);                                                                                   \
        else if ((width) == 8)                                                                                         \
            kernel(8, __VA_ARGS__);                                                                                    \
        else if ((width) == 4)                                                                                         \
            kernel(4, __VA_ARGS__);                                                                                    \
        else                                                                                                           \
            kernel(width, __VA_ARGS__);                                                                                \
    } while (0)

/** Twins of a kernel f(size_t w, ...), which may have fma(): their parameters, the first of them `width`, and the names
 * of those after it. The kernel is inlined for each width, for registers of eight doubles, of four, and for any
 * processor. The bits are the same. */
#define KMP_LANES_TWINS(name, kernel, parameters, ...)                                                                 \
    KMP_REDUCED_PROGRAM_EIGHTS static void name##_in_eights parameters                                                 \
    {                                                                                                                  \
        KMP_OF_WIDTH(kernel, width, __VA_ARGS__);                                                                      \
    }                                                                                                                  \
    KMP_REDUCED_PROGRAM_FOURS static void name##_in_fours parameters                                                   \
    {                                                                                                                  \
        KMP_OF_WIDTH(kernel, width, __VA_ARGS__);                                                                      \
    }                                                                                                                  \
    static void name##_in_any parameters                                                                               \
    {                                                                                                                  \
        KMP_OF_WIDTH(kernel, width, __VA_ARGS__);                                                                      \
    }

/** The twin for this processor. */
#define KMP_TWIN(name) (kmp_has_eight() ? name##_in_eights : kmp_has_four() ? name##_in_fours : name##_in_any)

/** The function `name` of a kernel; `arguments`: the names of all its parameters. */
#define KMP_LANES_KERNEL(name, kernel, parameters, arguments, ...)                                                     \
    KMP_LANES_TWINS(name, kernel, parameters, __VA_ARGS__)                                                             \
    void name parameters                                                                                               \
    {                                                                                                                  \
        KMP_TWIN(name) arguments;                                                                                      \
    }
