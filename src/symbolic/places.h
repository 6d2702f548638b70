/* SPDX-License-Identifier: BSD-3-Clause */
/* Averages over places (average.h), one place after another: for generated code, C99 without a library but libm. The
 * rules are the rules of the library, which runs eight places at once; the bits are the same. */
#ifndef KMP_PLACES_H
#define KMP_PLACES_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* LOST: without exponents this far below the largest a sum keeps 1e-10. RISING: the most that exponents may rise within
 * a group, beyond the line to the next group's middle. With places 1.2 standard deviations of the weights from each
 * other, that is as far as four of them reach. An edge of a profile, which its places do not resolve
 * (rail/model/read_wheels.c), may rise by twice that, if it has 70 degrees. If another place counts too, a sum then
 * keeps 1e-5. */
#define KMP_PLACES_LOST   24.0
#define KMP_PLACES_RISING 12.0

/* Places of a group; sums are in the lanes of a vector register. */
enum { KMP_PLACES_GROUP = 8, KMP_PLACES_LANES = 4 };

static inline double kmp_places_larger(double x, double y)
{
    return y <= x || isnan(x) ? x : y; /* NaN stays */
}

/* The place that represents a group. */
static inline size_t kmp_places_middle(size_t places, size_t group)
{
    size_t first = group * KMP_PLACES_GROUP, last = first + KMP_PLACES_GROUP - 1, end = places - 1;
    return (first + (last < end ? last : end)) / 2;
}

/* The weight of a place: half the distance of its neighbours. */
static inline double kmp_places_spacing(size_t places, const double *place, size_t k)
{
    double before = place[k > 0 ? k - 1 : 0], after = place[k < places - 1 ? k + 1 : places - 1];
    return (after - before) / 2;
}

/* Chooses the groups that may count, by the exponents in their middle; all where exponents are NaN. None where the sum
 * is below the needed value: `best` is then the group with the largest exponent in its middle. Returns their number,
 * and the first place of each. */
static inline size_t kmp_places_choose(size_t groups, const double *middle, double needed, size_t *first, size_t *best)
{
    const double *x = middle;
    double most = x[0];
    size_t count = 0, undefined = 0;
    *best = 0;
    for (size_t k = 0; k < groups; k++) {
        most = x[k] > most ? x[k] : most;
        undefined |= isnan(x[k]) != 0;
    }
    most = undefined ? NAN : most;
    if (most + 2 * KMP_PLACES_RISING < needed) {
        while (x[*best] < most)
            ++*best;
        return 0;
    }
    for (size_t k = 0; k < groups; k++) {
        double before = k > 0 ? x[k - 1] - x[k] : 0, after = k + 1 < groups ? x[k + 1] - x[k] : 0;
        double rising = before > after ? before : after;
        rising = (rising > 0 ? rising : 0) / 2 + KMP_PLACES_RISING;
        first[count] = k * KMP_PLACES_GROUP; /* without a jump, which nothing would predict */
        count += !(x[k] + rising < most - KMP_PLACES_LOST);
    }
    return count;
}

/* exp(x) for x <= 0: x = n log 2 + r, |r| <= log(2)/2, and the series of exp(r), whose remainder is below 1e-17. A
 * result below the normal range is 0. */
static inline double kmp_places_power(double x)
{
    static const double reciprocal[] = {
        1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320, 1.0 / 5040,
        1.0 / 720,        1.0 / 120,       1.0 / 24,       1.0 / 6,       0.5,          1,           1};
    const double shift = 6755399441055744.0, least = x < -700 ? -700.0 : x;
    const double n = least * 1.4426950408889634 + shift, whole = n - shift;
    const double r = (least - whole * 0.69314718055989033) - whole * 5.4979230187083712e-14;
    double sum = reciprocal[0], power;
    uint64_t bits, exponent;
    for (int k = 1; k < 14; k++)
        sum = sum * r + reciprocal[k];
    memcpy(&bits, &sum, sizeof bits);
    memcpy(&exponent, &n, sizeof exponent);
    bits += exponent << 52;
    memcpy(&power, &bits, sizeof power);
    return x < -700 ? 0 : power;
}

typedef struct kmp_places {
    size_t places, unknowns;
    const double *place; /* increasing */
    void *self;
    void (*exponent)(void *self, const double *place, double e[2]);   /* the exponent there, and the needed one */
    void (*averaged)(void *self, const double *place, double *value); /* unknowns - 1 */
    size_t *first;                                                    /* room for the groups */
    double *middle, *weight, *value, *lanes; /* room for groups, places of groups, unknowns, and four an unknown */
} kmp_places;

static inline const double *kmp_places_at(const kmp_places *s, size_t k)
{
    return &s->place[k < s->places ? k : 0];
}

static inline double kmp_places_sum(const double *x)
{
    return (x[0] + x[1]) + (x[2] + x[3]);
}

/* Weights of the groups that count, and their sum; *most: the largest exponent. */
static inline double kmp_places_weigh(const kmp_places *s, size_t count, double *most)
{
    double sum[KMP_PLACES_LANES] = {0}, e[2];
    *most = -INFINITY;
    for (size_t g = 0; g < count; g++)
        for (size_t at = s->first[g]; at < s->first[g] + KMP_PLACES_GROUP; at++) {
            s->exponent(s->self, kmp_places_at(s, at), e);
            s->weight[at] = e[0];
            *most = kmp_places_larger(*most, e[0]);
        }
    for (size_t g = 0; g < count; g++)
        for (size_t at = s->first[g]; at < s->first[g] + KMP_PLACES_GROUP; at++) {
            double spacing = at < s->places ? kmp_places_spacing(s->places, s->place, at) : 0;
            s->weight[at] = kmp_places_power(s->weight[at] - *most) * spacing;
            sum[at % KMP_PLACES_LANES] += s->weight[at];
        }
    return kmp_places_sum(sum);
}

static inline void kmp_places_add(const kmp_places *s, size_t at)
{
    s->averaged(s->self, kmp_places_at(s, at), s->value);
    for (size_t k = 0; k + 1 < s->unknowns; k++)
        s->lanes[k * KMP_PLACES_LANES + at % KMP_PLACES_LANES] += s->weight[at] * s->value[k];
}

/** The logarithm of the sum and the averages. */
static inline void kmp_places_run(const kmp_places *s, double *value)
{
    const size_t groups = (s->places + KMP_PLACES_GROUP - 1) / KMP_PLACES_GROUP;
    double e[2] = {0}, most, all;
    size_t best;
    for (size_t k = 0; k < groups; k++) {
        s->exponent(s->self, &s->place[kmp_places_middle(s->places, k)], e);
        s->middle[k] = e[0];
    }
    size_t count = kmp_places_choose(groups, s->middle, e[1], s->first, &best);
    if (count == 0) {
        const size_t at = kmp_places_middle(s->places, best);
        value[0] = s->middle[best] + log(kmp_places_spacing(s->places, s->place, at));
        s->averaged(s->self, &s->place[at], value + 1);
        return;
    }
    all = kmp_places_weigh(s, count, &most);
    value[0] = most + log(all);
    for (size_t k = 0; k < KMP_PLACES_LANES * s->unknowns; k++)
        s->lanes[k] = 0;
    for (size_t g = 0; g < count; g++)
        for (size_t at = s->first[g]; at < s->first[g] + KMP_PLACES_GROUP; at++)
            kmp_places_add(s, at);
    for (size_t k = 0; k + 1 < s->unknowns; k++)
        value[k + 1] = kmp_places_sum(s->lanes + k * KMP_PLACES_LANES) / all;
}

#endif
