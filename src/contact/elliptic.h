/* SPDX-License-Identifier: BSD-3-Clause */
/* The complete elliptic integrals of Hertz's contact. */
#pragma once

/** Elliptic integrals of the complementary modulus g in (0, 1]: B, D = integrals of cos^2 x, sin^2 x over sqrt(cos^2 x
 * + g^2 sin^2 x), x from 0 to pi/2. K = B + D, E = B + g^2 D. */
void kmp_elliptic(double g, double *B, double *D);
