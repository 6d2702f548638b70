/* SPDX-License-Identifier: BSD-3-Clause */
/* The coefficients are numbers of the model; those of products of Legendre polynomials are doubles. A sum is fitted by
 * the rule of Gauss (Abramowitz and Stegun 1964, 25.4.29), which is exact where the function is such a sum. */
#include "model/flexible/taper.h"
#include <math.h>

kmp_polynomial kmp_taper_term(int j)
{
    kmp_polynomial term = {.count = j + 1};
    term.c[j] = 1;
    return term;
}

kmp_taper kmp_taper_constant(kmp_number number)
{
    return (kmp_taper){.count = 1, .c = {number}};
}

static bool is_nothing(kmp_number a)
{
    return a.value == 0 && !a.expr;
}

bool kmp_taper_is_nothing(const kmp_taper *a)
{
    bool nothing = true;
    for (int j = 0; j < a->count; j++)
        nothing = nothing && is_nothing(a->c[j]);
    return nothing;
}

/* Adds factor * a to term j. */
static void add_to_term(kmp_arena *arena, kmp_taper *to, int j, double factor, kmp_number a)
{
    if (factor == 0 || is_nothing(a))
        return;
    for (; to->count <= j; to->count++)
        to->c[to->count] = (kmp_number){.value = 0};
    to->c[j] = kmp_number_add(arena, to->c[j], kmp_number_scale(arena, factor, a));
}

kmp_taper kmp_taper_linear(kmp_arena *arena, kmp_number first, kmp_number last)
{
    kmp_taper made = kmp_taper_constant(first);
    if (kmp_number_same(first, last))
        return made;
    made.c[0] = kmp_number_scale(arena, 0.5, kmp_number_add(arena, first, last));
    add_to_term(arena, &made, 1, 0.5, kmp_number_subtract(arena, last, first));
    return made;
}

kmp_taper kmp_taper_add(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b)
{
    kmp_taper sum = *a;
    for (int j = 0; j < b->count; j++)
        add_to_term(arena, &sum, j, 1, b->c[j]);
    return sum;
}

kmp_taper kmp_taper_times(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b)
{
    kmp_taper made = {0};
    for (int i = 0; i < a->count; i++)
        for (int j = 0; j < b->count; j++) {
            const kmp_number both = kmp_number_times(arena, a->c[i], b->c[j]);
            const kmp_polynomial first = kmp_taper_term(i), other = kmp_taper_term(j);
            const kmp_polynomial product = kmp_polynomial_product(&first, &other);
            for (int k = 0; k < product.count && k < KMP_TAPER_TERMS; k++)
                add_to_term(arena, &made, k, product.c[k], both);
        }
    return made;
}

kmp_taper kmp_taper_scale(kmp_arena *arena, kmp_number factor, const kmp_taper *a)
{
    kmp_taper made = {.count = a->count};
    for (int j = 0; j < a->count; j++)
        made.c[j] = kmp_number_times(arena, factor, a->c[j]);
    return made;
}

/* The zero number k of the last polynomial but one, from -cos as it is for many (the same, 22.16.6), and its weight. */
static double gauss_place(int k, double *weight)
{
    enum { STEPS = 20 }; /* they converge quadratically, in less than six */
    const double pi = 3.14159265358979323846;
    const kmp_polynomial p = kmp_taper_term(KMP_TAPER_TERMS), slope = kmp_polynomial_derivative(&p);
    double xi = 0.5 - 0.5 * cos(pi * (k + 0.75) / (KMP_TAPER_TERMS + 0.5)), step = 1;
    for (int i = 0; i < STEPS && fabs(step) > 1e-16; i++) {
        step = kmp_polynomial_at(&p, xi) / kmp_polynomial_at(&slope, xi);
        xi -= step;
    }
    const double rise = kmp_polynomial_at(&slope, xi), t = 2 * xi - 1;
    *weight = 4 / ((1 - t * t) * rise * rise);
    return xi;
}

kmp_taper kmp_taper_fit(kmp_arena *arena, kmp_taper_function *function, const void *user)
{
    kmp_taper made = {0};
    for (int k = 0; k < KMP_TAPER_TERMS; k++) {
        double weight;
        const double xi = gauss_place(k, &weight);
        const kmp_number value = function(user, xi);
        for (int j = 0; j < KMP_TAPER_TERMS; j++) {
            const kmp_polynomial term = kmp_taper_term(j);
            add_to_term(arena, &made, j, (2 * j + 1) * weight * kmp_polynomial_at(&term, xi), value);
        }
    }
    return made;
}

kmp_number kmp_taper_at(kmp_arena *arena, const kmp_taper *a, kmp_number xi)
{
    kmp_number sum = {.value = 0};
    for (int j = 0; j < a->count; j++) {
        const kmp_polynomial term = kmp_taper_term(j);
        sum = kmp_number_add(arena, sum, kmp_number_times(arena, a->c[j], kmp_polynomial_number(arena, &term, xi)));
    }
    return sum;
}

kmp_taper kmp_taper_part(kmp_arena *arena, const kmp_taper *a, double from, double to)
{
    kmp_taper made = {0};
    for (int j = 0; j < a->count; j++) {
        const kmp_polynomial term = kmp_taper_term(j), part = kmp_polynomial_part(&term, from, to);
        for (int k = 0; k < part.count; k++)
            add_to_term(arena, &made, k, part.c[k], a->c[j]);
    }
    return made;
}
