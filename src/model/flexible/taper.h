/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers of the sections of a beam, which may change along it: its mass by length, its stiffness, its areas. */
#pragma once

#include "model/flexible/polynomial.h"

/* Enough for the products of four dimensions that are linear in xi, and for what is fitted to a smooth function. */
enum { KMP_TAPER_TERMS = 16 };

/** Pieces one behind the other, from xi = x/length 0 to 1. Each is a sum of shifted Legendre polynomials over its own
 * length; of a beam with one section only the first of them. Zero without terms. */
typedef struct kmp_taper {
    int count;
    kmp_number c[KMP_TAPER_TERMS];
    double end;             /* xi of the end of the piece, where another one follows */
    struct kmp_taper *next; /* NULL: it is the last one */
} kmp_taper;

/** A term: c times the Legendre polynomial of this degree over from .. to, zero elsewhere. */
typedef struct kmp_taper_share {
    double from, to;
    int degree;
    kmp_number c;
} kmp_taper_share;

/** The number of terms of all pieces, and one of them. */
int kmp_taper_shares(const kmp_taper *a);
kmp_taper_share kmp_taper_share_of(const kmp_taper *a, int k);

/** The integral of p q times the polynomial of a term over the beam. */
double kmp_taper_share_mean(const kmp_taper_share *share, const kmp_polynomial *p, const kmp_polynomial *q);

/** The Legendre polynomial of degree j. */
kmp_polynomial kmp_taper_term(int j);

kmp_taper kmp_taper_constant(kmp_number number);

/** Linear between `count` values, the first at xi = 0, the last at xi = 1. */
kmp_taper kmp_taper_linear(kmp_arena *arena, int count, const double *xi, const kmp_number *values);

/** Of two with the same pieces, or constant. */
kmp_taper kmp_taper_add(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b);
kmp_taper kmp_taper_times(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b); /* there are terms for it */
kmp_taper kmp_taper_scale(kmp_arena *arena, kmp_number factor, const kmp_taper *a);

/** Sums that are fitted to a function over the pieces of another taper, by its values at as many places as there are
 * terms. */
typedef kmp_number kmp_taper_function(const void *user, double xi);
kmp_taper kmp_taper_fit(kmp_arena *arena, const kmp_taper *like, kmp_taper_function *function, const void *user);

/** The value at xi. */
kmp_number kmp_taper_at(kmp_arena *arena, const kmp_taper *a, kmp_number xi);

/** The part from `from` to `to`, over 0 .. 1. */
kmp_taper kmp_taper_part(kmp_arena *arena, const kmp_taper *a, double from, double to);

/** Its Legendre coefficient of degree j over 0 .. 1. */
kmp_number kmp_taper_coefficient(kmp_arena *arena, const kmp_taper *a, int j);

/** True if it is not the same everywhere. */
bool kmp_taper_varies(const kmp_taper *a);

/** True if it is zero everywhere. */
bool kmp_taper_is_nothing(const kmp_taper *a);
