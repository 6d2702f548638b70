/* SPDX-License-Identifier: BSD-3-Clause */
/* a b + c with one rounding from sums and products, for platforms whose fma() is slow or rounds more than once. */
#pragma once

/** To the nearest number, ties to even. Near the ends of the range it is the C library's. */
double kmp_rounded_once(double a, double b, double c);
