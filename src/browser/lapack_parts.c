/* SPDX-License-Identifier: BSD-3-Clause */
/* LAPACK for WebAssembly: packaging/build_wasm translates its Fortran 77 to C, in which a routine with text has one
 * further argument for each of them. Here are the routines of Fortran 90 that it contains, by their published
 * algorithms, and the entries as Kempe calls them: WebAssembly knows a function by its exact type. */
#include <complex.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>

typedef double _Complex complex_number;

/* -- numbers ----------------------------------------------------------------------------------------- */

double dlamch_(const char *which, long length);
double dlamc3_(const double *a, const double *b);
int disnan_(const double *x);
int xerbla_(const char *name, const int *argument, long length);

/* The sum as it is stored. */
double dlamc3_(const double *a, const double *b)
{
    const volatile double sum = *a + *b;
    return sum;
}

double dlamch_(const char *which, long length)
{
    (void)length;
    switch (*which | 0x20) {
    case 'e':
        return DBL_EPSILON / 2;
    case 's':
        return DBL_MIN;
    case 'b':
        return FLT_RADIX;
    case 'p':
        return DBL_EPSILON;
    case 'n':
        return DBL_MANT_DIG;
    case 'r':
        return 1;
    case 'm':
        return DBL_MIN_EXP;
    case 'u':
        return DBL_MIN;
    case 'l':
        return DBL_MAX_EXP;
    case 'o':
        return DBL_MAX;
    default:
        return 0;
    }
}

int disnan_(const double *x)
{
    return isnan(*x);
}

/* The report of a wrong argument: Kempe checks the numbers that come out. */
int xerbla_(const char *name, const int *argument, long length)
{
    (void)name, (void)argument, (void)length;
    return 0;
}

/* -- texts ------------------------------------------------------------------------------------------- */

int s_copy(char *to, const char *from, long room, long size);
int s_cat(char *to, const char *const *parts, const long *sizes, const long *count, long room);
void sig_die(const char *reason, int dumps);

/* Nothing marks the end of a text: blanks fill the rest. */
int s_copy(char *to, const char *from, long room, long size)
{
    for (long k = 0; k < room; k++)
        to[k] = k < size ? from[k] : ' ';
    return 0;
}

int s_cat(char *to, const char *const *parts, const long *sizes, const long *count, long room)
{
    long at = 0;
    for (long part = 0; part < *count; part++)
        for (long k = 0; k < sizes[part] && at < room; k++)
            to[at++] = parts[part][k];
    return s_copy(to + at, "", room - at, 0);
}

/* A complex division by zero: Kempe checks the numbers that come out. */
void sig_die(const char *reason, int dumps)
{
    (void)reason, (void)dumps;
}

/* -- norms ------------------------------------------------------------------------------------------- */

/* Sums of squares by Blue's method: large and small terms are scaled, and collected apart. */
typedef struct squares {
    double big, middle, small;
    bool has_big;
} squares;

static const double most = 0x1p486, least = 0x1p-511, shrink = 0x1p-538, stretch = 0x1p537;

/* Adds factor^2 weight; the size of the term decides about its sum. */
static void add_square(squares *s, double size, double factor, double weight)
{
    if (size > most) {
        s->big += factor * shrink * (factor * shrink) * weight;
        s->has_big = true;
    } else if (size < least) {
        if (!s->has_big)
            s->small += factor * stretch * (factor * stretch) * weight;
    } else {
        s->middle += factor * factor * weight;
    }
}

/* `parts` numbers at each of n places, which are `step` places apart. */
static void add_squares(squares *s, int n, const double *x, int step, int parts)
{
    ptrdiff_t at = step < 0 ? (ptrdiff_t)(1 - n) * step : 0;
    for (int k = 0; k < n; k++, at += step)
        for (int part = 0; part < parts; part++)
            add_square(s, fabs(x[at * parts + part]), fabs(x[at * parts + part]), 1);
}

