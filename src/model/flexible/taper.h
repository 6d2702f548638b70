/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers of the sections of a beam, which may change along it: its mass by length, its stiffness, its areas. */
#pragma once

#include "model/flexible/polynomial.h"

/* Enough for the products of four dimensions that are linear in xi, and for what is fitted to a smooth function. */
enum { KMP_TAPER_TERMS = 16 };

/** A sum of shifted Legendre polynomials of xi = x/length; of a beam with one section the first of them alone. Zero
 * without terms. */
typedef struct kmp_taper {
    int count;
    kmp_number c[KMP_TAPER_TERMS];
} kmp_taper;

/** The polynomial of term j. */
kmp_polynomial kmp_taper_term(int j);

kmp_taper kmp_taper_constant(kmp_number number);

/** From `first` at xi = 0 to `last` at xi = 1, linear between. */
kmp_taper kmp_taper_linear(kmp_arena *arena, kmp_number first, kmp_number last);

kmp_taper kmp_taper_add(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b);
kmp_taper kmp_taper_times(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b); /* there are terms for it */
kmp_taper kmp_taper_scale(kmp_arena *arena, kmp_number factor, const kmp_taper *a);

/** A sum that is fitted to a function, by its values at as many places as there are terms. */
typedef kmp_number kmp_taper_function(const void *user, double xi);
kmp_taper kmp_taper_fit(kmp_arena *arena, kmp_taper_function *function, const void *user);

/** The value at xi. */
kmp_number kmp_taper_at(kmp_arena *arena, const kmp_taper *a, kmp_number xi);

/** The part from `from` to `to`, over 0 .. 1. */
kmp_taper kmp_taper_part(kmp_arena *arena, const kmp_taper *a, double from, double to);

/** True if it is zero everywhere. */
bool kmp_taper_is_nothing(const kmp_taper *a);
