/* SPDX-License-Identifier: BSD-3-Clause */
/* Dimensions are linear in each piece, so that areas and their moments are polynomials there. The coefficients are
 * numbers of the model; integrals of products of Legendre polynomials are doubles. A sum is fitted by the rule of Gauss
 * (Abramowitz and Stegun 1964, 25.4.29), which is exact where the function is such a sum. */
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

/* -- pieces ------------------------------------------------------------------------------------------ */

static double end_of(const kmp_taper *a)
{
    return a->next ? a->end : 1;
}

int kmp_taper_shares(const kmp_taper *a)
{
    int count = 0;
    for (; a; a = a->next)
        count += a->count;
    return count;
}

kmp_taper_share kmp_taper_share_of(const kmp_taper *a, int k)
{
    double from = 0;
    for (; a->next && k >= a->count; a = a->next) {
        k -= a->count;
        from = a->end;
    }
    return (kmp_taper_share){from, end_of(a), k, a->c[k]};
}

double kmp_taper_share_mean(const kmp_taper_share *share, const kmp_polynomial *p, const kmp_polynomial *q)
{
    const kmp_polynomial term = kmp_taper_term(share->degree);
    if (p->count == 0 || q->count == 0)
        return 0;
    if (share->from <= 0 && share->to >= 1) {
        const kmp_polynomial whole = kmp_polynomial_product(&term, p);
        return kmp_polynomial_mean(&whole, q);
    }
    const kmp_polynomial own = kmp_polynomial_part(p, share->from, share->to);
    const kmp_polynomial other = kmp_polynomial_part(q, share->from, share->to);
    const kmp_polynomial product = kmp_polynomial_product(&term, &own);
    return (share->to - share->from) * kmp_polynomial_mean(&product, &other);
}

/* A piece behind the last one, which ends at xi = end; NULL: no memory. */
static kmp_taper *add_piece(kmp_arena *arena, kmp_taper *last, double end)
{
    kmp_taper *next = KMP_ARENA_NEW(arena, kmp_taper, 1);
    last->end = end;
    last->next = next;
    return next;
}

typedef kmp_taper piece_function(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b);

/* A function of both, piece by piece. */
static kmp_taper by_pieces(kmp_arena *arena, piece_function *function, const kmp_taper *a, const kmp_taper *b)
{
    kmp_taper made = function(arena, a, b), *last = &made;
    while (a->next || b->next) {
        last = add_piece(arena, last, a->next ? a->end : b->end);
        a = a->next ? a->next : a;
        b = b->next ? b->next : b;
        if (!last)
            break;
        *last = function(arena, a, b);
    }
    return made;
}

bool kmp_taper_varies(const kmp_taper *a)
{
    return a->count > 1 || a->next;
}

bool kmp_taper_is_nothing(const kmp_taper *a)
{
    bool nothing = true;
    for (int k = 0; k < kmp_taper_shares(a); k++)
        nothing = nothing && kmp_number_is_nothing(kmp_taper_share_of(a, k).c);
    return nothing;
}

/* -- arithmetic -------------------------------------------------------------------------------------- */

/* Adds factor * a to term j. */
static void add_to_term(kmp_arena *arena, kmp_taper *to, int j, double factor, kmp_number a)
{
    if (factor == 0 || kmp_number_is_nothing(a))
        return;
    for (; to->count <= j; to->count++)
        to->c[to->count] = (kmp_number){.value = 0};
    to->c[j] = kmp_number_add(arena, to->c[j], kmp_number_scale(arena, factor, a));
}

static kmp_taper line_between(kmp_arena *arena, kmp_number first, kmp_number last)
{
    kmp_taper made = kmp_taper_constant(first);
    if (kmp_number_same(first, last))
        return made;
    made.c[0] = kmp_number_scale(arena, 0.5, kmp_number_add(arena, first, last));
    add_to_term(arena, &made, 1, 0.5, kmp_number_subtract(arena, last, first));
    return made;
}

kmp_taper kmp_taper_linear(kmp_arena *arena, int count, const double *xi, const kmp_number *values)
{
    kmp_taper made = line_between(arena, values[0], values[1]), *last = &made;
    for (int k = 2; k < count && (last = add_piece(arena, last, xi[k - 1])); k++)
        *last = line_between(arena, values[k - 1], values[k]);
    return made;
}

static kmp_taper sum_of(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b)
{
    kmp_taper sum = *a;
    sum.next = NULL;
    for (int j = 0; j < b->count; j++)
        add_to_term(arena, &sum, j, 1, b->c[j]);
    return sum;
}