/* scale^2 sum is the sum of all squares. */
static void combine(const squares *s, double *scale, double *sum)
{
    const bool also = s->middle > 0 || isnan(s->middle);
    *scale = 1;
    *sum = s->middle;
    if (s->big > 0) {
        *scale = 1 / shrink;
        *sum = s->big + (also ? s->middle * shrink * shrink : 0);
    } else if (s->small > 0 && also) {
        double a = sqrt(s->middle), b = sqrt(s->small) / stretch, high = b > a ? b : a, low = b > a ? a : b;
        *sum = high * high * (1 + low / high * (low / high));
    } else if (s->small > 0) {
        *scale = 1 / stretch;
        *sum = s->small;
    }
}

static double norm(int n, const double *x, int step, int parts)
{
    squares s = {0};
    double scale, sum;
    add_squares(&s, n, x, step, parts);
    combine(&s, &scale, &sum);
    return scale * sqrt(sum);
}

static int update(int n, const double *x, int step, int parts, double *scale, double *sum)
{
    if (isnan(*scale) || isnan(*sum))
        return 0;
    if (*sum == 0)
        *scale = 1;
    if (*scale == 0) {
        *scale = 1;
        *sum = 0;
    }
    if (n <= 0)
        return 0;
    squares s = {0};
    add_squares(&s, n, x, step, parts);
    if (*sum > 0)
        add_square(&s, *scale * sqrt(*sum), *scale, *sum);
    combine(&s, scale, sum);
    return 0;
}

double dnrm2_(const int *n, const double *x, const int *step);
double dznrm2_(const int *n, const double *x, const int *step);
int dlassq_(const int *n, const double *x, const int *step, double *scale, double *sum);
int zlassq_(const int *n, const double *x, const int *step, double *scale, double *sum);

double dnrm2_(const int *n, const double *x, const int *step)
{
    return norm(*n, x, *step, 1);
}

double dznrm2_(const int *n, const double *x, const int *step)
{
    return norm(*n, x, *step, 2);
}

int dlassq_(const int *n, const double *x, const int *step, double *scale, double *sum)
{
    return update(*n, x, *step, 1, scale, sum);
}

int zlassq_(const int *n, const double *x, const int *step, double *scale, double *sum)
{
    return update(*n, x, *step, 2, scale, sum);
}

/* -- plane rotations --------------------------------------------------------------------------------- */

static const double safe_least = DBL_MIN, safe_most = 1 / DBL_MIN;

static double within(double a)
{
    return fmin(safe_most, fmax(safe_least, a));
}

int dlartg_(const double *f, const double *g, double *c, double *s, double *r);
int zlartg_(const complex_number *f, const complex_number *g, double *c, complex_number *s, complex_number *r);

int dlartg_(const double *f, const double *g, double *c, double *s, double *r)
{
    const double low = sqrt(safe_least), high = sqrt(safe_most / 2), f1 = fabs(*f), g1 = fabs(*g), f0 = *f, g0 = *g;
    if (g0 == 0) {
        *c = 1;
        *s = 0;
        *r = f0;
    } else if (f0 == 0) {
        *c = 0;
        *s = copysign(1, g0);
        *r = g1;
    } else if (f1 > low && f1 < high && g1 > low && g1 < high) {
        double d = sqrt(f0 * f0 + g0 * g0);
        *c = f1 / d;
        *r = copysign(d, f0);
        *s = g0 / *r;
    } else {
        double u = within(fmax(f1, g1)), fs = f0 / u, gs = g0 / u, d = sqrt(fs * fs + gs * gs);
        *c = fabs(fs) / d;
        *r = copysign(d, f0);
        *s = gs / *r;
        *r *= u;
    }
    return 0;
}

static double size_of(complex_number z)
{
    return fmax(fabs(creal(z)), fabs(cimag(z)));
}

static double square_of(complex_number z)
{
    return creal(z) * creal(z) + cimag(z) * cimag(z);
}

