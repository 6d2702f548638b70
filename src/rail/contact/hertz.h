/* SPDX-License-Identifier: BSD-3-Clause */
/* Hertz's contact without dimensions: quantities that depend on the ratio of the curvatures alone. */
#pragma once

/** Solution at t = log(along / across), with G* = shear_modulus / (1 - poisson) and k = sqrt(along across):
 *
 *     a = (N / (G* k))^(1/3) axis,  approach = (N / (G* k))^(2/3) k approach,  N = G* / sqrt(k) stiffness delta^1.5.
 *
 * b is a with -t; approach and stiffness are even in t. `ratio` is log(a/b). */
typedef struct kmp_hertz {
    double ratio, axis, approach, stiffness;
} kmp_hertz;

kmp_hertz kmp_hertz_of(double t);

/** Elliptic integrals of the complementary modulus g in (0, 1]: B, D = integrals of cos^2 x, sin^2 x over sqrt(cos^2 x
 * + g^2 sin^2 x), x from 0 to pi/2. K = B + D, E = B + g^2 D. */
void kmp_elliptic(double g, double *B, double *D);
