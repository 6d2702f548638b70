/* SPDX-License-Identifier: BSD-3-Clause */
/* The fields of a beam's shapes over xi = x/length, in lengths of the beam: displacement of the axis, rotation of the
 * sections, strain. With shear forces they are linear in s = E I/(k G A length^2) of either plane. */
#pragma once

#include "model/flexible/beam.h"

/** Fields are sums of parts times 1, s_y, s_z, s_y^2, s_y s_z, s_z^2. */
enum { KMP_BEAM_PARTS = 6 };

typedef struct kmp_beam_field {
    kmp_polynomial part[KMP_BEAM_PARTS];
} kmp_beam_field;

/** An integral of fields, by the same parts. */
typedef struct kmp_beam_amount {
    double part[KMP_BEAM_PARTS];
} kmp_beam_amount;

typedef struct kmp_beam_shape {
    kmp_beam_family family;
    kmp_polynomial own;                        /* the polynomial that it is made of */
    kmp_beam_field turn[3], strain[3], way[3]; /* theta, gamma, r1 */
} kmp_beam_shape;

/** The field beyond xi = from, over 0 .. 1. */
void kmp_beam_field_cut(kmp_beam_field *field, double from);

/** The integral of a b times the polynomial of a term of numbers that change along the beam; a or b may have the
 * squares of s if the other one has none. */
kmp_beam_amount kmp_beam_field_mean(const kmp_beam_field *a, const kmp_beam_field *b, const kmp_taper_share *share);

/** The integral of a field times a polynomial, and the integral of a term over the beam. */
kmp_beam_amount kmp_beam_field_mean_with(const kmp_beam_field *a, const kmp_polynomial *b,
                                         const kmp_taper_share *share);

/** The shapes of all families, in the order of the coordinates; there is room for them. `s`: the values of s in both
 * planes. Modes belong to the span, the slowest first, each with its largest deflection 1; false: no positive
 * stiffness. */
bool kmp_beam_shapes(const kmp_beam *beam, const double s[2], kmp_beam_shape *shapes);

/** The modes of n x n stiffness and mass: columns x of x' K x = 1, x' M x = values, which descend; the inputs are lost.
 * False: the stiffness is not positive. n is at most KMP_BEAM_MOST. */
bool kmp_beam_modes(int n, double *stiffness, double *mass, double *x, double *values);

/** Of the fields of second order, symmetric in two shapes: the displacement r2 of the axis; columns y and
 * z of the sections' turn R2, [a][b - 1]; the second derivatives of the three angles. */
typedef struct kmp_beam_second {
    kmp_beam_field way[3];
    kmp_beam_field section[3][2];
} kmp_beam_second;

void kmp_beam_second_order(const kmp_beam_shape *a, const kmp_beam_shape *b, kmp_beam_second *second);
void kmp_beam_second_angles(const kmp_beam_shape *a, const kmp_beam_shape *b, kmp_beam_field angle[3]);

/** Orthogonal polynomials whose sums the displacements of second order along one axis are, for all pairs of shapes. */
typedef struct kmp_beam_basis {
    int count;
    kmp_polynomial function[KMP_POLYNOMIAL_ROOM];
    kmp_beam_amount *part; /* count x pairs: of each function in the displacement of each pair */
} kmp_beam_basis;

/** The basis along axis c, with as few functions as the displacements have; false: no memory. */
bool kmp_beam_basis_of(kmp_arena *arena, int pairs, const kmp_beam_second *second, int c, kmp_beam_basis *basis);
