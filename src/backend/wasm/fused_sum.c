/* SPDX-License-Identifier: BSD-3-Clause */
/* a b + c with one rounding, which WebAssembly has no instruction for: most of the time of contracted programs is spent
 * here where the engine has no relaxed instruction either. The linker sends calls of fma() here (--wrap). */
#include "backend/wasm/relaxed_sums.h"

#ifdef __wasm__
#include "platform/rounded_once.h"

double kmp_fused_sum(double a, double b, double c) __asm__("__wrap_fma");
double kmp_fused_sum(double a, double b, double c)
{
    const kmp_relaxed_sums *relaxed = kmp_relaxed_sums_here();
    return relaxed ? relaxed->sum(a, b, c) : kmp_rounded_once(a, b, c);
}
#endif
