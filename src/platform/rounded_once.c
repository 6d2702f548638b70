/* SPDX-License-Identifier: BSD-3-Clause */
/* fma(): a b + c with one rounding, where the C library rounds more than once or is slow.
 *
 * The function of mingw-w64 differs from the instruction of the processor in the last bit of every fourth result. It is
 * replaced by the instruction, and by this algorithm on processors without it. WebAssembly has no such instruction
 * (src/backend/wasm). Elsewhere the linker sends calls of fma() here (--wrap), for tests.
 *
 * The product and the sums are split into a number and its error, and the last sum but one is rounded to odd, after
 * which the last one rounds correctly (Boldo and Melquiond, IEEE Transactions on Computers 57 (2008) 462). That sum is
 * seldom needed: first it is rounded plainly, and the result is the same for all numbers within its rounding. */
#include "platform/rounded_once.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(_WIN32)
/* Two roundings. */
static double of_library(double a, double b, double c)
{
    return (double)fmal(a, b, c);
}
#else
double of_library(double a, double b, double c) __asm__("__real_fma");
#endif

/* high + low is x + y. */
static double sum_of(double x, double y, double *low)
{
    const double high = x + y, part = high - x;
    *low = (x - (high - part)) + (y - part);
    return high;
}

/* Halves of at most 26 bits, whose products are exact. */
static double upper_half(double x)
{
    const double scaled = 134217729 * x; /* 2^27 + 1 */
    return scaled - (scaled - x);
}

/* high + low is x y. */
static double product_of(double x, double y, double *low)
{
    const double high = x * y, x1 = upper_half(x), y1 = upper_half(y), x2 = x - x1, y2 = y - y1;
    *low = x2 * y2 - (((high - x1 * y1) - x2 * y1) - x1 * y2);
    return high;
}

/* x + y, to the neighbour with an odd last bit where it is not exact. */
static double odd_sum(double x, double y)
{
    double error, sum = sum_of(x, y, &error);
    int64_t bits;
    memcpy(&bits, &sum, sizeof bits);
    if (error != 0 && !(bits & 1)) {
        bits += (error > 0) == (sum > 0) ? 1 : -1;
        memcpy(&sum, &bits, sizeof sum);
    }
    return sum;
}

static __attribute__((noinline)) double hard_sum(double a, double b, double c)
{
    const double least = 0x1p-800, most = 0x1p900, product = fabs(a * b);
    if (!(product > least && product < most && fabs(c) < most && fabs(a) < most && fabs(b) < most))
        return a == 0 || b == 0 ? a * b + c : of_library(a, b, c); /* a product of zero has no rounding */
    double product_low, middle_low, high_low;
    const double product_high = product_of(a, b, &product_low), middle = sum_of(c, product_low, &middle_low),
                 high = sum_of(product_high, middle, &high_low);
    return high + odd_sum(middle_low, high_low);
}

/* The product and its error, and the sum and its error, are exact; `rest` is the sum of both errors within half a unit
 * of its last place, and its neighbours are at least as far. Infinite parts make NaN, whose results are unequal. */
double kmp_rounded_once(double a, double b, double c)
{
    const double least = 0x1p-800;
    double product_low, low;
    const double product = product_of(a, b, &product_low), sum = sum_of(product, c, &low), rest = low + product_low;
    const double result = sum + rest * (1 + 0x1p-52), other = sum + rest * (1 - 0x1p-52);
    return fabs(product) > least && result == other ? result : hard_sum(a, b, c);
}

#if defined(_WIN32)
__attribute__((target("fma"))) static double fused_instruction(double a, double b, double c)
{
    return __builtin_fma(a, b, c);
}

double kmp_fused_sum(double a, double b, double c) __asm__("fma");
double kmp_fused_sum(double a, double b, double c)
{
    return __builtin_cpu_supports("fma") ? fused_instruction(a, b, c) : kmp_rounded_once(a, b, c);
}
#elif !defined(__EMSCRIPTEN__)
double kmp_fused_sum(double a, double b, double c) __asm__("__wrap_fma");
double kmp_fused_sum(double a, double b, double c)
{
    return kmp_rounded_once(a, b, c);
}
#endif
