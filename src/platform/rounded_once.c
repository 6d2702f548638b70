/* SPDX-License-Identifier: BSD-3-Clause */
/* fma(): a b + c with one rounding, where the C library rounds more than once or is slow.
 *
 * WebAssembly has no instruction for it, and most of the time of contracted programs is spent here. The linker sends
 * calls of fma() here (--wrap); those near the ends of the range continue to the C library.
 *
 * The function of mingw-w64 differs from the instruction of the processor in the last bit of every fourth result. It is
 * replaced by the instruction, and by this algorithm on processors without it.
 *
 * The product and the sums are split into a number and its error, and the last sum but one is rounded to odd, after
 * which the last one rounds correctly (Boldo and Melquiond, IEEE Transactions on Computers 57 (2008) 462). */
#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(_WIN32)
double kmp_fused_sum(double a, double b, double c) __asm__("fma");

__attribute__((target("fma"))) static double fused_instruction(double a, double b, double c)
{
    return __builtin_fma(a, b, c);
}

/* Near the ends of the range; two roundings. */
static double kmp_fma_of_library(double a, double b, double c)
{
    return (double)fmal(a, b, c);
}
#else
double kmp_fused_sum(double a, double b, double c) __asm__("__wrap_fma");
double kmp_fma_of_library(double a, double b, double c) __asm__("__real_fma");
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

double kmp_fused_sum(double a, double b, double c)
{
#if defined(_WIN32)
    if (__builtin_cpu_supports("fma"))
        return fused_instruction(a, b, c);
#endif
    const double least = 0x1p-800, most = 0x1p900, product = fabs(a * b);
    if (!(product > least && product < most && fabs(c) < most && fabs(a) < most && fabs(b) < most))
        return a == 0 || b == 0 ? a * b + c : kmp_fma_of_library(a, b, c); /* a product of zero has no rounding */
    double product_low, middle_low, high_low;
    const double product_high = product_of(a, b, &product_low), middle = sum_of(c, product_low, &middle_low),
                 high = sum_of(product_high, middle, &high_low);
    return high + odd_sum(middle_low, high_low);
}