kmp_taper kmp_taper_add(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b)
{
    return by_pieces(arena, sum_of, a, b);
}

static kmp_taper product_of(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b)
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

kmp_taper kmp_taper_times(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b)
{
    return by_pieces(arena, product_of, a, b);
}

/* a times the first number of b */
static kmp_taper multiple_of(kmp_arena *arena, const kmp_taper *a, const kmp_taper *b)
{
    kmp_taper made = {.count = a->count};
    for (int j = 0; j < a->count; j++)
        made.c[j] = kmp_number_times(arena, b->c[0], a->c[j]);
    return made;
}

kmp_taper kmp_taper_scale(kmp_arena *arena, kmp_number factor, const kmp_taper *a)
{
    const kmp_taper number = kmp_taper_constant(factor);
    return by_pieces(arena, multiple_of, a, &number);
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

/* Over from .. to. */
static kmp_taper fit_piece(kmp_arena *arena, kmp_taper_function *function, const void *user, double from, double to)
{
    kmp_taper made = {0};
    for (int k = 0; k < KMP_TAPER_TERMS; k++) {
        double weight;
        const double xi = gauss_place(k, &weight);
        const kmp_number value = function(user, from + (to - from) * xi);
        for (int j = 0; j < KMP_TAPER_TERMS; j++) {
            const kmp_polynomial term = kmp_taper_term(j);
            add_to_term(arena, &made, j, (2 * j + 1) * weight * kmp_polynomial_at(&term, xi), value);
        }
    }
    return made;
}

kmp_taper kmp_taper_fit(kmp_arena *arena, const kmp_taper *like, kmp_taper_function *function, const void *user)
{
    kmp_taper made = fit_piece(arena, function, user, 0, end_of(like)), *last = &made;
    for (; like->next && (last = add_piece(arena, last, like->end)); like = like->next)
        *last = fit_piece(arena, function, user, like->end, end_of(like->next));
    return made;
}

/* -- values, parts ----------------------------------------------------------------------------------- */

kmp_number kmp_taper_at(kmp_arena *arena, const kmp_taper *a, kmp_number xi)
{
    kmp_number sum = {.value = 0};
    double from = 0;
    for (; a->next && xi.value > a->end; a = a->next)
        from = a->end;
    if (from > 0 || a->next)
        xi = kmp_number_scale(arena, 1 / (end_of(a) - from),
                              kmp_number_subtract(arena, xi, (kmp_number){.value = from}));
    for (int j = 0; j < a->count; j++) {
        const kmp_polynomial term = kmp_taper_term(j);
        sum = kmp_number_add(arena, sum, kmp_number_times(arena, a->c[j], kmp_polynomial_number(arena, &term, xi)));
    }
    return sum;
}

/* The part of one piece, by its own length. */
static kmp_taper cut_piece(kmp_arena *arena, const kmp_taper *a, double from, double to)
{
    kmp_taper made = {0};
    for (int j = 0; j < a->count; j++) {
        const kmp_polynomial term = kmp_taper_term(j), part = kmp_polynomial_part(&term, from, to);
        for (int k = 0; k < part.count; k++)
            add_to_term(arena, &made, k, part.c[k], a->c[j]);
    }
    return made;
}

kmp_taper kmp_taper_part(kmp_arena *arena, const kmp_taper *a, double from, double to)
{
    const double rounding = 1e-12;
    kmp_taper made = {0}, *last = &made;
    double begin = 0, made_to = from; /* of the piece; what is made */
    for (; a && last; begin = end_of(a), a = a->next) {
        const double width = end_of(a) - begin, up_to = fmin(end_of(a), to);
        if (a->next && up_to - made_to <= rounding)
            continue;
        if (made_to > from)
            last = add_piece(arena, last, (made_to - from) / (to - from));
        if (last)
            *last = cut_piece(arena, a, (made_to - begin) / width, (up_to - begin) / width);
        made_to = up_to;
        if (to - made_to <= rounding)
            break;
    }
    return made;
}

kmp_number kmp_taper_coefficient(kmp_arena *arena, const kmp_taper *a, int j)
{
    const kmp_polynomial one = kmp_taper_term(0), term = kmp_taper_term(j);
    kmp_number sum = {.value = 0};
    if (!a->next)
        return j < a->count ? a->c[j] : sum;
    for (int k = 0; k < kmp_taper_shares(a); k++) {
        const kmp_taper_share share = kmp_taper_share_of(a, k);
        sum = kmp_number_add(arena, sum,
                             kmp_number_scale(arena, (2 * j + 1) * kmp_taper_share_mean(&share, &one, &term), share.c));
    }
    return sum;
}