/* The rotation of f and g with squares f2 and h2 - f2, all of a size that has squares. */
static void rotate(complex_number f, complex_number g, double f2, double h2, double *c, complex_number *s,
                   complex_number *r)
{
    if (f2 >= h2 * safe_least) {
        *c = sqrt(f2 / h2);
        *r = f / *c;
        *s = conj(g) * (f2 > sqrt(safe_least) && h2 < 2 * sqrt(safe_most / 4) ? f / sqrt(f2 * h2) : *r / h2);
        return;
    }
    double d = sqrt(f2 * h2);
    *c = f2 / d;
    *r = *c >= safe_least ? f / *c : f * (h2 / d);
    *s = conj(g) * (f / d);
}

int zlartg_(const complex_number *f, const complex_number *g, double *c, complex_number *s, complex_number *r)
{
    const complex_number f0 = *f, g0 = *g;
    const double low = sqrt(safe_least), f1 = size_of(f0), g1 = size_of(g0), high = sqrt(safe_most / 4);
    if (g0 == 0) {
        *c = 1;
        *s = 0;
        *r = f0;
    } else if (f0 == 0) {
        double u = g1 > low && g1 < sqrt(safe_most / 2) ? 1 : within(g1), d = sqrt(square_of(g0 / u));
        *c = 0;
        *s = conj(g0 / u) / d;
        *r = d * u;
    } else if (f1 > low && f1 < high && g1 > low && g1 < high) {
        double f2 = square_of(f0);
        rotate(f0, g0, f2, f2 + square_of(g0), c, s, r);
    } else {
        double u = within(fmax(f1, g1)), v = f1 / u < low ? within(f1) : u, w = v / u, f2 = square_of(f0 / v);
        rotate(f0 / v, g0 / u, f2, f2 * w * w + square_of(g0 / u), c, s, r);
        *c *= w;
        *r *= u;
    }
    return 0;
}

/* -- entries ----------------------------------------------------------------------------------------- */

/* ENTRY(name, texts, numbers): a routine with arguments a0, a1, .. whose translation has a length for each text. All
 * arguments are addresses. */
typedef const void *place;
#define PLACES_9(a)                                                                                                    \
    place a##0, place a##1, place a##2, place a##3, place a##4, place a##5, place a##6, place a##7, place a##8
#define NAMES_9(a) a##0, a##1, a##2, a##3, a##4, a##5, a##6, a##7, a##8
#define TYPES_9    place, place, place, place, place, place, place, place, place
#define ENTRY(name, parameters, arguments, types)                                                                      \
    int f2c_##name types;                                                                                              \
    void name##_ parameters;                                                                                           \
    void name##_ parameters                                                                                            \
    {                                                                                                                  \
        (void)f2c_##name arguments;                                                                                    \
    }

ENTRY(dsyev, (PLACES_9(a)), (NAMES_9(a), 1, 1), (TYPES_9, long, long))
ENTRY(dsyevd, (PLACES_9(a), place b, place c), (NAMES_9(a), b, c, 1, 1), (TYPES_9, place, place, long, long))
ENTRY(dsygv, (PLACES_9(a), place b, place c, place d), (NAMES_9(a), b, c, d, 1, 1),
      (TYPES_9, place, place, place, long, long))
ENTRY(dsygvd, (PLACES_9(a), place b, place c, place d, place e, place f), (NAMES_9(a), b, c, d, e, f, 1, 1),
      (TYPES_9, place, place, place, place, place, long, long))
ENTRY(dgelsy, (PLACES_9(a), place b, place c, place d, place e), (NAMES_9(a), b, c, d, e),
      (TYPES_9, place, place, place, place))
ENTRY(dgesvd, (PLACES_9(a), place b, place c, place d, place e, place f), (NAMES_9(a), b, c, d, e, f, 1, 1),
      (TYPES_9, place, place, place, place, place, long, long))
ENTRY(zgeev, (PLACES_9(a), place b, place c, place d, place e, place f), (NAMES_9(a), b, c, d, e, f, 1, 1),
      (TYPES_9, place, place, place, place, place, long, long))
ENTRY(dgeevx, (PLACES_9(a), PLACES_9(b), place c, place d, place e, place f, place g),
      (NAMES_9(a), NAMES_9(b), c, d, e, f, g, 1, 1, 1, 1),
      (TYPES_9, TYPES_9, place, place, place, place, place, long, long, long, long))
