/* SPDX-License-Identifier: BSD-3-Clause */
/* a b + c with one rounding by an instruction of the engine of WebAssembly, f64x2.relaxed_madd. The compiler does not
 * know it, so that a separate module has it (relaxed_sums.c). Results equal results of fma(). */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/** d, x, y and z are arrays of a number of bytes, a multiple of 16. */
typedef void kmp_relaxed_lanes(double *d, const double *x, const double *y, const double *z, size_t bytes);

typedef struct kmp_relaxed_sums {
    double (*sum)(double a, double b, double c);
    /** v[d] = v[a] * v[b] + v[c] for records {d, a, b, c} of 16 bits or of 32, from the first to the end. */
    void (*narrow)(const void *first, const void *end, double *v);
    void (*wide)(const void *first, const void *end, double *v);
    kmp_relaxed_lanes *product_add, *product_sub, *sub_product; /* d = x y + z, x y - z, z - x y */
} kmp_relaxed_sums;

/** NULL where this is not WebAssembly, the engine has no such instruction, or hard cases show that it rounds twice. The
 * first call finds out. */
#ifdef __wasm__
extern const kmp_relaxed_sums *kmp_relaxed_found;
extern bool kmp_relaxed_tried;
void kmp_relaxed_try(void);

static inline const kmp_relaxed_sums *kmp_relaxed_sums_here(void)
{
    if (!kmp_relaxed_tried)
        kmp_relaxed_try();
    return kmp_relaxed_found;
}
#else
static inline const kmp_relaxed_sums *kmp_relaxed_sums_here(void)
{
    return NULL;
}
#endif
