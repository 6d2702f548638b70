/* SPDX-License-Identifier: BSD-3-Clause */
/* With t = 2 xi - 1: (j + 1) P_(j+1) = (2 j + 1) t P_j - j P_(j-1). Values and products by Clenshaw's recurrence from
 * the last coefficient (Clenshaw 1955), of numbers or of polynomials; even and odd parts remain apart to the last
 * bit. */
#include "model/flexible/polynomial.h"
#include <float.h>
#include <math.h>

/* Of a sum, by the sum of the sizes of its terms. */
#define ROUNDING (8 * DBL_EPSILON)

void kmp_polynomial_add(kmp_polynomial *to, double factor, const kmp_polynomial *p)
{
    for (int j = 0; j < p->count; j++)
        to->c[j] = (j < to->count ? to->c[j] : 0) + factor * p->c[j];
    to->count = p->count > to->count ? p->count : to->count;
}

/* t p */
static kmp_polynomial times_t(const kmp_polynomial *p)
{
    kmp_polynomial made = {.count = p->count > 0 ? p->count + 1 : 0};
    for (int j = 0; j < p->count; j++) {
        made.c[j + 1] += (j + 1) * p->c[j] / (2 * j + 1);
        if (j > 0)
            made.c[j - 1] += j * p->c[j] / (2 * j + 1);
    }
    return made;
}

kmp_polynomial kmp_polynomial_times_place(const kmp_polynomial *p)
{
    kmp_polynomial made = {0}, turned = times_t(p);
    kmp_polynomial_add(&made, 0.5, p);
    kmp_polynomial_add(&made, 0.5, &turned);
    return made;
}

kmp_polynomial kmp_polynomial_product(const kmp_polynomial *p, const kmp_polynomial *q)
{
    kmp_polynomial last = {0}, before = {0}; /* of j + 1 and j + 2 */
    for (int j = q->count > 0 ? p->count - 1 : -1; j >= 0; j--) {
        kmp_polynomial next = {0}, turned = times_t(&last);
        kmp_polynomial_add(&next, p->c[j], q);
        kmp_polynomial_add(&next, (2 * j + 1.0) / (j + 1), &turned);
        kmp_polynomial_add(&next, -(j + 1.0) / (j + 2), &before);
        before = last;
        last = next;
    }
    return last;
}

kmp_polynomial kmp_polynomial_derivative(const kmp_polynomial *p)
{
    kmp_polynomial made = {.count = p->count > 1 ? p->count - 1 : 0};
    for (int j = made.count - 1; j >= 0; j--)
        made.c[j] = (2 * j + 1) * (2 * p->c[j + 1] + (j + 2 < made.count ? made.c[j + 2] / (2 * j + 5) : 0));
    return made;
}

kmp_polynomial kmp_polynomial_integral(const kmp_polynomial *p)
{
    kmp_polynomial made = {.count = p->count > 0 ? p->count + 1 : 0};
    double start = 0;
    for (int j = 0; j < p->count; j++) {
        made.c[j + 1] += p->c[j] / (2 * (2 * j + 1));
        if (j > 0)
            made.c[j - 1] -= p->c[j] / (2 * (2 * j + 1));
    }
    for (int j = 0; j < made.count; j++)
        start += j % 2 == 0 ? made.c[j] : -made.c[j];
    made.c[0] -= start;
    return made;
}

/* With t = from + to - 1 + (to - from) (2 s - 1). */
kmp_polynomial kmp_polynomial_part(const kmp_polynomial *p, double from, double to)
{
    const double middle = from + (to - 1), width = to - from;
    kmp_polynomial last = {0}, before = {0};
    for (int j = p->count - 1; j >= 0; j--) {
        kmp_polynomial next = {.count = 1, .c = {p->c[j]}}, turned = times_t(&last);
        kmp_polynomial_add(&next, (2 * j + 1.0) / (j + 1) * middle, &last);
        kmp_polynomial_add(&next, (2 * j + 1.0) / (j + 1) * width, &turned);
        kmp_polynomial_add(&next, -(j + 1.0) / (j + 2), &before);
        before = last;
        last = next;
    }
    return last;
}

double kmp_polynomial_at(const kmp_polynomial *p, double xi)
{
    double t = 2 * xi - 1, last = 0, before = 0, size = 0;
    for (int j = p->count - 1; j >= 0; j--) {
        size += fabs(p->c[j]);
        double next = p->c[j] + (2 * j + 1.0) / (j + 1) * t * last - (j + 1.0) / (j + 2) * before;
        before = last;
        last = next;
    }
    return fabs(last) > ROUNDING * size ? last : 0;
}

kmp_number kmp_polynomial_number(kmp_arena *arena, const kmp_polynomial *p, kmp_number xi)
{
    static const kmp_number one = {.value = 1};
    if (!xi.expr)
        return (kmp_number){.value = kmp_polynomial_at(p, xi.value)};
    kmp_number t = kmp_number_subtract(arena, kmp_number_scale(arena, 2, xi), one);
    kmp_number last = {.value = 0}, before = {.value = 0};
    for (int j = p->count - 1; j >= 0; j--) {
        kmp_number turned = kmp_number_times(arena, t, last);
        kmp_number next = kmp_number_add(arena, (kmp_number){.value = p->c[j]},
                                         kmp_number_scale(arena, (2 * j + 1.0) / (j + 1), turned));
        next = kmp_number_add(arena, next, kmp_number_scale(arena, -(j + 1.0) / (j + 2), before));
        before = last;
        last = next;
    }
    return last;
}

double kmp_polynomial_mean(const kmp_polynomial *p, const kmp_polynomial *q)
{
    double sum = 0, size = 0;
    for (int j = 0; j < p->count && j < q->count; j++) {
        double term = p->c[j] * q->c[j] / (2 * j + 1);
        sum += term;
        size += fabs(term);
    }
    return fabs(sum) > ROUNDING * size ? sum : 0;
}
