/* SPDX-License-Identifier: BSD-3-Clause */
/* Products of vectors of three numbers, in line. Generated simulators have this file too. */
#pragma once

static inline double kmp_dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void kmp_cross3(const double a[3], const double b[3], double c[3])
{
    for (int i = 0; i < 3; i++)
        c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}
