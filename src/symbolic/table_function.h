/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions of one variable given by points: straight lines, a cubic spline, or monotone cubics through them.
 *
 * The spline is not-a-knot (the first two and the last two pieces are one cubic each; three points make a parabola, two
 * a line), so that a table of a cubic is that cubic. Beyond its ends a table is extrapolated linearly: value and
 * derivative are continuous there. At a knot the piece on its right counts. */
#pragma once

#include "base/arena.h"
#include "symbolic/graph.h"
#include <stdatomic.h>

typedef enum kmp_table_method {
    KMP_TABLE_LINEAR,
    KMP_TABLE_CUBIC,
    KMP_TABLE_MONOTONE,
    KMP_TABLE_PERIODIC,       /* splines with the period of their range (base/spline.h) */
    KMP_TABLE_PERIODIC_SHAPE, /* monotone ones */
    KMP_TABLE_METHODS
} kmp_table_method;

/* Read-only once made, but for the count of its owners. */
typedef struct kmp_table {
    kmp_arena arena;  /* of all arrays */
    atomic_int *owns; /* number of owners; the last one frees the table */
    kmp_table_method method;
    int count;          /* knots, at least 2 */
    double *x, *y;      /* count: x increasing */
    double (*piece)[4]; /* count - 1: y = sum piece[k][i] (x - x[k])^i */
    int *knot;          /* by equal part of the range, + 1: the last knot but one that is not right of a place in it */
    int last_part;
    double per_length; /* parts over the range */
    double last_slope; /* at the last knot */
} kmp_table;

/** -1 when a table can be made of the points; otherwise the index of the first point that is not finite or whose x does
 * not exceed the one before it. With fewer than two points, their count. */
int kmp_table_check(int count, const double *x, const double *y);

/** Copies the points, which must have passed kmp_table_check. NULL: no memory. */
kmp_table *kmp_table_new(kmp_table_method method, int count, const double *x, const double *y);
void kmp_table_free(kmp_table *table);

/** The table for a further owner, who frees it too. */
kmp_table *kmp_table_share(kmp_table *table);

/** True if method and points are equal, to the bit: to the points of another table, to given ones. */
bool kmp_table_equal(const kmp_table *a, const kmp_table *b);
bool kmp_table_is_of(const kmp_table *table, kmp_table_method method, int count, const double *x, const double *y);

/** Value (derivative 0) or derivative of a given order at x; NaN for NaN. Its piece is found by the part of
 *  the range that x is in: no state, no allocation. */
double kmp_table_value(const kmp_table *table, int derivative, double x);
/** The same. Piece number *piece is tried first, whatever it is; then it is the one that x is in, if there is one. */
double kmp_table_value_near(const kmp_table *table, int derivative, double x, int *piece);
/** Bounds of the table, or of a derivative of a given order, while x is within [from, to]. */
void kmp_table_bounds(const kmp_table *table, int derivative, double from, double to, double *low, double *high);

/** The last knot but one that is not right of x, of the knots of a part. Mostly one knot is tested. */
static inline int kmp_table_knot(const kmp_table *t, int part, double x)
{
    int low = t->knot[part], high = t->knot[part + 1];
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (t->x[middle] <= x)
            low = middle;
        else
            high = middle;
    }
    return low + (-(t->x[high] <= x) & (high - low)); /* without a jump, which nothing would predict */
}

/** Derivatives of a higher order are zero everywhere: 1 or 3. */
int kmp_table_degree(const kmp_table *table);

/** "linear", "cubic", ..; the word of a model: "linear", "spline" or "monotone". */
const char *kmp_table_method_name(kmp_table_method method);
const char *kmp_table_method_word(kmp_table_method method);

/* Tables in the graph. A graph owns its tables, a program the tables that it needs. */

/** Number of the table in the graph (an equal one is not added twice); -1: no memory, or no table (NULL),
 * and the graph has failed. */
int kmp_graph_add_table(kmp_graph *g, kmp_table *table);
/** Number of the graph's table of these points; -1: there is none. */
int kmp_graph_find_points(const kmp_graph *g, kmp_table_method method, int count, const double *x, const double *y);
/** NULL when there is no such number. Owned by the graph. */
kmp_table *kmp_graph_table(const kmp_graph *g, int table);

/** A function of two variables given on a grid of points: the tensor product of the tables of one variable (de Boor, A
 * Practical Guide to Splines, ch. XVII). With the table c_j that is 1 at the knot y_j and 0 at the others, and the
 * table s_j through the values at y_j,
 *
 *     z(x, y) = sum over j of c_j(y) s_j(x)
 *
 * which is the bilinear or the bicubic interpolant, whatever the order of its variables; the sum is over the variable
 * with fewer knots. Beyond the grid it continues as tables do in either variable. */
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
