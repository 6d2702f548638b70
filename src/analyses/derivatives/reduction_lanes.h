/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinate partitioning at several states at once, in the lanes of vector registers: for one choice of coordinates
 * and rows, Jv factored in one order of elimination, X = (1; Bvu), and the reduced mass (reduction.h). Value k of lane
 * l is at k KMP_STAGE_LANES + l; of `count` vectors side by side, value k of vector c is number k count + c. No
 * allocation after kmp_reduction_lanes_init. */
#pragma once

#include "constraints/partition/reduction.h"
#include "constraints/partition/terms.h"

typedef struct kmp_reduction_lanes {
    const kmp_reduction *red; /* its partition and pattern */
    kmp_arena arena;
    int p, r;
    int *row, *column;                  /* r: rows of h and coordinates, by pivots */
    int slots, *slot_of, *diagonal;     /* of factors; of the entries of Jv; of pivots */
    kmp_terms lower, upper;             /* slots of L by columns, of U by rows; both of pivots */
    int *target;                        /* slots of the products of both, pivot by pivot, entry of L by entry */
    double *bound;                      /* of each entry of L: of its magnitude */
    int *pivot_of;                      /* r: of a position in v */
    int *ju_row, *ju_column;            /* of the entries of Ju: pivots, positions in u */
    int full, *full_column;             /* columns of Bvu with entries: number, positions in u */
    int *full_of;                       /* p: number of a column among these, -1: it has none */
    double *factor, *inverse, *bvu;     /* slots; r; r x full, by rows, which are pivots */
    double *mx, *mr, *diagonal_of_mass; /* n x p by rows; p x p, column-major, its factor; p: its reciprocal pivots */
    int *mass_start, *mass_row;         /* rows of the factor of mr below its diagonal, by columns */
    int *mass_child, *mass_mark;        /* p: scratch of these */
    double *dv, *room;                  /* r, by pivots; r times vectors */
} kmp_reduction_lanes;

/** Takes the choice of a reduction, which must outlive it, with the order of elimination at the evaluator's last
 * closure, and room for this number of vectors. Frees what it was before; zero initially. KEMPE_E_MEMORY. */
kempe_status kmp_reduction_lanes_init(kmp_reduction_lanes *lanes, const kmp_reduction *red, int vectors);
void kmp_reduction_lanes_free(kmp_reduction_lanes *lanes);

/** Factors Jv of the Jacobians (in the order of system->jacobian). false: the order of elimination is bad in some lane,
 * or Jv is singular there. */
bool kmp_reduction_lanes_factor(kmp_reduction_lanes *lanes, const double *jacobian);

/** dv = -Jv^-1 rows, of m rows, into lanes->dv (by pivots). */
void kmp_reduction_lanes_solve(kmp_reduction_lanes *lanes, const double *rows);

/** rows (m; zero where dropped) = factor Jv'^-1 force_v, of `count` vectors. */
void kmp_reduction_lanes_pull(kmp_reduction_lanes *lanes, int count, double factor, const double *force, double *rows);

/** Bvu, from the factors. */
void kmp_reduction_lanes_tangent(kmp_reduction_lanes *lanes, const double *jacobian);

/** out (n) = X s, of `count` vectors. */
void kmp_reduction_lanes_spread(const kmp_reduction_lanes *lanes, int count, const double *s, double *out);

/** out (p) = X' force, of `count` vectors. */
void kmp_reduction_lanes_project(const kmp_reduction_lanes *lanes, int count, const double *force, double *out);

/** out (n) += M x, for M in the order of system->mass. */
void kmp_reduction_lanes_add_mass_times(const kmp_reduction_lanes *lanes, const double *mass, const double *x,
                                        double *out);

/** X' M X and its factor. false: it is not positive in some lane. */
bool kmp_reduction_lanes_reduce(kmp_reduction_lanes *lanes, const double *mass);

/** b (p) <- Mr^-1 b, of `count` vectors. */
void kmp_reduction_lanes_solve_mass(const kmp_reduction_lanes *lanes, int count, double *b);
