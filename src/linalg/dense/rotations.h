/* SPDX-License-Identifier: BSD-3-Clause */
/* The product of matrices of 3 x 3 numbers, in line. It has no negative zeros, so that equal rotations have equal
 * bits. */
#pragma once

#include <stdbool.h>
#include <string.h>

/** out = a' b when transposed, else a b; out may be one of them. */
static inline void kmp_product3(double a[3][3], bool transposed, double b[3][3], double out[3][3])
{
    double product[3][3] = {{0}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                product[i][j] += (transposed ? a[k][i] : a[i][k]) * b[k][j];
    memcpy(out, product, sizeof product);
}
