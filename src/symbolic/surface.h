/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions of two variables given on a grid of points: the tensor product of the tables of one variable (de Boor, A
 * Practical Guide to Splines, ch. XVII). With the table c_j that is 1 at the knot y_j and 0 at the others, and the
 * table s_j through the values at y_j,
 *
 *     z(x, y) = sum over j of c_j(y) s_j(x)
 *
 * which is the bilinear or the bicubic interpolant, whatever the order of its variables; the sum is over the variable
 * with fewer knots. Beyond the grid it goes on as tables do in either variable. */
#pragma once

#include "symbolic/table_function.h"

typedef struct kmp_surface {
    kmp_arena arena; /* of all arrays */
    int count[2];
    double *knot[2], *z; /* z[i * count[1] + j] at (x_i, y_j) */
    int sum;             /* the variable of the sum: 0 or 1 */
    kmp_table **one;     /* count[sum]: c_j, tables of that variable */
    kmp_table **through; /* s_j, of the other one */
} kmp_surface;

/** Copies the points; the knots of both variables have passed kmp_table_check. NULL: no memory. */
kmp_surface *kmp_surface_new(kmp_table_method method, const int count[2], const double *x, const double *y,
                             const double *z);
void kmp_surface_free(kmp_surface *surface);

double kmp_surface_value(const kmp_surface *surface, double x, double y);

/** z(x, y) as a node. */
kmp_ref kmp_surface_at(kmp_graph *g, const kmp_surface *surface, kmp_ref x, kmp_ref y);
#define kmp_surface_at(g, surface, x, y) KMP_LAST_FIRST_3(kmp_surface_at, g, surface, x, y)
