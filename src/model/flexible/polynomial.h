/* SPDX-License-Identifier: BSD-3-Clause */
/* Polynomials over [0, 1] as sums of shifted Legendre polynomials P_j(2 xi - 1), which are orthogonal there: integrals
 * of products are sums of products of coefficients, without the cancellation that powers of xi have. */
#pragma once

#include "model/language/number_algebra.h"

/* Products that occur have at most twice the degree of a shape, 13: (14 - 1) + (13 - 1) and an integration. */
enum { KMP_POLYNOMIAL_ROOM = 32 };

typedef struct kmp_polynomial {
    int count; /* of coefficients, of P_0 on; 0: it is zero */
    double c[KMP_POLYNOMIAL_ROOM];
} kmp_polynomial;

/** to = to + factor * p */
void kmp_polynomial_add(kmp_polynomial *to, double factor, const kmp_polynomial *p);

/** p xi */
kmp_polynomial kmp_polynomial_times_place(const kmp_polynomial *p);

/** p q, of a degree for which there is room. */
kmp_polynomial kmp_polynomial_product(const kmp_polynomial *p, const kmp_polynomial *q);

/** dp/dxi, and the integral from 0. */
kmp_polynomial kmp_polynomial_derivative(const kmp_polynomial *p);
kmp_polynomial kmp_polynomial_integral(const kmp_polynomial *p);

/** The polynomial p(from + (to - from) s) of s: the part from `from` to `to`, in 0 .. 1. */
kmp_polynomial kmp_polynomial_part(const kmp_polynomial *p, double from, double to);

/** The value at xi; what is less than the rounding of its terms is zero. */
double kmp_polynomial_at(const kmp_polynomial *p, double xi);

/** The value where xi is a number of the model. */
kmp_number kmp_polynomial_number(kmp_arena *arena, const kmp_polynomial *p, kmp_number xi);

/** The integral of p q over [0, 1]; what is less than the rounding of its terms is zero. */
double kmp_polynomial_mean(const kmp_polynomial *p, const kmp_polynomial *q);
